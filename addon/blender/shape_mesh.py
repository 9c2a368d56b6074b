# SPDX-License-Identifier: GPL-3.0-or-later
"""A shape's arrays as a Blender mesh."""

import bpy
import numpy as np

from ...precompute.mesh.shapes import Shape


def mesh_of_shape(name: str, shape: Shape, *, smooth: bool = True) -> bpy.types.Mesh:
    """A new mesh with the shape's quads and its UV map."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(shape.points.tolist(), [], shape.quads.tolist())
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", shape.uv.astype(np.float32).ravel())
    if smooth:
        mesh.shade_smooth()
    return mesh

# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding objects to what an artist sees, also from the arrays of a shape."""

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from ...precompute.mesh.shapes import Shape


def refuse_hidden(context: bpy.types.Context) -> None:
    """Raise GratingError if the active collection is hidden: a new object in it could not be selected."""
    active = context.layer_collection
    # Of the scene's own collection, which cannot be hidden, Blender 5.3 may say that it is.
    if active.collection != context.scene.collection and not active.is_visible:
        raise GratingError(active.name, "the active collection is hidden", "show it, or choose another")


def add_object(context: bpy.types.Context, mesh: bpy.types.Mesh) -> bpy.types.Object:
    """A new object of a mesh in the active collection."""
    added = bpy.data.objects.new(mesh.name, mesh)
    context.collection.objects.link(added)
    return added


def select_only(context: bpy.types.Context, thing: bpy.types.Object) -> None:
    """Make an object active and the only one selected."""
    for other in context.selected_objects:
        other.select_set(False)
    thing.select_set(True)
    context.view_layer.objects.active = thing


def mesh_of_shape(name: str, shape: Shape, *, smooth: bool = True) -> bpy.types.Mesh:
    """A new mesh with the shape's quads and its UV map."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(shape.points.tolist(), [], shape.quads.tolist())
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", shape.uv.astype(np.float32).ravel())
    if smooth:
        mesh.shade_smooth()
    return mesh

# SPDX-License-Identifier: GPL-3.0-or-later
"""Frame maps: pictures that hold the direction of a scan, on a UV map of one mesh.

A pixel's red and green are (1 + cos a) / 2 and (1 + sin a) / 2, where a is the angle from the UV map's tangent, the
direction of U across the normal, to the scan's T, towards N x tangent."""

import bpy

from ...precompute.base.failure import GratingError
from ..scene.frame_source import BAKED_OF
from .uv_maps import fingerprint


def note_mesh(image: bpy.types.Image, mesh: bpy.types.Object, uv_map: str) -> None:
    """Note on a frame map of which mesh and UV map it was baked."""
    image[BAKED_OF] = {"uv_map": uv_map, "mesh": mesh.name, "fingerprint": fingerprint(mesh.data, uv_map)}


def check_frame_map(mesh: bpy.types.Object, image: bpy.types.Image) -> None:
    """Raise GratingError unless a frame map was baked of this mesh, which has its UV map, as both are now."""
    noted = image[BAKED_OF]
    if fingerprint(mesh.data, noted["uv_map"]) != noted["fingerprint"]:
        raise GratingError(
            f"{mesh.name}: the frame map {image.name} was baked of {noted['mesh']}, with other faces or another "
            f"{noted['uv_map']}; use Bake Frame Map on this mesh"
        )

# SPDX-License-Identifier: GPL-3.0-or-later
"""The things that show a preset: a ball, a bent sheet, a disc, a record or a snake."""

from math import radians

import bpy
import numpy as np

from ...precompute.mesh import shapes
from ...precompute.presets.presets import SNAKES
from ..blender import compat
from ..blender.shape_mesh import mesh_of_shape
from ..snakes.mesh import new_mesh
from ..snakes.poses import posed_spine
from ..snakes.shape import Detail, snake_shape
from ..snakes.skins import give_skin

# The disc leans towards the camera on its rim; the sheet leans back.
_DISC_TILT_DEG, _SHEET_TILT_DEG, _SHEET_MIDDLE_M = 14.0, 48.0, 0.044
_DISC_THICKNESS_M = 0.0012
# Enough faces that no facet shows at the scene's distance, and few enough to be made in a second.
_SNAKE_M, _SNAKE_FACES = 1.0, 80_000
# Colour and roughness of the plain parts.
_PAPER, _VINYL, _CLEAR = ((0.3, 0.02, 0.02), 0.6), ((0.006,) * 3, 0.3), ((0.25, 0.26, 0.28), 0.15)


def add_thing(scene: bpy.types.Scene, shape: str, name: str) -> bpy.types.Object:
    """Add the thing of a preset's `shape` to a scene, and return the object that takes the grating."""
    if shape in SNAKES:
        return _add(scene, name, _snake(shape.upper()))
    if shape in ("disc", "record"):
        return _add_disc(scene, name, is_record=shape == "record")
    if shape == "sheet":
        sheet = _add(scene, name, mesh_of_shape(name, shapes.bent_sheet()))
        sheet.rotation_euler.x = radians(_SHEET_TILT_DEG)
        sheet.location.z = _SHEET_MIDDLE_M
        return sheet
    return _add(scene, name, mesh_of_shape(name, shapes.ball()))


def add_floor(scene: bpy.types.Scene, colour: tuple[float, float, float], *, half_m: float = 6.0) -> None:
    """Add a flat, matt floor at z = 0."""
    corners = [(x * half_m, y * half_m, 0.0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    mesh = bpy.data.meshes.new("Floor")
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    mesh.materials.append(_plain("Floor", colour, 1.0, specular=0.0))
    _add(scene, "Floor", mesh)


def _snake(species: str) -> bpy.types.Mesh:
    mesh = new_mesh("Snake", snake_shape(posed_spine("RESTING", _SNAKE_M), species, Detail(_SNAKE_FACES)))
    give_skin(mesh, species)
    return mesh


def _add_disc(scene: bpy.types.Scene, name: str, *, is_record: bool) -> bpy.types.Object:
    """The data area, and around it two plain rings: clear plastic, or a record's label and rim."""

    def ring(part: str, inner_m: float, outer_m: float) -> bpy.types.Object:
        return _add(scene, part, mesh_of_shape(part, shapes.ring(inner_m, outer_m, _DISC_THICKNESS_M), smooth=False))

    written = ring(name, shapes.CLEAR_M, shapes.WRITTEN_M)
    looks = {"Hub": _PAPER if is_record else _CLEAR, "Rim": _VINYL if is_record else _CLEAR}
    for part, sizes in (("Hub", (shapes.HOLE_M, shapes.CLEAR_M)), ("Rim", (shapes.WRITTEN_M, shapes.RIM_M))):
        plain = ring(f"{name} {part}", *sizes)
        plain.data.materials.append(_plain(part, *looks[part]))
        plain.parent = written
    written.rotation_euler.x = radians(_DISC_TILT_DEG)
    written.location.z = shapes.RIM_M * np.sin(radians(_DISC_TILT_DEG))
    return written


def _add(scene: bpy.types.Scene, name: str, mesh: bpy.types.Mesh) -> bpy.types.Object:
    added = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(added)
    return added


def _plain(
    name: str, colour: tuple[float, float, float], roughness: float, *, specular: float = 0.5
) -> bpy.types.Material:
    """A material of one colour."""
    material = bpy.data.materials.new(name)
    compat.enable_nodes(material)
    surface = material.node_tree.nodes["Principled BSDF"]
    surface.inputs["Base Color"].default_value = (*colour, 1.0)
    surface.inputs["Roughness"].default_value = roughness
    surface.inputs["Specular IOR Level"].default_value = specular
    return material

# SPDX-License-Identifier: GPL-3.0-or-later
"""A thing that shows a preset (a ball, a bent sheet, a disc, a record or a snake), and the light, the camera and the
world around it."""

from dataclasses import dataclass
from math import cos, radians, sin

import bpy
import numpy as np
from mathutils import Vector

from ...precompute.mesh import shapes
from ...precompute.presets.presets import SNAKES
from ..blender import compat
from ..blender.objects import mesh_of_shape
from ..blender.working_space import show_pure_colours
from ..snakes.body import posed_spine
from ..snakes.mesh import new_mesh
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


_SAMPLES, _VIEWPORT_SAMPLES = 64, 32
_SIZE = 1280, 720


@dataclass(frozen=True)
class Towards:
    """A position relative to a target: azimuth counter-clockwise from +X and elevation from the floor, in degrees, and
    distance in metres."""

    azimuth_deg: float
    elevation_deg: float
    distance_m: float = 2.0

    def place(self, target: Vector) -> Vector:
        azimuth, elevation = radians(self.azimuth_deg), radians(self.elevation_deg)
        flat = cos(elevation)
        return target + self.distance_m * Vector((flat * cos(azimuth), flat * sin(azimuth), sin(elevation)))


@dataclass(frozen=True)
class Sun:
    """A sun lamp: its position, its irradiance in W/m2 and its angular size in degrees."""

    at: Towards
    strength: float
    angle_deg: float


@dataclass(frozen=True)
class Stage:
    """What surrounds a thing: the camera, the point that it looks at, its lens, the suns, the radiance of the dim world
    at the zenith, the floor's colour, and the exposure in stops."""

    camera: Towards
    target: tuple[float, float, float]
    lens_mm: float
    suns: tuple[Sun, ...]
    dusk: float
    floor: tuple[float, float, float] = (0.05, 0.052, 0.058)
    exposure: float = 0.0


# One sun behind the thing and one before it. The sheet leans back, so its second sun stands beside the camera.
_BEHIND, _BEFORE, _BESIDE = Towards(70.0, 52.0), Towards(-135.0, 42.0), Towards(-40.0, 50.0)
_TWO = (Sun(_BEFORE, 2.0, 1.0), Sun(_BEHIND, 2.0, 1.0))
_DISC = Stage(Towards(-90.0, 40.0, 0.56), (0.0, 0.0, 0.014), 100.0, _TWO, 0.3)
_SOIL = (0.02, 0.011, 0.007)
_SNAKE_CAMERA, _SNAKE_TARGET, _SNAKE_LENS_MM = Towards(-88.0, 32.0, 0.60), (-0.035, -0.02, 0.02), 68.0
STAGES = {
    "ball": Stage(Towards(-90.0, 24.0, 0.5), (0.0, 0.0, 0.05), 80.0, _TWO, 0.3),
    "sheet": Stage(
        Towards(-90.0, 30.0, 0.52), (0.0, 0.0, 0.042), 85.0, (Sun(_BEFORE, 1.0, 1.0), Sun(_BESIDE, 1.0, 1.0)), 0.3
    ),
    "disc": _DISC,
    "record": _DISC,
    # Xenopeltis diffracts across the body and Elaphe along it. So the strongest sun stands opposite the camera, across
    # the long straight runs or at an angle to them.
    "xenopeltis": Stage(
        _SNAKE_CAMERA, _SNAKE_TARGET, _SNAKE_LENS_MM,
        (Sun(Towards(92.0, 29.0), 17.0, 1.5), Sun(Towards(250.0, 58.0), 2.6, 1.5)), 0.5, _SOIL,
    ),
    "elaphe": Stage(
        _SNAKE_CAMERA, _SNAKE_TARGET, _SNAKE_LENS_MM,
        (Sun(Towards(128.0, 30.0), 12.0, 1.5), Sun(Towards(250.0, 58.0), 3.0, 1.5)), 0.5, _SOIL,
    ),
}  # fmt: skip


def set_stage(scene: bpy.types.Scene, stage: Stage) -> None:
    """Add the floor, the suns, the camera and the world to a scene, and set it up to render with Cycles."""
    add_floor(scene, stage.floor)
    target = Vector(stage.target)
    for number, sun in enumerate(stage.suns, 1):
        light = bpy.data.lights.new(f"Sun {number}", "SUN")
        light.energy, light.angle = sun.strength, radians(sun.angle_deg)
        _add_facing(scene, light, sun.at, target)
    camera = bpy.data.cameras.new("Camera")
    camera.lens, camera.clip_start = stage.lens_mm, 0.005
    scene.camera = _add_facing(scene, camera, stage.camera, target)
    scene.world = _dusk(stage.dusk)
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = _SIZE
    scene.cycles.samples, scene.cycles.preview_samples = _SAMPLES, _VIEWPORT_SAMPLES
    scene.cycles.use_denoising = scene.cycles.use_preview_denoising = True
    scene.cycles.max_bounces = 6
    show_pure_colours(scene)
    scene.view_settings.exposure = stage.exposure


def _add_facing(
    scene: bpy.types.Scene, data: bpy.types.Light | bpy.types.Camera, at: Towards, target: Vector
) -> bpy.types.Object:
    """Add a lamp or a camera that faces the target."""
    added = bpy.data.objects.new(data.name, data)
    scene.collection.objects.link(added)
    added.location = at.place(target)
    added.rotation_euler = (added.location - target).to_track_quat("Z", "Y").to_euler()
    return added


def _dusk(radiance: float, *, low: float = 0.25) -> bpy.types.World:
    """A world without bright spots. It falls from the zenith to the share `low` at the horizon, so that reflections are
    not black."""
    world = bpy.data.worlds.new("Dusk")
    compat.enable_nodes(world)
    nodes, links = world.node_tree.nodes, world.node_tree.links
    where, split = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeSeparateXYZ")
    ramp, background = nodes.new("ShaderNodeMapRange"), nodes["Background"]
    ramp.inputs["To Min"].default_value, ramp.inputs["To Max"].default_value = low * radiance, radiance
    links.new(where.outputs["Generated"], split.inputs[0])
    links.new(split.outputs["Z"], ramp.inputs["Value"])
    links.new(ramp.outputs["Result"], background.inputs["Strength"])
    background.inputs["Color"].default_value = (0.85, 0.93, 1.0, 1.0)
    return world

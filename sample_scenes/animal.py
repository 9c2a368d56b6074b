# SPDX-License-Identifier: GPL-3.0-or-later
"""A snake on soil: the whole animal, close-ups of its scales, in a room, on a turntable.

blender --background --python sample_scenes/animal.py -- --output hero.blend [--view hero] [--species XENOPELTIS]

The extension must be enabled, because the snake is made by Add > Mesh > Snake. `grating assign BAKE --object Snake
--over` adds diffraction to its skin. Blender without the extension opens and renders the file too."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from math import radians
from pathlib import Path

import bpy
from mathutils import Vector

if not __package__:  # `blender --python` runs this file as a script
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    __package__ = "sample_scenes"
from precompute.cli.option_types import count
from precompute.cli.parser import OneLineParser

from .snake import plain_material
from .stage import add_object, clean_scene, light_by_sky, surround_by
from .studio import Towards, add_camera, add_key, settings, wrap_in_dusk

SPECIES = ("XENOPELTIS", "ELAPHE")
SOIL_DARK, SOIL_LIGHT = (0.007, 0.003, 0.0017), (0.06, 0.023, 0.0105)
CRUMB_M = 0.0028
TURNTABLE_FRAMES = 48


@dataclass(frozen=True)
class View:
    """A view of the animal: camera, target, lens, light (suns, one sun, sky or a room's panorama), and exposure in
    stops."""

    camera: Towards
    target: tuple[float, float, float]
    lens_mm: float
    light: str = "suns"
    exposure: float = 0.0


_LOOPS = (-0.03, -0.045, 0.015)
VIEWS = {
    "hero": View(Towards(-90.0, 34.0, 0.60), (-0.034, -0.024, 0.012), 112.0),
    "sky": View(Towards(-88.0, 32.0, 0.60), (-0.045, -0.035, 0.014), 95.0, light="sky"),
    "macro": View(Towards(-88.0, 36.0, 0.35), (-0.03, -0.043, 0.022), 180.0),
    # As in the thesis: seen from straight above, under one small sun at an angle to the body.
    "close": View(Towards(-90.0, 89.0, 0.40), (-0.01, -0.030, 0.022), 260.0, light="one sun"),
    "room": View(Towards(-95.0, 43.0, 0.42), _LOOPS, 50.0, light="room", exposure=1.3),
    "turntable": View(Towards(-90.0, 38.0, 0.75), (0.0, -0.02, 0.01), 52.0),
}


@dataclass(frozen=True)
class Sun:
    """A small sun lamp: position in degrees, irradiance in W/m2, angular size in degrees."""

    azimuth_deg: float
    elevation_deg: float
    strength: float
    angle_deg: float


# Xenopeltis diffracts across the body, Elaphe along it. So the strongest sun stands opposite the camera, across the
# long straight runs or at an angle to them. The second, near the camera, shows the skin; the third lights the bends.
SUNS = {
    "XENOPELTIS": (
        Sun(92.0, 29.0, 26.0, 4.0),
        Sun(262.0, 50.0, 7.0, 3.0),
        Sun(150.0, 35.0, 9.0, 5.0),
        Sun(60.0, 22.0, 10.0, 5.0),
    ),
    "ELAPHE": (Sun(128.0, 30.0, 12.0, 1.5), Sun(250.0, 58.0, 3.0, 1.5), Sun(52.0, 35.0, 8.0, 2.0)),
}


LONE_SUN = Sun(-75.0, 58.0, 7.0, 0.53)


def add_soil(scene: bpy.types.Scene, half_size_m: float = 3.0) -> bpy.types.Object:
    """A floor of dark crumbs: a plane with colour and bumps from Voronoi cells of two sizes, distorted by noise."""
    material = plain_material("Soil", SOIL_DARK, roughness=0.95)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = nodes["Principled BSDF"]
    shader.inputs["Specular IOR Level"].default_value = 0.0
    noise, ramp, bump, where, moved, height = (
        nodes.new(f"ShaderNode{kind}") for kind in ("TexNoise", "ValToRGB", "Bump", "TexCoord", "VectorMath", "Math")
    )
    links.new(where.outputs["Object"], noise.inputs["Vector"])
    noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = 90.0, 6.0
    moved.operation, height.operation = "MULTIPLY_ADD", "MULTIPLY_ADD"
    links.new(noise.outputs["Color"], moved.inputs[0])
    moved.inputs[1].default_value = (CRUMB_M,) * 3
    links.new(where.outputs["Object"], moved.inputs[2])
    # Distance to the nearest cell centre: coarse crumbs plus a third of the fine ones.
    for cells, per_crumb in ((height.inputs[0], 1.0), (height.inputs[2], 3.0)):
        crumbs = nodes.new("ShaderNodeTexVoronoi")
        crumbs.inputs["Scale"].default_value = per_crumb / CRUMB_M
        links.new(moved.outputs["Vector"], crumbs.inputs["Vector"])
        links.new(crumbs.outputs["Distance"], cells)
    height.inputs[1].default_value = 3.0
    links.new(noise.outputs[0], ramp.inputs[0])
    for element, place, colour in zip(ramp.color_ramp.elements, (0.35, 0.7), (SOIL_DARK, SOIL_LIGHT), strict=True):
        element.position, element.color = place, (*colour, 1.0)
    links.new(ramp.outputs["Color"], shader.inputs["Base Color"])
    bump.invert = True
    bump.inputs["Distance"].default_value, bump.inputs["Strength"].default_value = CRUMB_M / 4, 1.0
    links.new(height.outputs[0], bump.inputs["Height"])
    links.new(bump.outputs["Normal"], shader.inputs["Normal"])
    mesh = bpy.data.meshes.new("Soil")
    h = half_size_m
    mesh.from_pydata([(-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(material)
    return add_object(scene, "Soil", mesh)


def turn_camera(camera: bpy.types.Object, target: tuple[float, float, float]) -> None:
    """Animate the camera once round the target, in TURNTABLE_FRAMES frames."""
    scene = bpy.context.scene
    pivot = add_object(scene, "Turntable", None)
    pivot.location = target
    camera.location -= Vector(target)
    camera.parent = pivot
    scene.frame_start, scene.frame_end = 1, TURNTABLE_FRAMES
    for frame, turn_deg in ((1, 0.0), (TURNTABLE_FRAMES + 1, 360.0)):
        pivot.rotation_euler.z = radians(turn_deg)
        pivot.keyframe_insert("rotation_euler", index=2, frame=frame)
    _keep_pace(pivot.animation_data)


def _keep_pace(animation) -> None:
    """Make all keyframes of an action linear."""
    action = animation.action
    if bpy.app.version < (5, 0):
        curves = action.fcurves
    else:
        curves = action.layers[0].strips[0].channelbag(animation.action_slot).fcurves
    for curve in curves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"


def build(scene: bpy.types.Scene, view: View, species: str, *, faces: int, panorama: Path | None) -> None:
    """Add snake, soil, light and camera."""
    bpy.ops.grating.add_snake(species=species, pose="RESTING", length_m=1.0, faces=faces)
    bpy.context.object.name = "Snake"
    add_soil(scene)
    if view.light == "room":
        picture = bpy.data.images.load(str(panorama.resolve()))
        picture.pack()
        surround_by(scene, "Room", picture)
    elif view.light == "sky":
        light_by_sky(scene, SUNS[species][0].azimuth_deg, SUNS[species][0].elevation_deg)
    else:
        for index, sun in enumerate(SUNS[species] if view.light == "suns" else (LONE_SUN,)):
            at = Towards(sun.azimuth_deg, sun.elevation_deg, 2.0)
            name = f"Sun {index + 1}"
            add_key(scene, name, at, target=view.target, strength=sun.strength, angle_deg=sun.angle_deg)
        wrap_in_dusk(scene, 0.20 if view.light == "suns" else 0.01)
    camera = add_camera(scene, view.camera, view.target, view.lens_mm)
    settings(scene)
    scene.view_settings.exposure = view.exposure
    if view == VIEWS["turntable"]:
        turn_camera(camera, view.target)


def main(argv: list[str]) -> None:
    parser = OneLineParser(prog="sample_scenes.animal", description="Write the scene of a snake on soil.")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.blend")
    parser.add_argument("--view", choices=list(VIEWS), default="hero")
    parser.add_argument("--species", choices=SPECIES, default=SPECIES[0])
    parser.add_argument("--faces", type=count(11_000, 1_000_000), default=200_000)
    parser.add_argument("--panorama", type=Path, metavar="FILE.exr", help="of the room, for the view of that name")
    arguments = parser.parse_args(argv)
    view = VIEWS[arguments.view]
    if view.light == "room" and not (arguments.panorama and arguments.panorama.is_file()):
        parser.error("--view room needs --panorama; `python -m sample_scenes.room --output room.exr` makes one")
    clean_scene()
    build(bpy.context.scene, view, arguments.species, faces=arguments.faces, panorama=arguments.panorama)
    bpy.ops.wm.save_as_mainfile(filepath=str(arguments.output.resolve()))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])

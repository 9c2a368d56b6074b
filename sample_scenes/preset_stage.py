# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage of a preset: a disc, a record, a ball or a bent sheet, lit by two small suns or by a studio of soft boxes.

blender PRESET.blend --background --python sample_scenes/preset_stage.py -- --output STAGE.blend --shape ball
    --light suns

The open file keeps its gratings and loses its objects. `grating assign BAKE --object Preset` adds the diffraction."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from math import radians
from pathlib import Path

import bpy

if not __package__:  # `blender --python` runs this file as a script
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    __package__ = "sample_scenes"
from precompute.cli.parser import OneLineParser
from precompute.mesh.shapes import BALL_RADIUS_M, RIM_M, Shape, ball, bent_sheet

from .discs import add_disc
from .stage import add_object, clean_scene, new_mesh, plain_material
from .studio import Towards, add_camera, add_floor, add_key, add_softbox, settings, wrap_in_dusk

NAME = "Preset"
# Azimuth and elevation of the suns: one behind the object and one before it. The sheet leans back, so its second sun
# stands beside the camera.
BEFORE, BEHIND, BESIDE = (-135.0, 42.0), (70.0, 52.0), (-40.0, 50.0)
SUNS = {"ball": (BEFORE, BEHIND), "disc": (BEFORE, BEHIND), "record": (BEFORE, BEHIND), "sheet": (BEFORE, BESIDE)}
SUN_STRENGTH, SUN_ANGLE_DEG = 2.0, 1.0
# Azimuth, elevation and power in watts of the soft boxes: key, fill, and one behind the object. They are lamps and few,
# because a software rasteriser compiles EEVEE's shader for minutes if a world has eight sources.
BOXES = ((-45.0, 48.0, 12.0), (-165.0, 35.0, 6.0), (95.0, 50.0, 10.0))
BOX_M, BOX_DISTANCE_M = 0.25, 1.0
LIGHTS = ("suns", "studio")
# The radiance of the dim world of each light. It keeps parts visible that no lamp's order reaches.
DUSK = {"suns": 0.3, "studio": 0.4}
LENS_MM = 150.0
SHEET_TILT_DEG = 48.0


@dataclass(frozen=True)
class View:
    """Where the camera stands, the height of the point that it looks at, and how much brighter the studio is, in stops.
    It is no exposure: with one, EEVEE dims what is sampled at random."""

    camera: Towards
    target_m: float
    studio_stops: float = 0.0


VIEWS = {
    "ball": View(Towards(-90.0, 24.0, 0.5), BALL_RADIUS_M),
    "disc": View(Towards(-90.0, 40.0, 0.56), 0.014, -1.0),
    "record": View(Towards(-90.0, 40.0, 0.56), 0.014),
    "sheet": View(Towards(-90.0, 30.0, 0.52), 0.042, -1.5),
}


def add_smooth(shape: Shape) -> bpy.types.Object:
    """The object of a dark, smooth-shaded shape."""
    mesh = new_mesh(NAME, shape)
    mesh.shade_smooth()
    mesh.materials.append(plain_material("Lacquer", (0.02,) * 3, roughness=0.4))
    return add_object(bpy.context.scene, NAME, mesh)


def add_sheet() -> None:
    """A bent sheet that leans back from the camera."""
    sheet = add_smooth(bent_sheet())
    sheet.rotation_euler.x = radians(SHEET_TILT_DEG)
    sheet.location.z = 0.044


def add_record() -> None:
    """A record: a disc with a paper label and a rim of vinyl."""
    add_lying_disc()
    for part, colour, roughness in (("Hub", (0.3, 0.02, 0.02), 0.6), ("Rim", (0.006,) * 3, 0.3)):
        bpy.data.objects[f"{NAME} {part}"].data.materials[0] = plain_material(part, colour, roughness=roughness)


def add_lying_disc() -> None:
    """A disc that lies tilted on the floor."""
    add_disc(NAME, (0.0, 0.0, 0.25 * RIM_M))


def build(scene: bpy.types.Scene, shape: str, light: str) -> None:
    """Add the object, its lights and the camera."""
    add_floor(scene, (0.05, 0.052, 0.058))
    if shape == "disc":
        add_lying_disc()
    elif shape == "record":
        add_record()
    elif shape == "sheet":
        add_sheet()
    else:
        add_smooth(ball())
    target = (0.0, 0.0, VIEWS[shape].target_m)
    brighter = 2.0 ** VIEWS[shape].studio_stops if light == "studio" else 1.0
    if light == "suns":
        for azimuth, elevation in SUNS[shape]:
            at = Towards(azimuth, elevation, BOX_DISTANCE_M)
            add_key(scene, "Sun", at, target=target, strength=SUN_STRENGTH, angle_deg=SUN_ANGLE_DEG)
    else:
        for azimuth, elevation, power in BOXES:
            at = Towards(azimuth, elevation, BOX_DISTANCE_M)
            add_softbox(scene, "Soft Box", at, target=target, size_m=BOX_M, power_w=power * brighter)
    wrap_in_dusk(scene, DUSK[light] * brighter)
    add_camera(scene, VIEWS[shape].camera, target, LENS_MM)
    settings(scene)


def main(argv: list[str]) -> None:
    parser = OneLineParser(prog="sample_scenes.preset_stage", description="Write the stage of the open file's preset.")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.blend")
    parser.add_argument("--shape", choices=list(VIEWS), required=True)
    parser.add_argument("--light", choices=LIGHTS, required=True)
    arguments = parser.parse_args(argv)
    clean_scene()
    build(bpy.context.scene, arguments.shape, arguments.light)
    bpy.ops.wm.save_as_mainfile(filepath=str(arguments.output.resolve()))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])

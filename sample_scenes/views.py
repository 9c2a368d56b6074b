# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders a snake (animal.py) at three zooms under three suns. The material follows the lamp by itself.

blender FILE --background --python sample_scenes/views.py -- --output DIR [--samples 16 --width 480]"""

from __future__ import annotations

import sys
from math import cos, radians, sin
from pathlib import Path

import bpy
from mathutils import Vector

if not __package__:  # `blender --python` runs this file as a script
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from sample_scenes.studio import wrap_in_dusk

# Name, focal length in mm, and camera target: the whole animal, two of its bends, single scales.
ZOOMS = (
    ("whole", 80.0, (-0.015, -0.015, 0.01)),
    ("bends", 200.0, (-0.075, -0.01, 0.02)),
    ("scales", 560.0, (-0.02, -0.037, 0.018)),
)
SUN_AZIMUTHS_DEG = (128.0, 90.0, 52.0)
SUN_ELEVATION_DEG, SUN_STRENGTH, SUN_ANGLE_DEG = 30.0, 14.0, 1.5


def leave_one_sun(scene: bpy.types.Scene) -> bpy.types.Object:
    """Remove all lamps but the first, make it a small sun, and dim the world."""
    sun, *others = [thing for thing in scene.objects if thing.type == "LIGHT"]
    for each in others:
        bpy.data.objects.remove(each)
    sun.data.energy, sun.data.angle = SUN_STRENGTH, radians(SUN_ANGLE_DEG)
    wrap_in_dusk(scene, 0.1)
    return sun


def turn_sun(sun: bpy.types.Object, azimuth_deg: float) -> None:
    """Turn the sun to an azimuth, at the stage's elevation."""
    azimuth, elevation = radians(azimuth_deg), radians(SUN_ELEVATION_DEG)
    to_sun = Vector((cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation)))
    sun.rotation_euler = to_sun.to_track_quat("Z", "Y").to_euler()


def aim(camera: bpy.types.Object, lens_mm: float, target: tuple[float, float, float]) -> None:
    """Point the camera at a place."""
    camera.data.lens = lens_mm
    camera.rotation_euler = (camera.location - Vector(target)).to_track_quat("Z", "Y").to_euler()


def main(argv: list[str]) -> None:
    parser = OneLineParser(prog="sample_scenes.views", description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--samples", type=count(1, 1 << 20), default=16)
    parser.add_argument("--width", type=count(4, 8192), default=480)
    arguments = parser.parse_args(argv)
    scene = bpy.context.scene
    scene.cycles.samples = arguments.samples
    scene.cycles.use_denoising = False
    scene.render.resolution_x, scene.render.resolution_y = arguments.width, arguments.width * 9 // 16
    scene.render.image_settings.file_format = "PNG"
    sun = leave_one_sun(scene)
    for zoom, lens, target in ZOOMS:
        aim(scene.camera, lens, target)
        for azimuth in SUN_AZIMUTHS_DEG:
            turn_sun(sun, azimuth)
            scene.render.filepath = str(arguments.output.resolve() / f"{zoom}_{azimuth:.0f}.png")
            bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])

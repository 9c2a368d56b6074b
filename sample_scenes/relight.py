# SPDX-License-Identifier: GPL-3.0-or-later
"""Replaces the lamps and world of a sample scene by another world, or by one large area lamp.

blender scene.blend --background --python sample_scenes/relight.py -- --world studio --output scene.blend"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import partial
from math import asin, atan2, degrees
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

if not __package__:  # `blender --python` runs this file as a script
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    __package__ = "sample_scenes"
from precompute.cli.parser import OneLineParser

from .room import overcast, room, soft_boxes
from .stage import light_by_sky, new_world, surround_by
from .studio import Towards, add_softbox

_ROWS = 512
_LAMP_M, _LAMP_W = 1.0, 10.0


@dataclass(frozen=True)
class Sun:
    """Direction of the scene's former brightest sun lamp."""

    azimuth_deg: float
    elevation_deg: float


def _painted(make, scene: bpy.types.Scene, _: Sun) -> None:
    paint(scene, make(_ROWS))


def _sky(scene: bpy.types.Scene, sun: Sun) -> None:
    light_by_sky(scene, sun.azimuth_deg, sun.elevation_deg)


def _lamp(scene: bpy.types.Scene, sun: Sun) -> None:
    new_world(scene, "World").inputs["Strength"].default_value = 0.0
    at = Towards(sun.azimuth_deg, sun.elevation_deg, 1.0)
    add_softbox(scene, "Area", at, target=(0.0, 0.0, 0.0), size_m=_LAMP_M, power_w=_LAMP_W)


# Each light's set-up function and exposure in stops.
WORLDS = {
    "studio": (partial(_painted, soft_boxes), 1.0),
    "sky": (_sky, -1.5),
    "overcast": (partial(_painted, overcast), 2.2),
    "room": (partial(_painted, room), 1.0),
    "area": (_lamp, 1.0),
}


def paint(scene: bpy.types.Scene, radiance: np.ndarray) -> None:
    """Make a world from radiance (rows, columns, 3) in the layout of precompute/world_sources/sources.py."""
    rows, columns, _ = radiance.shape
    image = bpy.data.images.new("World", columns, rows, float_buffer=True, is_data=True)
    pixels = np.ones((rows, columns, 4), np.float32)
    pixels[..., :3] = radiance
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    surround_by(scene, "World", image)


def relight(scene: bpy.types.Scene, world: str) -> None:
    """Replace the lights of a scene that has sun lamps by one of WORLDS."""
    bpy.context.view_layer.update()  # updates the matrices of new lamps
    lamps = [thing for thing in scene.objects if thing.type == "LIGHT"]
    brightest = max((lamp for lamp in lamps if lamp.data.type == "SUN"), key=lambda lamp: lamp.data.energy)
    to_sun = brightest.matrix_world.to_3x3() @ Vector((0, 0, 1))
    sun = Sun(degrees(atan2(to_sun.y, to_sun.x)), degrees(asin(to_sun.z)))
    bpy.data.batch_remove(lamps)
    light, stops = WORLDS[world]
    light(scene, sun)
    scene.view_settings.exposure = stops


def main(argv: list[str]) -> None:
    parser = OneLineParser(prog="sample_scenes.relight", description="Light the open sample scene anew.")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.blend")
    parser.add_argument("--world", choices=list(WORLDS), required=True)
    arguments = parser.parse_args(argv)
    relight(bpy.context.scene, arguments.world)
    bpy.ops.wm.save_as_mainfile(filepath=str(arguments.output.resolve()))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])

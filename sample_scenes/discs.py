# SPDX-License-Identifier: GPL-3.0-or-later
"""A CD under three small suns. The tracks of a disc run round its centre.

python -m sample_scenes.discs --output cd.blend
blender --background --python sample_scenes/discs.py -- --output cd.blend

U points outwards, across the tracks; V runs round the disc. `grating assign BAKE --object CD` adds the diffraction."""

from __future__ import annotations

import sys
from math import radians, sin
from pathlib import Path

import bpy

if not __package__:  # `blender --python` runs this file as a script
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    __package__ = "sample_scenes"
from precompute.cli.parser import OneLineParser
from precompute.mesh.shapes import CLEAR_M, HOLE_M, RIM_M, WRITTEN_M, ring

from .stage import add_object, clean_scene, new_mesh, plain_material
from .studio import Towards, add_camera, add_floor, add_key, add_softbox, settings, wrap_in_dusk

THICKNESS_M = 0.0012
TILT_DEG = 14.0
TARGET_M = (0.0, 0.0, 0.012)
# Azimuth, elevation and strength of small lamps. Each sends its diffraction orders into its own wedges.
KEYS = (("Key", 70.0, 52.0, 0.8), ("Side", 160.0, 40.0, 0.4), ("Back", 20.0, 30.0, 0.4))
# Stops. Discs are dark outside their wedges.
EXPOSURE = 1.5
CAMERA = Towards(-90.0, 38.0, 0.85)
LENS_MM = 150.0


def add_ring(name: str, size_m: tuple[float, float], height_m: float, material) -> bpy.types.Object:
    """Add a flat ring."""
    mesh = new_mesh(name, ring(*size_m, height_m))
    mesh.materials.append(material)
    return add_object(bpy.context.scene, name, mesh)


def add_disc(name: str, place: tuple[float, float, float]) -> bpy.types.Object:
    """Add a disc, tilted towards the camera: the data area, which gets the name, and plastic rings on both sides."""
    dark = plain_material(f"{name} Lacquer", (0.02, 0.02, 0.022), roughness=0.35)
    clear = plain_material(f"{name} Plastic", (0.25, 0.26, 0.28), roughness=0.15)
    written = add_ring(name, (CLEAR_M, WRITTEN_M), THICKNESS_M, dark)
    for part, size in (("Hub", (HOLE_M, CLEAR_M)), ("Rim", (WRITTEN_M, RIM_M))):
        add_ring(f"{name} {part}", size, THICKNESS_M, clear).parent = written
    written.rotation_euler.x = radians(TILT_DEG)
    written.location = place
    return written


def build(scene: bpy.types.Scene) -> None:
    """Add the disc, lamps and camera."""
    add_floor(scene, (0.035, 0.036, 0.04))
    add_disc("CD", (0.0, 0.0, 0.06 * sin(radians(TILT_DEG)) + 0.001))
    for name, azimuth, elevation, strength in KEYS:
        at = Towards(azimuth, elevation, 2.0)
        add_key(scene, name, at, target=TARGET_M, strength=strength, angle_deg=1.5)
    add_softbox(scene, "Fill", Towards(215.0, 30.0, 0.9), target=TARGET_M, size_m=0.2, power_w=10.0)
    wrap_in_dusk(scene, 0.1)
    add_camera(scene, CAMERA, TARGET_M, LENS_MM)
    settings(scene)
    scene.view_settings.exposure = EXPOSURE


def main(argv: list[str]) -> None:
    parser = OneLineParser(prog="sample_scenes.discs", description="Write the scene of a CD.")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.blend")
    arguments = parser.parse_args(argv)
    clean_scene()
    build(bpy.context.scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(arguments.output.resolve()))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])

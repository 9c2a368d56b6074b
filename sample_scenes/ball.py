# SPDX-License-Identifier: GPL-3.0-or-later
"""A ball or a crumpled foil in a studio, which shows a grating at every slope at once.

python -m sample_scenes.ball --output ball.blend [--thing foil]
blender --background --python sample_scenes/ball.py -- --output ball.blend

`grating assign BAKE --object Ball` (or Foil) adds the diffraction."""

from __future__ import annotations

import sys
from pathlib import Path

import bpy
import numpy as np

if not __package__:  # `blender --python` runs this file as a script
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    __package__ = "sample_scenes"
from precompute.cli.parser import OneLineParser
from precompute.mesh.shapes import BALL_RADIUS_M, Shape, ball, of_grid

from .snake import plain_material
from .stage import add_object, clean_scene, new_mesh
from .studio import Towards, add_camera, add_floor, add_key, settings, wrap_in_dusk

FOIL_M, FOIL_CELLS = 0.16, 480
# Facets of the foil: their number, and the standard deviation of their slopes.
FACETS, SLOPE = 260, 0.20
# Azimuth and elevation of the lamps. The foil's facets are flat, so it takes several lamps to light many of them.
KEYS_DEG = {
    "ball": ((-130.0, 50.0), (60.0, 35.0)),
    "foil": ((80.0, 50.0), (110.0, 30.0), (50.0, 35.0), (95.0, 72.0), (150.0, 55.0), (20.0, 60.0)),
}
CAMERA = Towards(-90.0, 24.0, 0.6)
LENS_MM = 90.0
STRENGTH = {"ball": 3.0, "foil": 1.0}


def smooth_object(name: str, shape: Shape, material: bpy.types.Material) -> bpy.types.Object:
    """An object with a smooth-shaded mesh."""
    mesh = new_mesh(name, shape)
    mesh.shade_smooth()
    mesh.materials.append(material)
    return add_object(bpy.context.scene, name, mesh)


def add_ball() -> bpy.types.Object:
    """A ball on the floor."""
    return smooth_object("Ball", ball(), plain_material("Lacquer", (0.015, 0.015, 0.017), roughness=0.4))


def crumpled(x: np.ndarray, y: np.ndarray, seed: int = 4) -> np.ndarray:
    """The height of a crumpled sheet at x and y from 0 to 1, in the same units: randomly tilted planes with narrow
    folds."""
    rng = np.random.default_rng(seed)
    slopes, heights = rng.normal(0, SLOPE, (FACETS, 2)), rng.normal(0, 0.03, FACETS)
    middles = rng.random((FACETS, 2))
    away = np.stack([x, y], axis=-1)[..., None, :] - middles
    # The plane with the nearest centre dominates.
    nearness = -((away**2).sum(axis=-1) / 0.0012)
    weight = np.exp(nearness - nearness.max(axis=-1, keepdims=True))
    planes = heights * 0.3 + (away * slopes).sum(axis=-1)
    return (weight * planes).sum(axis=-1) / weight.sum(axis=-1)


def add_foil() -> bpy.types.Object:
    """A crumpled sheet on the floor; U runs along +X."""
    u, v = np.meshgrid(np.linspace(0, 1, FOIL_CELLS), np.linspace(0, 1, FOIL_CELLS))
    height = crumpled(u, v)
    points = FOIL_M * np.stack([u - 0.5, v - 0.5, height - height.min()], axis=-1)
    shape = of_grid(points, np.stack([u, v], axis=-1))
    foil = smooth_object("Foil", shape, plain_material("Foil", (0.02,) * 3, roughness=0.4))
    foil.rotation_euler.z = 0.5
    return foil


def build(scene: bpy.types.Scene, thing: str) -> None:
    """Add the ball or foil, lamps and camera."""
    add_floor(scene, (0.05, 0.052, 0.058) if thing == "ball" else (0.012, 0.013, 0.016))
    (add_ball if thing == "ball" else add_foil)()
    target = (0.0, 0.0, BALL_RADIUS_M if thing == "ball" else 0.008)
    for index, (azimuth, elevation) in enumerate(KEYS_DEG[thing]):
        at = Towards(azimuth, elevation, 2.0)
        add_key(scene, f"Key {index + 1}", at, target=target, strength=STRENGTH[thing], angle_deg=2.0)
    wrap_in_dusk(scene, 0.5 if thing == "ball" else 0.12)
    add_camera(scene, CAMERA, target, LENS_MM)
    settings(scene)


def main(argv: list[str]) -> None:
    parser = OneLineParser(prog="sample_scenes.ball", description="Write the scene of a ball or a foil.")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.blend")
    parser.add_argument("--thing", choices=("ball", "foil"), default="ball")
    arguments = parser.parse_args(argv)
    clean_scene()
    build(bpy.context.scene, arguments.thing)
    bpy.ops.wm.save_as_mainfile(filepath=str(arguments.output.resolve()))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])

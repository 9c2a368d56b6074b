# SPDX-License-Identifier: GPL-3.0-or-later
"""Three product pictures: a CD on a glossy table, a hologram sticker on a bottle, and a jewel beetle close up.

blender --background --python sample_scenes/products.py -- --output disc.blend --product disc

The extension must be enabled, because its own operators put the gratings on. Blender without the extension opens and
renders the file too."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from math import radians, sin
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

if not __package__:  # `blender --python` runs this file as a script
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    __package__ = "sample_scenes"
from precompute.cli.parser import OneLineParser
from precompute.mesh.shapes import RIM_M

from .beetle import add_beetle
from .discs import add_disc, add_ring
from .sets import add_turned, thin_glass
from .stage import add_object, add_surface, clean_scene, plain_material
from .studio import Towards, add_camera, face, settings, wrap_in_dusk

# The sweep: a table that bends up into a wall. Its width, its depth before and behind the product, and its radius.
_WIDE_M, _BEFORE_M, _BEHIND_M, _BEND_M, _HIGH_M = 4.0, 0.3, 0.5, 0.5, 2.0


@dataclass(frozen=True)
class Box:
    """A soft box that faces the product: its place, width and height in metres, its power in watts, and its colour."""

    at: Towards
    size_m: tuple[float, float]
    power_w: float
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Shot:
    """The camera of a product, what it looks at, its lens and f-number, what is sharp, and the lamps."""

    camera: Towards
    target: tuple[float, float, float]
    lens_mm: float
    f_number: float
    sharp: tuple[float, float, float]
    boxes: tuple[Box, ...]
    table: tuple[float, float, float] = (0.012, 0.012, 0.014)
    roughness: float = 0.05
    glow_w: float = 150.0
    dusk: float = 0.01
    low: float = 0.25
    glow: tuple[float, float, float] = (0.75, 0.85, 1.0)


def add_sweep(scene: bpy.types.Scene, shot: Shot) -> None:
    """A table that bends up into a wall, and a spot that lights the wall in the middle."""
    turn = np.linspace(0, np.pi / 2, 24)
    y = [-_BEFORE_M, *(_BEHIND_M + _BEND_M * np.sin(turn)), _BEHIND_M + _BEND_M]
    z = [0.0, *(_BEND_M * (1 - np.cos(turn))), _HIGH_M]
    points = [(side * _WIDE_M / 2, a, b) for a, b in zip(y, z, strict=True) for side in (-1, 1)]
    faces = [(k, k + 1, k + 3, k + 2) for k in range(0, len(points) - 2, 2)]
    sweep = add_surface(
        scene, "Table", points, faces=faces, material=plain_material("Table", shot.table, shot.roughness)
    )
    sweep.data.shade_smooth()


def add_glow(scene: bpy.types.Scene, shot: Shot) -> None:
    light = bpy.data.lights.new("Glow", "SPOT")
    light.energy, light.color = shot.glow_w, shot.glow
    light.spot_size, light.spot_blend, light.shadow_soft_size = radians(100), 1.0, 0.05
    glow = add_object(scene, "Glow", light)
    glow.location = (0.0, 0.35, 0.02)
    glow.rotation_euler = Vector((0.0, -1.0, -0.25)).to_track_quat("Z", "Y").to_euler()


def add_box(scene: bpy.types.Scene, name: str, box: Box, target: tuple[float, float, float]) -> None:
    light = bpy.data.lights.new(name, "AREA")
    light.shape, light.size, light.size_y = "RECTANGLE", *box.size_m
    light.energy, light.color = box.power_w, box.colour
    lamp = add_object(scene, name, light)
    face(lamp, box.at, target)
    lamp.visible_camera = False


def put_on(things: list[bpy.types.Object], preset: str) -> None:
    """Put a preset on objects."""
    bpy.ops.object.select_all(action="DESELECT")
    for thing in things:
        thing.select_set(True)
    bpy.context.view_layer.objects.active = things[0]
    bpy.ops.grating.add_preset(preset=preset)
    bake_well()


def bake_well() -> None:
    """Bake the active grating at the quality Good, and without Footprint, which a close-up does not need."""
    grating = bpy.context.scene.natural_gratings.active()
    grating.delta_e, grating.coherence_um, grating.footprint = 1.0, 0.0, False
    bpy.ops.grating.bake()


def add_cds(scene: bpy.types.Scene) -> None:
    """A CD that leans back on its rim, and one that lies on the table."""
    leaning, lying = add_disc("CD", (-0.022, 0.0, 0.0)), add_disc("Lying CD", (0.088, 0.03, 0.001))
    lean = radians(66.0)
    leaning.rotation_euler = (lean, 0.0, radians(-14.0))
    leaning.location.z = RIM_M * sin(lean)
    lying.rotation_euler.x = 0.0
    clear, moulded = thin_glass(), plain_material("Moulded", (0.3, 0.31, 0.33), 0.1)
    for disc in (leaning, lying):
        bpy.data.objects[f"{disc.name} Hub"].data.materials[0] = clear
        for inner_m in (0.0075, 0.0165):
            add_ring(f"{disc.name} Ring", (inner_m, inner_m + 0.0007), 0.0013, moulded).parent = disc
    put_on([leaning, lying], "cd")


# Radius and height of a bottle and of its cap, from the top down, in metres.
_BOTTLE = (
    (0.0, 0.09), (0.012, 0.09), (0.024, 0.087), (0.0275, 0.083), (0.029, 0.078), (0.029, 0.002), (0.027, 0.0),
    (0.0, 0.0),
)  # fmt: skip
_CAP = ((0.0, 0.126), (0.0135, 0.126), (0.0145, 0.125), (0.0145, 0.0905), (0.0, 0.0905))


def add_bottles(scene: bpy.types.Scene) -> None:
    """Two bottles with hologram stickers; the one behind is out of focus."""
    glaze = plain_material("Glaze", (0.006, 0.008, 0.016), 0.14)
    gold = plain_material("Gold", (0.9, 0.62, 0.3), 0.18)
    gold.node_tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 1.0
    for place in ((0.018, 0.0, 0.0), (-0.055, 0.075, 0.0)):
        body = add_turned(scene, "Bottle", np.array(_BOTTLE), glaze)
        add_turned(scene, "Cap", np.array(_CAP), gold).parent = body
        body.location = place
        bpy.context.view_layer.update()
        bpy.context.view_layer.objects.active = body
        bpy.ops.grating.add_sticker(preset="silver_foil", size=0.8)
    bake_well()


def add_jewel_beetle(scene: bpy.types.Scene) -> None:
    """A jewel beetle."""
    put_on(add_beetle(scene), "jewel_beetle")


SHOTS = {
    "disc": Shot(
        Towards(-90.0, 9.0, 0.52), (0.022, 0.0, 0.029), 61.0, 4.0, (-0.022, 0.0, 0.05),
        (
            Box(Towards(-168.0, 44.0, 0.5), (0.03, 0.03), 1.2),
            Box(Towards(-35.0, 64.0, 0.5), (0.03, 0.03), 0.9),
            Box(Towards(-125.0, 79.0, 0.5), (0.10, 0.015), 0.8),
            Box(Towards(-101.0, 39.0, 0.45), (0.03, 0.03), 0.4),
            Box(Towards(80.0, 52.0, 0.8), (0.9, 0.5), 7.0),
        ),
        dusk=0.03,
        # A rough table shows blurred colours; a table like a mirror shows them as they are.
        roughness=0.0,
    ),
    "bottle": Shot(
        Towards(-90.0, 4.0, 0.50), (0.0, 0.0, 0.050), 80.0, 2.8, (0.018, -0.029, 0.05),
        (
            Box(Towards(-150.0, 35.0, 0.5), (0.06, 0.06), 1.8),
            Box(Towards(-118.0, 42.0, 0.5), (0.06, 0.06), 1.4),
            Box(Towards(-88.0, 50.0, 0.5), (0.06, 0.06), 1.8),
            Box(Towards(-60.0, 42.0, 0.5), (0.06, 0.06), 1.4),
            Box(Towards(-30.0, 35.0, 0.5), (0.06, 0.06), 1.8),
            Box(Towards(80.0, 52.0, 0.8), (0.9, 0.5), 7.0),
            Box(Towards(150.0, 20.0, 0.5), (0.05, 0.5), 2.0),
            Box(Towards(30.0, 20.0, 0.5), (0.05, 0.5), 2.0),
        ),
        dusk=0.10,
        low=1.0,
    ),
    "beetle": Shot(
        Towards(-128.0, 34.0, 0.128), (0.0006, -0.003, 0.0048), 100.0, 11.0, (-0.002, -0.004, 0.0085),
        (
            Box(Towards(-150.0, 55.0, 0.3), (0.012, 0.012), 0.25),
            Box(Towards(58.0, 40.0, 0.35), (0.30, 0.10), 0.32, (1.0, 0.88, 0.76)),
            Box(Towards(-125.0, 64.0, 0.3), (0.34, 0.08), 0.9),
            Box(Towards(-100.0, 18.0, 0.25), (0.2, 0.05), 0.15, (1.0, 0.85, 0.7)),
            Box(Towards(52.0, 75.0, 0.3), (0.2, 0.1), 0.9),
        ),
        dusk=0.04,
    ),
}  # fmt: skip
MAKERS = {"disc": add_cds, "bottle": add_bottles, "beetle": add_jewel_beetle}


def build(scene: bpy.types.Scene, product: str) -> None:
    """Add a product, its table, lamps and camera."""
    shot = SHOTS[product]
    camera = add_camera(scene, shot.camera, shot.target, shot.lens_mm)
    camera.data.dof.use_dof, camera.data.dof.aperture_fstop = True, shot.f_number
    view = camera.rotation_euler.to_matrix() @ Vector((0, 0, -1))
    camera.data.dof.focus_distance = (Vector(shot.sharp) - camera.location) @ view
    add_sweep(scene, shot)
    add_glow(scene, shot)
    for number, box in enumerate(shot.boxes, 1):
        add_box(scene, f"Soft Box {number}", box, shot.sharp)
    wrap_in_dusk(scene, shot.dusk, low=shot.low)
    settings(scene)
    scene.view_settings.exposure = 0.3
    bpy.context.view_layer.update()
    MAKERS[product](scene)


def main(argv: list[str]) -> None:
    parser = OneLineParser(prog="sample_scenes.products", description="Write the scene of a product picture.")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.blend")
    parser.add_argument("--product", choices=list(SHOTS), required=True)
    arguments = parser.parse_args(argv)
    clean_scene()
    build(bpy.context.scene, arguments.product)
    bpy.ops.wm.save_as_mainfile(filepath=str(arguments.output.resolve()))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])

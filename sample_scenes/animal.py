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
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser

from .sets import SETS, add_set, stops
from .stage import add_object, clean_scene, surround_by
from .studio import Towards, add_camera, add_key, settings, wrap_in_dusk

SPECIES = ("XENOPELTIS", "ELAPHE")
TURNTABLE_FRAMES = 48


@dataclass(frozen=True)
class View:
    """A view of the animal: camera, target, lens, light (suns, one sun or a room's panorama), exposure in stops,
    the set on which the animal lies, and the lens's f-stop (0: everything is sharp)."""

    camera: Towards
    target: tuple[float, float, float]
    lens_mm: float
    light: str = "suns"
    exposure: float = 0.0
    ground: str = "soil"
    fstop: float = 0.0


_LOOPS = (-0.03, -0.045, 0.015)
VIEWS = {
    "hero": View(Towards(-90.0, 34.0, 0.60), (-0.034, -0.024, 0.012), 112.0, exposure=1.3, fstop=16.0),
    "macro": View(Towards(-88.0, 36.0, 0.35), (-0.03, -0.043, 0.022), 240.0, exposure=1.1, fstop=32.0),
    # As in the thesis: seen from straight above, under one small sun at an angle to the body.
    "close": View(Towards(-90.0, 89.0, 0.40), (-0.01, -0.034, 0.022), 280.0, light="one sun", exposure=0.3),
    "room": View(Towards(-95.0, 43.0, 0.42), _LOOPS, 50.0, light="room", exposure=1.3),
    "turntable": View(Towards(-90.0, 34.0, 0.70), (0.0, -0.012, 0.008), 74.0, exposure=1.4, ground="turntable"),
}


@dataclass(frozen=True)
class Sun:
    """A sun lamp: position in degrees, irradiance in W/m2, angular size in degrees, linear colour."""

    azimuth_deg: float
    elevation_deg: float
    strength: float
    angle_deg: float
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)


# A flash and a window. Xenopeltis diffracts across the body, so its flash stands square to the long runs: a streak of
# colour follows the flash's white image along them. Elaphe diffracts along the body, so its flash stands at an angle to
# the long runs. The window shows the skin. A whiter light leaves more violet on Xenopeltis, and a warmer one makes skin
# and soil amber.
_WARM = (1.0, 0.91, 0.715)
SUNS = {
    "XENOPELTIS": (Sun(93.0, 54.0, 3.6, 4.2, _WARM), Sun(228.0, 66.0, 6.2, 15.0, _WARM)),
    "ELAPHE": (Sun(140.0, 44.0, 4.2, 2.5), Sun(215.0, 60.0, 2.0, 60.0)),
}
LONE_SUN = {"XENOPELTIS": Sun(-75.0, 58.0, 7.0, 0.53), "ELAPHE": Sun(-35.0, 45.0, 6.0, 1.5)}


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


def build(
    scene: bpy.types.Scene, view: View, species: str, *, faces: int, panorama: Path | None, ground: str | None = None
) -> None:
    """Add snake, light, camera and the set `ground`, by default the view's own."""
    ground, dusk = ground or view.ground, 0.0
    bpy.ops.grating.add_snake(species=species, pose="RESTING", length_m=1.0, faces=faces)
    bpy.context.object.name = "Snake"
    add_set(scene, ground, bpy.context.object)
    if view.light == "room":
        picture = bpy.data.images.load(str(panorama.resolve()))
        picture.pack()
        surround_by(scene, "Room", picture)
    else:
        for index, sun in enumerate(SUNS[species] if view.light == "suns" else (LONE_SUN[species],)):
            at = Towards(sun.azimuth_deg, sun.elevation_deg, 2.0)
            name = f"Sun {index + 1}"
            add_key(
                scene, name, at, target=view.target, strength=sun.strength, angle_deg=sun.angle_deg, colour=sun.colour
            )
        dusk = wrap_in_dusk(scene, 0.15 if view.light == "suns" else 0.05)
    camera = add_camera(scene, view.camera, view.target, view.lens_mm)
    camera.data.dof.use_dof, camera.data.dof.focus_distance = view.fstop > 0, view.camera.distance_m
    camera.data.dof.aperture_fstop = view.fstop or 16.0
    settings(scene)
    scene.view_settings.exposure = view.exposure + stops(scene, ground, dusk)
    if view == VIEWS["turntable"]:
        turn_camera(camera, view.target)


def main(argv: list[str]) -> None:
    parser = OneLineParser(prog="sample_scenes.animal", description="Write the scene of a snake on soil.")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.blend")
    parser.add_argument("--view", choices=list(VIEWS), default="hero")
    parser.add_argument("--species", choices=SPECIES, default=SPECIES[0])
    parser.add_argument("--faces", type=count(11_000, 1_000_000), default=200_000)
    parser.add_argument("--panorama", type=Path, metavar="FILE.exr", help="of the room, for the view of that name")
    parser.add_argument("--set", choices=SETS, help="what the snake lies on; default: the view's own")
    arguments = parser.parse_args(argv)
    view = VIEWS[arguments.view]
    if view.light == "room" and not (arguments.panorama and arguments.panorama.is_file()):
        parser.error("--view room needs --panorama; `python -m sample_scenes.room --output room.exr` makes one")
    clean_scene()
    given = {"faces": arguments.faces, "panorama": arguments.panorama, "ground": arguments.set}
    build(bpy.context.scene, view, arguments.species, **given)
    bpy.ops.wm.save_as_mainfile(filepath=str(arguments.output.resolve()))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])

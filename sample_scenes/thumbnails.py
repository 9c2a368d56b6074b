# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of the presets in the extension's panel: each preset as Show Me shows it, through a narrower lens.

blender --background --python sample_scenes/thumbnails.py -- [--preset cd] [--output addon/ui/thumbnails]

The extension must be enabled."""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

if not __package__:  # `blender --python` runs this file as a script
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    __package__ = "sample_scenes"
from precompute.cli.parser import OneLineParser
from precompute.presets.presets import SNAKES, preset_names, read_preset

FOLDER = Path(__file__).resolve().parents[1] / "addon" / "ui" / "thumbnails"
SIDE, SAMPLES, QUALITY = 192, 128, 88
# A square picture has room for a larger thing, but not for a longer snake.
NARROWER, SNAKE_NARROWER = 1.4, 0.98


def render(preset: str, path: Path) -> None:
    """Show a preset and render its picture."""
    before = set(bpy.data.scenes)
    bpy.ops.grating.show_me(preset=preset)
    (scene,) = set(bpy.data.scenes) - before
    scene.camera.data.lens *= SNAKE_NARROWER if read_preset(preset).shape in SNAKES else NARROWER
    scene.cycles.samples, scene.cycles.use_denoising = SAMPLES, False
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    settings = scene.render.image_settings
    if bpy.app.version >= (5, 0):
        settings.media_type = "IMAGE"
    settings.file_format, settings.quality = "JPEG", QUALITY
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True, scene=scene.name)
    bpy.data.scenes.remove(scene)


def main(argv: list[str]) -> None:
    parser = OneLineParser(prog="sample_scenes.thumbnails", description="Render the presets' pictures.")
    parser.add_argument("--output", type=Path, default=FOLDER, metavar="DIR")
    parser.add_argument("--preset", action="append", choices=preset_names(), help="which; default all")
    arguments = parser.parse_args(argv)
    arguments.output.mkdir(parents=True, exist_ok=True)
    for preset in arguments.preset or preset_names():
        render(preset, arguments.output.resolve() / f"{preset}.jpg")


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])

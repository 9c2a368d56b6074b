# SPDX-License-Identifier: GPL-3.0-or-later
"""A sheet of all presets: each under two suns and in a studio, in Cycles and in EEVEE.

python -m sample_scenes.preset_sheet --output DIR [--preset cd] [--bpy 5.2] [--samples 32 --width 200] [--keep]

Each step is a command that a user can type: Blender's `--command grating` bakes the preset, assigns it with its look
and its direction, and renders it."""

import sys
import textwrap
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from devtools import ROOT
from devtools.environments import ALL
from devtools.steps import clean_environment
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.presets.presets import SNAKES, Preset, preset_names, read_preset
from sample_scenes.demo import Stopwatch, start_blender

# A row of the sheet for each light in each engine: the row's title, the light, the engine.
ROWS = tuple(
    (f"{title}, {engine_title}", light, engine)
    for title, light in (("Two suns", "suns"), ("Studio", "studio"))
    for engine_title, engine in (("Cycles", "cycles"), ("EEVEE", "eevee"))
)
# Presets side by side; the others follow in a band below. Sizes of texts and gaps are shares of a tile's width.
COLUMNS = 7
MARGIN, TITLE, TEXT, GAP = 0.36, 0.3, 0.095, 0.02
PAPER, INK = (24, 24, 26), (225, 225, 225)


def main(argv: list[str] | None = None) -> int:
    """Bake, assign and render presets, and join their sheet. Returns the exit status."""
    parser = OneLineParser(prog="sample_scenes.preset_sheet", description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--preset", action="append", choices=preset_names(), help="which; default all")
    parser.add_argument("--bpy", choices=[e.blender_version for e in ALL], help="the bpy wheel to render with")
    parser.add_argument("--samples", type=count(1, 1 << 20), default=32, help="of a pixel in both engines; default 32")
    parser.add_argument("--width", type=count(16, 2048), default=200, help="of a tile in pixels; default 200")
    parser.add_argument("--keep", action="store_true", help="render only the tiles that are not in DIR yet")
    arguments = parser.parse_args(argv)
    arguments.blender = None
    output = arguments.output.resolve()
    presets = [read_preset(name) for name in arguments.preset or preset_names()]
    watch = Stopwatch()
    for preset in presets:
        folder = output / preset.name
        folder.mkdir(parents=True, exist_ok=True)
        render(preset, folder, arguments=arguments, watch=watch)
    picture = output / "presets.jpg"
    join(presets, output).save(picture, quality=88, optimize=True)
    print(f"{picture}: {picture.stat().st_size} bytes, {sum(watch.seconds.values()):.0f} s")
    return 0


def shape_of(preset: Preset) -> str:
    """The shape of preset_stage.py that shows a preset: its own, or a ball in place of a snake."""
    return "ball" if preset.shape in SNAKES else preset.shape


def tile(folder: Path, light: str, engine: str) -> Path:
    """The picture of a preset, in the preset's folder."""
    return folder / f"{light}_{engine}.png"


def render(preset: Preset, folder: Path, *, arguments, watch: Stopwatch) -> None:
    """Render the tiles of a preset."""
    wanted = [row[1:] for row in ROWS if not (arguments.keep and tile(folder, *row[1:]).is_file())]
    if not wanted:
        return
    script = ["--background", "--python-exit-code", "1", "--python", ROOT / "sample_scenes" / "preset_stage.py", "--"]
    verb = ["--background", "--command", "grating"]

    def blender(step: str, command: list) -> None:
        launch = start_blender(arguments, [str(part) for part in command])
        watch.run(f"{preset.name}: {step}", launch.command, env=clean_environment(**launch.variables))

    baked = folder / "preset.blend"
    blender("bake", [*verb, "bake", "--preset", preset.name, "-o", folder / "bake", "--save", baked])
    size = ["--samples", arguments.samples, "--width", arguments.width, "--height", arguments.width]
    for light in dict.fromkeys(light for light, _ in wanted):
        scene = folder / f"{light}.blend"
        blender(f"{light}, stage", [baked, *script, "--output", scene, "--shape", shape_of(preset), "--light", light])
        blender(f"{light}, assign", [scene, *verb, "assign", folder / "bake", "--object", "Preset"])
        for engine in (engine for each, engine in wanted if each == light):
            picture = ["render", "-o", tile(folder, light, engine), "--engine", engine, *size]
            blender(f"{light}, {engine}", [scene, *verb, *picture])


def corner(preset: int, row: int, width: int) -> tuple[int, int]:
    """The left upper corner of a tile on the sheet, by the numbers of its preset and its row, in pixels."""
    band, column = divmod(preset, COLUMNS)
    step, title = round(width * (1 + GAP)), round(width * TITLE)
    return round(width * MARGIN) + column * step, band * (len(ROWS) * step + title) + row * step


def join(presets: list[Preset], folder: Path) -> Image.Image:
    """Join the tiles in a folder: titles of presets stand below the columns, lights and engines at the left."""
    tiles = [[Image.open(tile(folder / each.name, *row[1:])).convert("RGB") for row in ROWS] for each in presets]
    width = tiles[0][0].width
    bands, columns = -(-len(presets) // COLUMNS), min(len(presets), COLUMNS)
    sheet = Image.new("RGB", (corner(columns - 1, 0, width)[0] + width, corner(COLUMNS * bands, 0, width)[1]), PAPER)
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(size=max(6, width * TEXT))

    def write(place: tuple[float, float], text: str, room: float, anchor: str) -> None:
        lines = textwrap.fill(text, max(1, round(room / (width * TEXT * 0.52))))
        draw.multiline_text(place, lines, INK, font, anchor=anchor, align="center")

    for index, (preset, column) in enumerate(zip(presets, tiles, strict=True)):
        for row, part in enumerate(column):
            sheet.paste(part.resize((width, width)), corner(index, row, width))
        x, y = corner(index, len(ROWS), width)
        write((x + width / 2, y + 0.02 * width), preset.title, width, "ma")
    for band in range(bands):
        for row, (title, *_) in enumerate(ROWS):
            x, y = corner(band * COLUMNS, row, width)
            write((x / 2, y + width / 2), title, x, "mm")
    return sheet


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: GPL-3.0-or-later
"""Joins pictures into a sheet with a label in each of them, or frames into a film.

python -m sample_scenes.sheet --output SHEET.jpg --columns 2 "Cycles=a.png" "EEVEE=b.png"
python -m sample_scenes.sheet --output FILM.webp FRAME.png ...
"""

import sys
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from precompute.base.failure import GratingError
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser, exit_status

_INK, _SHADE = (245, 245, 245), (0, 0, 0)
# The height of a label over the tile's width, and the gap between tiles.
_TEXT, _GAP = 0.032, 0.008
_SECONDS_PER_FRAME = 1 / 12


def main(argv: list[str] | None = None) -> int:
    """Write the sheet or the film. Returns the exit status."""
    parser = OneLineParser(prog="sample_scenes.sheet", description=__doc__.splitlines()[0])
    parser.add_argument("pictures", nargs="+", metavar="LABEL=PICTURE", help="of a film the frames, without labels")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE", help="a .webp is a film")
    parser.add_argument("--columns", type=count(1, 100), default=1, help="pictures in a row of the sheet; default 1")
    parser.add_argument("--width", type=count(16, 8192), help="of a picture; default: the first one's")
    parser.add_argument("--quality", type=count(1, 100), default=86, help="of the compression; default 86")
    return exit_status(lambda: _write(parser.parse_args(argv)))


def _write(arguments) -> None:
    if arguments.output.suffix == ".webp":
        first, *others = (_opened(name, arguments.width) for name in arguments.pictures)
        first.save(
            arguments.output, save_all=True, append_images=others, loop=0, quality=arguments.quality, method=6,
            duration=round(1000 * _SECONDS_PER_FRAME),
        )  # fmt: skip
    else:
        labelled = [each.rpartition("=")[::2] for each in arguments.pictures]
        tiles = [(label, _opened(name, arguments.width)) for label, name in labelled]
        join(tiles, arguments.columns).save(arguments.output, quality=arguments.quality, optimize=True)
    print(f"{arguments.output}: {arguments.output.stat().st_size:,} bytes")


def _opened(name: str, width: int | None) -> Image.Image:
    try:
        picture = Image.open(name).convert("RGB")
    except OSError as error:
        raise GratingError(name, "no picture", "name a PNG or JPEG file") from error
    if width in (None, picture.width):
        return picture
    return picture.resize((width, round(picture.height * width / picture.width)), Image.Resampling.LANCZOS)


def join(tiles: list[tuple[str, Image.Image]], columns: int) -> Image.Image:
    """Join labelled tiles in rows. All get the size of the first."""
    width, height = tiles[0][1].size
    gap = round(width * _GAP)
    rows = -(-len(tiles) // columns)
    sheet = Image.new("RGB", (columns * (width + gap) - gap, rows * (height + gap) - gap), _INK)
    font = ImageFont.load_default(size=max(9, width * _TEXT))
    for index, (label, tile) in enumerate(tiles):
        tile = tile if tile.size == (width, height) else tile.resize((width, height), Image.Resampling.LANCZOS)
        draw = ImageDraw.Draw(tile)
        draw.text((width * _TEXT / 2, width * _TEXT / 3), label, _INK, font, stroke_width=2, stroke_fill=_SHADE)
        row, column = divmod(index, columns)
        sheet.paste(tile, (column * (width + gap), row * (height + gap)))
    return sheet


if __name__ == "__main__":
    sys.exit(main())

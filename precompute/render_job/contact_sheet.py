# SPDX-License-Identifier: GPL-3.0-or-later
"""A contact sheet: all pictures of a job in rows, each with its name, small enough to look at."""

import math
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from ..base.files import write_whole
from ..base.packages import bundled

# Width of a tile, gap between tiles, and height of a label, in pixels; the widest sheet.
_TILE, _GAP, _LABEL, _WIDEST = 192, 6, 14, 8192
_PAPER, _INK, _MISSING = (24, 24, 24), (222, 222, 222), (70, 30, 30)
# At most so many pictures are shown, evenly chosen: a sheet of ten thousand cannot be looked at.
SHOWN_MAX = 600


def write_sheet(path: Path, pictures: Sequence[Path]) -> int:
    """Write a PNG with the PNG pictures in their order, in nearly a square. Missing pictures have a dark red tile.
    Returns how many are missing. Raises GratingError if the sheet cannot be written."""
    image, drawing, fonts = (bundled(f"PIL.{module}") for module in ("Image", "ImageDraw", "ImageFont"))
    step = max(1, math.ceil(len(pictures) / SHOWN_MAX))
    shown = pictures[::step]
    tiles = [_tile(picture, image) for picture in shown]
    height = max((tile.height for tile in tiles if tile is not None), default=_TILE)
    columns = max(1, min(math.ceil(math.sqrt(len(tiles) * (height + _LABEL) / _TILE)), _WIDEST // (_TILE + _GAP)))
    rows = math.ceil(len(tiles) / columns)
    size = columns * (_TILE + _GAP) + _GAP, rows * (height + _LABEL + _GAP) + _GAP
    sheet = image.new("RGB", size, _PAPER)
    draw, font = drawing.Draw(sheet), fonts.load_default(size=10)
    for index, (picture, tile) in enumerate(zip(shown, tiles, strict=True)):
        row, column = divmod(index, columns)
        left, top = _GAP + column * (_TILE + _GAP), _GAP + row * (height + _LABEL + _GAP)
        if tile is None:
            draw.rectangle((left, top, left + _TILE - 1, top + height - 1), _MISSING)
        else:
            sheet.paste(tile, (left, top))
        draw.text((left, top + height + 1), _fitting(picture.stem, font), _INK, font)
    write_whole(path, lambda partial: sheet.save(partial))
    return sum(tile is None for tile in tiles)


def _fitting(text: str, font: Any) -> str:
    """A text cut at its beginning, where names of pictures are alike, to the width of a tile."""
    if font.getlength(text) <= _TILE:
        return text
    while text and font.getlength(f"...{text}") > _TILE:
        text = text[1:]
    return f"...{text}"


def _tile(path: Path, image: ModuleType) -> Any | None:
    """A picture at the width of a tile, or None if it cannot be read."""
    try:
        with image.open(path) as picture:
            height = max(1, min(4 * _TILE, round(picture.height * _TILE / picture.width)))
            return picture.convert("RGB").resize((_TILE, height))
    except (OSError, ValueError, SyntaxError):
        return None

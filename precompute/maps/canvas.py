# SPDX-License-Identifier: GPL-3.0-or-later
"""The square on which pictures for artists are drawn, with their lines and texts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ..base.packages import bundled

if TYPE_CHECKING:
    from PIL import Image

# The side of a picture in pixels. A .blend that holds it grows by less than 1 MiB.
SIDE = 512
GROUND, INK, FAINT = (28, 28, 28), (225, 225, 225), (130, 130, 130)
_LETTERS = 13

Colour = tuple[int, int, int]


class Canvas:
    """A picture of SIDE x SIDE pixels; x to the right and y downward, in pixels."""

    def __init__(self) -> None:
        self._image: Image.Image = bundled("PIL.Image").new("RGB", (SIDE, SIDE), GROUND)
        self._draw = bundled("PIL.ImageDraw").Draw(self._image)
        self._font = bundled("PIL.ImageFont").load_default(_LETTERS)

    def paste(self, pixels: np.ndarray, x: int, y: int) -> None:
        """Put pixels (rows, cols, 3) of 8 bits, row 0 on top, with their upper left corner at (x, y)."""
        self._image.paste(bundled("PIL.Image").fromarray(pixels), (x, y))

    def text(self, words: str, x: float, y: float, *, anchor: str = "la", colour: Colour = INK) -> None:
        """Write words on a dark ground. `anchor` is Pillow's: "la" puts (x, y) at their upper left, "mm" in the
        middle."""
        self._draw.text((x, y), words, fill=colour, font=self._font, anchor=anchor, stroke_width=2, stroke_fill=GROUND)

    def line(self, x0: float, y0: float, *, to: tuple[float, float], colour: Colour = INK, width: int = 1) -> None:
        """Draw a line."""
        self._draw.line((x0, y0, *to), fill=colour, width=width)

    def circle(self, x: float, y: float, radius: float, *, colour: Colour, filled: bool = False) -> None:
        """Draw a circle, or a disc."""
        box = (x - radius, y - radius, x + radius, y + radius)
        self._draw.ellipse(box, outline=colour, fill=colour if filled else None)

    def pixels(self) -> np.ndarray:
        """The picture (SIDE, SIDE, 3) of 8 bits, row 0 on top."""
        return np.array(self._image)


def round_below(value: float) -> float:
    """The largest 1, 2 or 5 times a power of ten up to a positive value."""
    power = 10.0 ** math.floor(math.log10(value) + 1e-9)
    return max(step * power for step in (1, 2, 5) if step * power <= value * (1 + 1e-9))

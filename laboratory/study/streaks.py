# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures over how many plates of a snake a colour runs on: the correlation length of hue along the body.

python -m laboratory.study.streaks hero PICTURE...
python -m laboratory.study.streaks photograph ../shared/data/thesis_figures/photo__xenopeltis_unicolor.png

A sample scene *hero* at 16:9 and the photograph of Xenopeltis unicolor have known lines along the body, chosen by eye.
Per line it prints the distance, in plates, at which the correlation of hue has fallen to 1/e, and the correlation
between plates and the next, and the next but one."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from precompute.cli.parser import OneLineParser

# Pixels per plate at which pictures are compared, and the lines beside each line, up to half a plate away.
_PER_PLATE = 12
_BESIDE = np.linspace(-0.5, 0.5, 13)


class Line(NamedTuple):
    """A line along a row of plates: its corners (x, y) and the distance from plate to plate, in pixels of a picture
    that is `width` pixels wide."""

    width: int
    plate: float
    corners: tuple[tuple[float, float], ...]


LINES = {
    # The marked streak of the long run and the run before it; a bend at the left.
    "photograph": {
        "run, far": Line(526, 22.5, ((300, 148), (335, 143), (370, 139), (405, 136), (440, 131), (490, 126))),
        "run, near": Line(526, 21.5, ((182, 212), (217, 226), (255, 234), (292, 235), (330, 229), (400, 216))),
        "bend": Line(526, 16.0, ((137, 40), (132, 65), (140, 95), (142, 120), (150, 145), (163, 160))),
    },
    # The ridge and the flank of the long run in front; the bend behind the head.
    "hero": {
        "run, ridge": Line(1280, 63, ((440, 300), (550, 318), (700, 335), (850, 344), (1000, 345), (1230, 315))),
        "run, flank": Line(1280, 63, ((480, 365), (590, 380), (730, 392), (870, 398), (1030, 398), (1250, 365))),
        "bend": Line(1280, 45, ((40, 400), (76, 290), (140, 180), (230, 90), (330, 50), (430, 40))),
    },
}  # fmt: skip


def hues_along(picture: Image.Image, line: Line) -> np.ndarray:
    """Hue and saturation as complex numbers (lines, n), at `_PER_PLATE` places per plate, less the skin's own."""
    scale = _PER_PLATE / line.plate * line.width / picture.width
    size = round(picture.width * scale), round(picture.height * scale)
    red, green, blue = np.moveaxis(np.asarray(picture.convert("RGB").resize(size, Image.Resampling.BOX), float), -1, 0)
    hue = red - (green + blue) / 2 + 1j * np.sqrt(0.75) * (green - blue)
    corners = np.array(line.corners) * _PER_PLATE / line.plate
    lengths = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    places = np.stack([np.interp(np.arange(lengths[-1]), lengths, corner) for corner in corners.T])
    tangent = np.gradient(places, axis=1)
    across = np.stack([-tangent[1], tangent[0]]) / np.linalg.norm(tangent, axis=0)
    x, y = np.rint(places[:, None] + across[:, None] * (_BESIDE * _PER_PLATE)[:, None]).astype(int)
    along = hue[np.clip(y, 0, size[1] - 1), np.clip(x, 0, size[0] - 1)]
    return along - np.median(along.real) - 1j * np.median(along.imag)


def correlations(hues: np.ndarray) -> np.ndarray:
    """The correlation along lines (lines, n) of places that are 0, 1, 2... n / 2 pixels apart."""
    n = hues.shape[1]
    pairs = [(hues[:, : n - lag], hues[:, lag:]) for lag in range(n // 2)]
    return np.array([(a * b.conj()).real.sum() / np.sqrt((abs(a) ** 2).sum() * (abs(b) ** 2).sum()) for a, b in pairs])


def correlation_length(alike: np.ndarray) -> float:
    """The distance in plates at which correlations first fall to 1/e, or the longest distance if they do not."""
    below = np.flatnonzero(alike < np.exp(-1))
    if not below.size:
        return len(alike) / _PER_PLATE
    two = slice(below[0] - 1, below[0] + 1)
    return float(np.interp(-np.exp(-1), -alike[two], np.arange(len(alike))[two])) / _PER_PLATE


def main(argv: list[str] | None = None) -> int:
    """Print the correlation lengths of pictures. Returns the exit status."""
    parser = OneLineParser(prog="laboratory.study.streaks", description=__doc__.splitlines()[0])
    parser.add_argument("of", choices=list(LINES), help="what the pictures show")
    parser.add_argument("pictures", type=Path, nargs="+", metavar="PICTURE")
    arguments = parser.parse_args(argv)
    for path in arguments.pictures:
        with Image.open(path) as picture:
            found = {name: correlations(hues_along(picture, line)) for name, line in LINES[arguments.of].items()}
        print(path)
        for name, alike in found.items():
            next_two = ", ".join(f"{value:.2f}" for value in alike[_PER_PLATE::_PER_PLATE][:2])
            print(f"  {name}: {correlation_length(alike):.2f} plates; next plates {next_two}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of lamps from which a material takes a lamp's matrix (channels.py), by one number: the lamp's row.

    0                       white: D65
    BLACK_BODY              black bodies, at equal steps of a mired, 1e6 / kelvins
    DAYLIGHT                daylight, likewise
    then                    the CIE's illuminants, and lines at each nanometre
    last                    further lamps, such as files' spectra, in a given order

A row holds a column for each channel, the linear RGB of the channel over that of the scene's lamp, and a last column:
the share of each of these components in the luminance."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from .channels import channel_count, scene_matrix
from .illuminants import BLACK_BODY_K, FIRST, LINES_NM, named
from .observer import mirror_xyz
from .working_space import lamp_rgb, rgb_from_xyz

_STEP_MIRED = 1.0


def _temperatures(lowest: int, highest: int) -> list[int]:
    """Kelvins, highest first, at equal steps of a mired."""
    return [round(1e6 / mired) for mired in np.arange(1e6 / highest, 1e6 / lowest + 0.5, _STEP_MIRED)]


_BLACK_BODIES = [f"{kelvins}K" for kelvins in _temperatures(*BLACK_BODY_K)]
# Daylight begins at 4000 K.
_DAYLIGHTS = [f"D{kelvins}" for kelvins in _temperatures(4000, BLACK_BODY_K[1])]
BLACK_BODY, DAYLIGHT = 1, 1 + len(_BLACK_BODIES)
_OTHERS = [*(name for name in named() if name != FIRST), *(f"{nm}nm" for nm in range(LINES_NM[0], LINES_NM[1] + 1))]
# The distance in the CIE 1976 diagram (u', v') up to which a light's colour counts as a black body's or daylight's.
_NEAR = 0.02


def lamps_of_table(further: Sequence[str] = ()) -> list[str]:
    """The lamps of all rows, in order."""
    return [FIRST, *_BLACK_BODIES, *_DAYLIGHTS, *_OTHERS, *further]


@cache
def _rows() -> dict[str, int]:
    """The row of each lamp that every table holds."""
    return {lamp: row for row, lamp in reversed(list(enumerate(lamps_of_table())))}


def row_of(lamp: str, further: Sequence[str] = ()) -> float:
    """The row of a lamp. Raises ValueError for a lamp that is neither in every table nor among the further ones."""
    for letter, first in (("K", BLACK_BODY), ("D", DAYLIGHT)):
        kelvins = lamp.replace(letter, "", 1)
        if letter in lamp and kelvins.isdigit() and len(kelvins) > 3:
            return first + round((1e6 / int(kelvins) - 1e6 / BLACK_BODY_K[1]) / _STEP_MIRED)
    rows = _rows()
    return rows[lamp] if lamp in rows else len(rows) + list(further).index(lamp)


def row_of_temperature(kelvins: str) -> str:
    """An expression for a driver: the row of a black body of `kelvins`, an expression too."""
    first = 1e6 / BLACK_BODY_K[1]
    mired = f"min(max(1e6 / {kelvins}, {first:g}), {1e6 / BLACK_BODY_K[0]:g})"
    return f"{BLACK_BODY} + ({mired} - {first:g}) / {_STEP_MIRED:g}"


def lamp_table(space: str, illuminant: str, further: Sequence[str] = ()) -> np.ndarray:
    """The table (rows, channels + 1, 3) float32 of a bake under an illuminant, for a linear space."""
    lamps = lamps_of_table(further)
    luminance = np.linalg.inv(rgb_from_xyz(space))[1]
    table = np.zeros((len(lamps), channel_count(illuminant) + 1, 3), np.float32)
    for row, lamp in enumerate(lamps):
        table[row, :-1] = scene_matrix(space, illuminant, lamp).T
        table[row, -1] = luminance * (1.0 if lamp == FIRST else lamp_rgb(space, lamp))
    return table


@cache
def _places(space: str) -> tuple[np.ndarray, np.ndarray]:
    """The rows (n,) of black bodies and daylight, and their u', v' (n, 2) as lamps of a space."""
    rows = np.arange(BLACK_BODY, DAYLIGHT + len(_DAYLIGHTS))
    to_xyz = np.linalg.inv(rgb_from_xyz(space))
    lamps = lamps_of_table()
    return rows, _uv(np.array([to_xyz @ lamp_rgb(space, lamps[row]) for row in rows]))


def _uv(xyz: np.ndarray) -> np.ndarray:
    """u', v' (n, 2) of the CIE 1976 diagram."""
    x, y, z = xyz.T
    return np.stack([4 * x, 9 * y], axis=-1) / np.maximum(x + 15 * y + 3 * z, 1e-12)[:, None]


def nearest_row(rgb: Sequence[float], space: str) -> float:
    """The row of the black body or daylight whose colour is the nearest to a light's linear RGB; 0 for a light of
    another colour, which counts as white behind a filter."""
    xyz = np.linalg.inv(rgb_from_xyz(space)) @ np.asarray(rgb, float)
    if xyz[1] <= 0:
        return 0.0
    rows, places = _places(space)
    distances = np.hypot(*(places - _uv(xyz[None])).T)
    white = np.hypot(*(_uv(mirror_xyz(FIRST)[None]) - _uv(xyz[None]))[0])
    nearest = int(distances.argmin())
    return float(rows[nearest]) if distances[nearest] < min(_NEAR, white) else 0.0

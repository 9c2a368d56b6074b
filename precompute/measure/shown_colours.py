# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a renderer's space is from the colours that a bake shows.

A bake's own error is that of its table. Colours outside of a renderer's space have a further error, however exact the
table is (precompute/colour/gamut.py)."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..colour.difference import delta_e_2000, lab
from ..colour.gamut import shown_rgb
from ..colour.observer import white_xyz
from ..colour.working_space import RGB_SPACES, rgb_from_xyz
from ..table.radiance import reflected_xyz
from ..table.table import Table

# The exposure: the luminance of every colour, where white is 1.
SHOWN_Y = 0.3
# Number of colours that are drawn.
_DRAWN = 500
# Within this many standard deviations of the kernel, light counts as the mirror image.
_MIRROR = 5.0


@dataclass(frozen=True)
class ShownColours:
    """What an RGB space does to a bake's colours.

    outside   share of the light whose colours the space lacks
    p50, p95  CIEDE2000 of these colours as shown, at Y = SHOWN_Y: median and 95th percentile; 0 if there are none"""

    outside: float
    p50: float
    p95: float

    def as_dict(self) -> dict[str, Any]:
        """Convert to JSON."""
        return {"outside": self.outside, "p50": self.p50, "p95": self.p95}


def shown_colours(table: Table) -> dict[str, ShownColours]:
    """What each space of RGB_SPACES does to a table's colours. A table without light beside the mirror image gives an
    empty dictionary."""
    xyz = colours_by_light(table, np.random.default_rng(0))
    return {space: shown_in(xyz, space, table.illuminant) for space in RGB_SPACES} if len(xyz) else {}


def colours_by_light(table: Table, rng: np.random.Generator, tried: int = 20_000) -> np.ndarray:
    """Colours (n, 3) in XYZ that a surface shows beside its mirror image, at Y = SHOWN_Y. They are drawn by their light
    from `tried` pairs of directions."""
    turn, square = 2 * np.pi * rng.random((2, tried)), rng.random((2, tried))
    sine = np.sqrt(square)
    wi, wr = np.stack([sine * np.cos(turn), sine * np.sin(turn), np.sqrt(1 - square)], axis=-1)
    xyz = reflected_xyz(table, wi, wr)
    u, v = (wi + wr)[:, :2].T
    weight = np.where(np.hypot(u, v) > _MIRROR * table.sigma_b, np.maximum(xyz[:, 1], 0), 0)
    total = weight.sum()
    if not total > 0:
        return np.empty((0, 3))
    drawn = xyz[rng.choice(tried, _DRAWN, p=weight / total)]
    return SHOWN_Y * drawn / drawn[:, 1:2]


def shown_in(xyz: np.ndarray, space: str, illuminant: str = "D65") -> ShownColours:
    """What an RGB space does to colours (n, 3) in XYZ."""
    to_rgb = rgb_from_xyz(space, illuminant)
    outside = (xyz @ to_rgb.T < 0).any(axis=1)
    if not outside.any():
        return ShownColours(0.0, 0.0, 0.0)
    kept = xyz[outside]
    white = white_xyz(illuminant)
    errors = delta_e_2000(lab(shown_rgb(kept, to_rgb) @ np.linalg.inv(to_rgb).T, white), lab(kept, white))
    return ShownColours(float(outside.mean()), float(np.median(errors)), float(np.percentile(errors, 95)))


def is_shown(record: object) -> bool:
    """Whether a record of a file holds shown_colours' result as JSON."""
    return isinstance(record, dict) and all(
        space in RGB_SPACES
        and isinstance(found, dict)
        and found.keys() == {"outside", "p50", "p95"}
        and all(type(each) in (int, float) for each in found.values())
        for space, found in record.items()
    )


def told(spaces: dict[str, Any]) -> str:
    """One line about shown_colours' result as JSON; "" for an empty one."""
    parts = [
        f"{space} lacks {found['outside']:.0%} of the light's colours"
        + (f" (dE00 {found['p50']:.1f}, p95 {found['p95']:.1f})" if found["outside"] else "")
        for space, found in spaces.items()
    ]
    return f"as shown: {', '.join(parts)}" if parts else ""

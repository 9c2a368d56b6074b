# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a renderer's space is from the colours that a bake shows.

A bake's own error is that of its table. Colours outside of a renderer's space have a further error, however exact the
table is (precompute/colour/spaces.py)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..colour.observer import white_xyz
from ..colour.spaces import RGB_SPACES, delta_e_2000, lab, rgb_from_xyz, shown_rgb
from .errors import Candidate, Truth

# The exposure: the luminance of every colour, where white is 1.
SHOWN_Y = 0.3
# Number of colours that are drawn.
_DRAWN = 500


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


# What each space of RGB_SPACES does to the colours of a surface; empty for a surface without light.
Shown = dict[str, ShownColours]


def shown_against(truth: Sequence[Truth], candidate: Candidate, illuminant: str, *, ratio_ior: float) -> Shown:
    """What each space does to a candidate's colours, against the truth's, at the pairs that are spread over all
    directions."""
    parts = []
    for each in truth:
        spread = each.only(~each.pairs.drawn)
        factor = spread.pairs.radiance_factor(ratio_ior=ratio_ior)[:, None]
        found = candidate(spread.pairs.u, spread.pairs.v, each.w)[0]
        parts.append(np.stack([factor * spread.scattered_xyz / each.w**2, factor * found]))
    if not parts:
        return {}
    true, found = np.concatenate(parts, axis=1)
    chosen = chosen_by_light(true[:, 1], np.random.default_rng(0))
    scale = SHOWN_Y / true[chosen, 1:2]
    return in_all_spaces(scale * true[chosen], scale * found[chosen], illuminant)


def chosen_by_light(luminance: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Indices of colours, drawn in proportion to their luminance (n,); none if all are dark."""
    weight = np.maximum(luminance, 0)
    total = weight.sum()
    return rng.choice(len(weight), _DRAWN, p=weight / total) if total > 0 else np.empty(0, int)


def in_all_spaces(true: np.ndarray, found: np.ndarray, illuminant: str) -> Shown:
    """What each space does to colours `found` (n, 3) in XYZ, against the true ones (n, 3)."""
    return {space: shown_in(true, found, space, illuminant=illuminant) for space in RGB_SPACES} if len(true) else {}


def shown_in(true: np.ndarray, found: np.ndarray, space: str, *, illuminant: str = "D65") -> ShownColours:
    """What an RGB space does to colours `found` (n, 3) in XYZ, against the true ones (n, 3)."""
    to_rgb = rgb_from_xyz(space, illuminant)
    outside = (true @ to_rgb.T < 0).any(axis=1)
    if not outside.any():
        return ShownColours(0.0, 0.0, 0.0)
    white = white_xyz(illuminant)
    shown = shown_rgb(found[outside], to_rgb) @ np.linalg.inv(to_rgb).T
    errors = delta_e_2000(lab(shown, white), lab(true[outside], white))
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
        f"{space} {found['outside']:.0%}"
        + (f" (dE00 {found['p50']:.1f}, p95 {found['p95']:.1f})" if found["outside"] else "")
        for space, found in spaces.items()
    ]
    return f"colours too pure for a screen, shown greyer: {', '.join(parts)}" if parts else ""

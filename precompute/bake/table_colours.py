# SPDX-License-Identifier: GPL-3.0-or-later
"""The colours that a bake's table sends towards viewers, and what a renderer's space does to them."""

import numpy as np

from ..measure.shown_colours import SHOWN_Y, Shown, chosen_by_light, in_all_spaces
from ..table.radiance import reflected_xyz
from ..table.table import Table

# Within this many standard deviations of the kernel, light counts as the mirror image.
_MIRROR = 5.0


def shown_colours(table: Table) -> Shown:
    """What each space does to a table's colours beside its mirror image."""
    xyz = colours_by_light(table, np.random.default_rng(0))
    return in_all_spaces(xyz, xyz, table.illuminant)


def colours_by_light(table: Table, rng: np.random.Generator, tried: int = 20_000) -> np.ndarray:
    """Colours (n, 3) in XYZ that a surface shows beside its mirror image, at Y = SHOWN_Y. They are drawn by their light
    from `tried` pairs of directions."""
    turn, square = 2 * np.pi * rng.random((2, tried)), rng.random((2, tried))
    sine = np.sqrt(square)
    wi, wr = np.stack([sine * np.cos(turn), sine * np.sin(turn), np.sqrt(1 - square)], axis=-1)
    xyz = reflected_xyz(table, wi, wr)
    u, v = (wi + wr)[:, :2].T
    chosen = chosen_by_light(np.where(np.hypot(u, v) > _MIRROR * table.sigma_b, xyz[:, 1], 0), rng)
    return SHOWN_Y * xyz[chosen] / xyz[chosen, 1:2]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares a bake's zero order with direct sums."""

from collections.abc import Sequence

import numpy as np

from ..colour.channels import channel_weights
from ..colour.observer import WAVELENGTH_MIN_M
from ..surface.relief import Relief
from . import direct_sums
from .table_file import Table

# Number of values of w at which the zero order is checked.
_AT = 17
# The relative rounding error of a half float.
_HALF_STEP = 2.0**-11
# Share of the light that the bake's expansion of the phasor may miss for a dE00 of 1. The zero order, which has all of
# its light in one place, may miss the same share.
_EXPANSION = 2e-4


def zero_order_off(table: Table, reliefs: Sequence[Relief]) -> float:
    """The largest |dY| of the zero order at some values of w, and the largest error of its channels beyond XYZ.

    A channel's error counts over the integral of its curve's absolute value, which is 1 for Y. So zero_order_budget
    holds for every channel."""
    w = np.linspace(0, 2, _AT) + 1 / len(table.zero_order)
    w = w[(w >= table.w_range[0]) & (w <= table.w_range[1])]
    exact = direct_sums.zero_order_xyz(reliefs, w, table.illuminant, matter=table.matter)
    weights = channel_weights(direct_sums.at_each_nanometre(table.illuminant), table.illuminant)
    off = np.abs(table.zero_order_channels(w) - exact) / np.abs(weights).sum(axis=0)
    return float(off[:, [1, *range(3, off.shape[1])]].max(initial=0.0))


def zero_order_budget(reliefs: Sequence[Relief], samples: int, asked: float) -> float:
    """The largest |dY| of the zero order that passes: the sum of three errors, times `asked` if above 1.

    The first error is the rounding of a half float. The second is the smoothing of Z(w) by B-splines over samples h
    apart: at most |Z''| h^2 / 6 <= (2 pi sigma / lambda)^2 h^2 / 3 for heights of variance sigma^2, where Z'' is the
    second derivative of Z. The third is the expansion's tolerance."""
    step = 2 / (samples - 1)
    variance = max(np.average(relief.height_m**2, weights=relief.apodisation**2) for relief in reliefs)
    bend = (2 * np.pi / WAVELENGTH_MIN_M) ** 2 * variance * step**2 / 3
    return max(1.0, asked) * float(_HALF_STEP + bend + _EXPANSION)

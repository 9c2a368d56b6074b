# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan of a bake: what it is made from, and how fine it is."""

from dataclasses import dataclass

import numpy as np

from ..optics.region import Region
from ..spectra.series import SpectrumSeries
from ..table.table import held_region


@dataclass(frozen=True)
class Plan:
    """What a bake is made from, and how fine it is.

    ensemble     the series of each scan; the mean of their spectra is baked
    wavelengths  in metres, ascending
    sigma_b      the standard deviation of the kernel in (u, v)
    texel        the step of u and v from one texel to the next
    axes         v and u at the texels' middles
    terms        the number of Chebyshev terms in w
    w_range      the range of w
    precision    the kind of float that holds the terms well enough in a file
    bound_tolerance  the relative error that the table of the albedo bound may have at 1 % of directions"""

    ensemble: tuple[SpectrumSeries, ...]
    wavelengths: np.ndarray
    sigma_b: float
    texel: float
    axes: tuple[np.ndarray, np.ndarray]
    terms: int
    w_range: tuple[float, float]
    precision: type[np.floating]
    bound_tolerance: float = 0.0

    @property
    def region(self) -> Region:
        """The region of (u, v) that the table holds."""
        return held_region(self.axes)

    @property
    def texels_per_sigma(self) -> float:
        """Texels to one standard deviation of the kernel."""
        return self.sigma_b / self.texel

# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan of a bake: what it is made from and how fine it is."""

from dataclasses import dataclass

import numpy as np

from ..optics.region import Region
from ..spectra.series import SpectrumSeries
from ..table.table import held_region


@dataclass(frozen=True)
class Plan:
    """What a bake is made from: spectra, wavelengths, kernel, the texels' middles along v and u, terms in w, and the
    float that holds those."""

    ensemble: tuple[SpectrumSeries, ...]
    wavelengths: np.ndarray
    sigma_b: float
    texel: float
    axes: tuple[np.ndarray, np.ndarray]
    terms: int
    w_range: tuple[float, float]
    precision: type

    @property
    def region(self) -> Region:
        """What the table holds of (u, v)."""
        return held_region(self.axes)

    @property
    def texels_per_sigma(self) -> float:
        return self.sigma_b / self.texel

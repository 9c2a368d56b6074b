# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan of a bake: its spectra and its resolution.

ensemble.py makes the plan (patch.py under the patch model). It takes the number of terms in w from terms_and_texels.py,
the wavelengths from wavelengths.py, and the number of transforms in s from spectra/fast.py. basis.py may then combine
the terms into fewer.
"""

from dataclasses import dataclass

import numpy as np

from ..optics.region import Region
from ..reflectance.matter import DIELECTRIC, Matter
from ..spectra.series import SpectrumSeries
from ..table.table import held_region


@dataclass(frozen=True)
class Plan:
    """A bake's spectra and resolution.

    ensemble     the series of each scan; the mean of their spectra is baked
    wavelengths  in metres, ascending
    sigma_b      the standard deviation of the kernel in (u, v)
    texel        the step of u and v per texel
    axes         v and u at the texels' centres
    terms        the number of Chebyshev terms in w
    w_range      the range of w
    precision    the kind of float that holds the terms well enough in a file
    matter       what the surface is made of; the table of a dielectric does not hold its reflectance
    largest_albedo   the number, at least 1, by which the light is divided (largest_albedo.py)"""

    ensemble: tuple[SpectrumSeries, ...]
    wavelengths: np.ndarray
    sigma_b: float
    texel: float
    axes: tuple[np.ndarray, np.ndarray]
    terms: int
    w_range: tuple[float, float]
    precision: type[np.floating]
    matter: Matter = Matter(DIELECTRIC)
    largest_albedo: float = 1.0

    @property
    def holds_reflectance(self) -> bool:
        """Whether the table holds its matter's reflectance."""
        return self.matter.baked

    @property
    def region(self) -> Region:
        """The region of (u, v) that the table holds."""
        return held_region(self.axes)

    @property
    def texels_per_sigma(self) -> float:
        """Texels per standard deviation of the kernel."""
        return self.sigma_b / self.texel

# SPDX-License-Identifier: GPL-3.0-or-later
"""Wavelengths distributed like the observer's sensitivity, for materials that sample the spectrum."""

import numpy as np

from .illuminants import line_of
from .observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, mirror_xyz, observer

_STEPS = 4001


def wavelength_quantiles(count: int, illuminant: str = "D65") -> np.ndarray:
    """Wavelengths (count,) in metres, each for an equal share of the observer's X + Y + Z.

    Samples at these wavelengths have the weight `drawn_weight`. A laser's line gives its own wavelength each time."""
    line = line_of(illuminant)
    if line is not None:
        return np.full(count, line)
    wavelengths = np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, _STEPS)
    density = observer(wavelengths, illuminant).sum(axis=1)
    share = np.concatenate([[0], np.cumsum(density[1:] + density[:-1])])
    return np.interp((np.arange(count) + 0.5) / count, share / share[-1], wavelengths)


def drawn_weight(illuminant: str = "D65") -> float:
    """The integral of the observer's X + Y + Z over all wavelengths."""
    return float(mirror_xyz(illuminant).sum())

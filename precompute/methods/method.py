# SPDX-License-Identifier: GPL-3.0-or-later
"""What every method of evaluating the spectrum has in common: its settings, its shape, its sum over wavelengths."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from ..colour.observer import spectral_weights, wavelengths
from ..optics.coherence import THESIS_COHERENCE_M


@dataclass(frozen=True)
class Settings:
    """What a method is built with; each takes what it knows of.

    coherence_length_m  4 sigma_s; None: 65 um under the patch model, the narrowest sound kernel under the ensemble
    terms       of an expansion of the phasor; None: as many as `tolerance` asks for at the largest s
    tolerance   of the phasor, for the automatic number of terms
    step_m      wavelength step
    dtype       float32 or float64: what an expansion's images are stored and summed in
    centred     Taylor about the middle of the relief instead of its lowest point (the thesis's)
    texels      of a transform that are read around each frequency, a side, odd
    period_m    of the grating, for those that want one; None: found in the relief
    illuminant  what counts as white
    """

    coherence_length_m: float | None = None
    terms: int | None = None
    tolerance: float = 1e-4
    step_m: float = 5e-9
    dtype: type = np.float32
    centred: bool = False
    texels: int = 3
    period_m: float | None = None
    illuminant: str = "D65"

    @property
    def patch_sigma_m(self) -> float:
        """Standard deviation sigma_s of the patch model's window in metres."""
        return (self.coherence_length_m or THESIS_COHERENCE_M) / 4


class Method(Protocol):
    """One way to evaluate the spectrum of a relief.

    u, v (n,), w (n,) or a number. Densities are over (u, v), the zero order included, so that a full reflector's
    integral is 1 under every method that conserves power."""

    name: str
    coherence: Literal["patch", "ensemble"]

    def density(self, u, v, w, wavelength_m) -> np.ndarray:
        """PSD((u, v) / lambda; w / lambda) / lambda^2 (n,). Raises GratingError where a method has no spectrum."""
        ...

    def xyz(self, u, v, w) -> np.ndarray:
        """The density summed over the method's own wavelengths (n, 3), a perfect mirror's white having Y = 1."""
        ...


def spectral_sum(density: Callable, u, v, w, settings: Settings) -> np.ndarray:
    """XYZ (n, 3): the density at equally spaced wavelengths, weighted by the observer."""
    lambdas = wavelengths(settings.step_m)
    weights = spectral_weights(lambdas, settings.illuminant)
    return sum(density(u, v, w, lam)[:, None] * weight for lam, weight in zip(lambdas, weights, strict=True))

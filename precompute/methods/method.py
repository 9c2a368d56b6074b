# SPDX-License-Identifier: GPL-3.0-or-later
"""The common parts of all methods: the settings, the protocol, the sum over wavelengths, and the description.

Each module of this folder declares a MethodEntry for every method in it. method_registry.py collects the entries, and
the product's lists of methods are derived from them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from ..base.failure import GratingError
from ..colour.observer import spectral_weights, wavelengths
from ..optics.coherence import THESIS_COHERENCE_M
from ..surface.relief import Relief
from .term_images import ShaderImages

Coherence = Literal["patch", "ensemble"]


@dataclass(frozen=True)
class Settings:
    """The settings from which a method is built. A method ignores settings that it does not use.

    coherence_length_m  4 sigma_s; None: 65 um under the patch model, under the ensemble model the length of the
                        narrowest kernel that averages enough of the relief
    terms       number of terms in the phasor's expansion; None: the number that `tolerance` needs at the largest s
    tolerance   largest error of the phasor, by which the number of terms is chosen
    step_m      wavelength step in metres
    dtype       float32 or float64: the precision in which an expansion's images are stored and summed
    centred     whether Taylor's heights count from the middle of the relief; else from its lowest point (the thesis)
    texels      number of texels of a transform read around each frequency along each axis; odd
    period_m    period of the grating in metres, for a method that needs one; None: found in the relief
    illuminant  the illuminant that is white: one of ILLUMINANTS
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
    """A way to evaluate the spectrum of a relief.

    Directions are u, v (n,) and w (n,) or a number. Densities are over (u, v) and include the zero order, so that the
    integral over a full reflector is 1 under every method that conserves power."""

    name: str
    coherence: Coherence
    settings: Settings

    def density(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float, *, wavelength_m: float) -> np.ndarray:
        """PSD((u, v) / lambda; w / lambda) / lambda^2 (n,). Raises GratingError if the method has no spectrum."""
        ...

    def xyz(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float) -> np.ndarray:
        """XYZ (n, 3): the density summed over the method's wavelengths. A perfect mirror's white has Y = 1."""
        return spectral_sum(self.density, u, v, w=w, settings=self.settings)

    def densities_in_plane(self, u: np.ndarray, w: np.ndarray, lambdas_m: np.ndarray) -> np.ndarray:
        """Density (wavelengths, n) at v = 0, for u (n,) in descending order and w (n,)."""
        zeros = np.zeros(len(u))
        return np.stack([self.density(u, zeros, w, wavelength_m=lam) for lam in lambdas_m])

    @property
    def table_bytes(self) -> int:
        """Bytes of the data that the method reads for each direction."""
        return 0

    def shader_images(self) -> ShaderImages:
        """The images for the method's OSL shader. Raises GratingError if the method has no shader."""
        raise GratingError(self.name, "no shader evaluates it", "choose another method")


class _Density(Protocol):
    """Method.density."""

    def __call__(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float, *, wavelength_m: float) -> np.ndarray: ...


def spectral_sum(
    density: _Density, u: np.ndarray, v: np.ndarray, *, w: np.ndarray | float, settings: Settings
) -> np.ndarray:
    """XYZ (n, 3): the density at equally spaced wavelengths, weighted by the observer."""
    lambdas = wavelengths(settings.step_m)
    weights = spectral_weights(lambdas, settings.illuminant)
    return sum(
        density(u, v, w, wavelength_m=lam)[:, None] * weight for lam, weight in zip(lambdas, weights, strict=True)
    )


# build(relief, settings): raises GratingError for a relief that the method cannot handle.
Build = Callable[[Relief, Settings], Method]


@dataclass(frozen=True)
class MethodEntry:
    """A method's name and capabilities.

    coherence    model of coherence; the method is compared with the reference of the same model
    build        makes the method for a relief
    in_maps      whether maps of it are offered; false if a map would take hours
    has_shader   whether an OSL shader evaluates it from images of its terms (Method.shader_images)
    """

    name: str
    coherence: Coherence
    build: Build
    in_maps: bool = True
    has_shader: bool = False

# SPDX-License-Identifier: GPL-3.0-or-later
"""NMM: only the wavelengths that satisfy the grating equation (thesis 4.3).

For a grating of period d they are lambda_n = |u| d / n, with n an integer and |u| d / lambda_max <= n <= |u| d /
lambda_min, and the same for v. NMM takes FLSS's density at each of them. The thesis adds the densities up as if the
wavelengths were equally spaced, which is wrong. An order is as wide as the window, and it covers a direction over an
interval of wavelengths:

    integral of exp(-(u / lambda - n / d)^2 / sigma_f^2) d lambda = sqrt(pi) sigma_f lambda_n^2 / |u|

This width is the missing Jacobian. Without it blue has too much weight, and the picture turns purple.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, observer
from ..surface.quality import grating_period
from ..surface.relief import Relief
from . import flss
from .method import Coherence, Method, MethodEntry, Settings, spectral_sum
from .term_images import ShaderImages
from .windowed_images import WindowedImages

# Within this many standard deviations of the specular peak no wavelength satisfies the grating equation, and all
# wavelengths are summed. The thesis paints this disc white.
_SPECULAR_REACH = 3.0


@dataclass(frozen=True)
class Nmm(Method):
    """NMM over the images of FLSS (`full`). With `jacobian`, densities are multiplied by the orders' widths."""

    name: str
    full: WindowedImages
    period_m: float
    jacobian: bool
    settings: Settings
    coherence: Coherence = "patch"

    def density(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float, *, wavelength_m: float) -> np.ndarray:
        """FLSS's density if the wavelength is within half a step of a selected wavelength, else 0."""
        u, v, w = np.broadcast_arrays(u, v, w)
        chosen = self._specular(u, v)
        for component in (u, v):
            order = np.abs(component) * self.period_m / wavelength_m
            nearest = np.maximum(np.rint(order), 1)
            offset = np.abs(component) * self.period_m / nearest - wavelength_m
            chosen = chosen | (np.abs(offset) <= self.settings.step_m / 2)
        out = np.zeros(len(u))
        out[chosen] = self.full.density(u[chosen], v[chosen], w[chosen], wavelength_m=wavelength_m)
        return out

    def xyz(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float) -> np.ndarray:
        """See Method."""
        u, v, w = np.broadcast_arrays(u, v, w)
        out = np.zeros((len(u), 3))
        specular = self._specular(u, v)
        out[specular] = spectral_sum(self.full.density, u[specular], v[specular], w=w[specular], settings=self.settings)
        for component in (u, v):
            orders = int(np.abs(component).max(initial=0) * self.period_m / WAVELENGTH_MIN_M)
            for n in range(1, orders + 1):
                lam = np.abs(component) * self.period_m / n
                at = ~specular & (lam >= WAVELENGTH_MIN_M) & (lam <= WAVELENGTH_MAX_M)
                density = self.full.density(u[at], v[at], w[at], wavelength_m=lam[at])
                spacing = self._spacing(lam[at], np.abs(component[at]))
                out[at] += (density * spacing)[:, None] * observer(lam[at], self.settings.illuminant)
        return out

    @property
    def table_bytes(self) -> int:
        """Bytes of FLSS's images."""
        return self.full.table_bytes

    def shader_images(self) -> ShaderImages:
        """The images of FLSS, with the period."""
        return replace(self.full.shader_images(), period_m=self.period_m)

    def _spacing(self, lam: np.ndarray, component: np.ndarray) -> np.ndarray | float:
        if self.jacobian:
            return np.sqrt(np.pi) * self.full.sigma_f * lam**2 / component
        return self.settings.step_m

    def _specular(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.hypot(u, v) < specular_radius(self.full.sigma_f)


def specular_radius(sigma_f: float) -> float:
    """Radius of the disc in (u, v) where all wavelengths are summed."""
    return float(_SPECULAR_REACH * WAVELENGTH_MAX_M * sigma_f / np.sqrt(2))


def build(relief: Relief, settings: Settings) -> Nmm:
    """Build NMM as printed. Raises GratingError if the relief has no period or is too deep for FLSS."""
    return Nmm("nmm", flss.build(relief, settings), grating_period(relief, settings.period_m), False, settings)


def build_jacobian(relief: Relief, settings: Settings) -> Nmm:
    """Build NMM with the missing Jacobian. Raises GratingError as `build` does."""
    period = grating_period(relief, settings.period_m)
    return Nmm("nmm-jacobian", flss.build(relief, settings), period, True, settings)


ENTRIES = (
    MethodEntry("nmm", "patch", build, has_shader=True),
    MethodEntry("nmm-jacobian", "patch", build_jacobian, has_shader=True),
)

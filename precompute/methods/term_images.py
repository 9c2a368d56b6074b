# SPDX-License-Identifier: GPL-3.0-or-later
"""The transforms of an expansion's terms as images, and how a shader reads them: a few texels around a frequency.

With the phasor p = sum_n c_n(s) f_n(h), its spectrum at any s is sum_n c_n(s) F_n: the images F_n are made once.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..colour.observer import S_MAX
from ..spectra.patch_window import PatchWindow
from ..surface.relief import Relief
from .method import Settings, spectral_sum


class Expansion(Protocol):
    """p = sum_n c_n(s) f_n(h)."""

    def fields(self, height_m: np.ndarray) -> Iterable[np.ndarray]:
        """f_n(h), one array like height_m for each term."""
        ...

    def coefficients(self, s: np.ndarray) -> np.ndarray:
        """c_n(s) (m, terms) at s (m,)."""
        ...


@dataclass(frozen=True)
class TermImages:
    """terms (ny, nx, N), complex: the DFT of each term times the apodisation over the number of pixels, zero frequency
    in the middle, phases counted from the middle pixel; the frequencies are bins of 1 / size_m (Ly, Lx) metres."""

    terms: np.ndarray
    size_m: tuple[float, float]

    @property
    def origin(self) -> tuple[int, int]:
        """Texel (y, x) of the zero frequency."""
        return self.terms.shape[0] // 2, self.terms.shape[1] // 2

    def read(self, q_y, q_x, coefficients, weight: Callable, texels: int) -> np.ndarray:
        """sum_n c_n F_n (m,) at frequencies (m,), from texels x texels around the nearest texel.

        weight(axis, distance): how much a texel counts that lies `distance` (m,) bins away. What lies outside the
        images counts as zero. Sums are in the images' own precision."""
        real = self.terms.real.dtype
        coefficients = coefficients.astype(self.terms.dtype if np.iscomplexobj(coefficients) else real)
        places = [q * length + o for q, length, o in zip((q_y, q_x), self.size_m, self.origin, strict=True)]
        nearest = [np.rint(place).astype(int) for place in places]
        reach = texels // 2
        total = np.zeros(len(q_x), self.terms.dtype)
        for j in range(-reach, reach + 1):
            weight_y, row = self._texel(0, nearest[0] + j, places[0], weight)
            for i in range(-reach, reach + 1):
                weight_x, col = self._texel(1, nearest[1] + i, places[1], weight)
                value = np.einsum("mn,mn->m", self.terms[row, col], coefficients)
                total += (weight_y * weight_x).astype(real) * value
        return total

    def _texel(self, axis: int, index: np.ndarray, place: np.ndarray, weight: Callable):
        count = self.terms.shape[axis]
        inside = (index >= 0) & (index < count)
        return inside * weight(axis, index - place), np.clip(index, 0, count - 1)


def make_images(relief: Relief, expansion: Expansion, dtype: type) -> TermImages:
    """The images of an expansion, in float32 or float64, of the frequencies that |u|, |v| <= 2 reach."""
    kept = [_kept(n, length) for n, length in zip(relief.height_m.shape, relief.size_m, strict=True)]
    narrow = np.complex64 if dtype == np.float32 else np.complex128
    images = []
    for field in expansion.fields(relief.height_m):
        transform = np.fft.fft2(np.fft.ifftshift(relief.apodisation * field)) / relief.height_m.size
        images.append(transform[np.ix_(*kept)].astype(narrow))
    return TermImages(np.stack(images, axis=-1), relief.size_m)


def _kept(count: int, length_m: float) -> np.ndarray:
    """Indices into an unshifted transform, ascending in frequency, its zero at the middle (size // 2)."""
    below = min(count // 2, int(np.ceil(S_MAX * length_m)) + 2)
    above = min((count - 1) // 2, below)
    # An even number of bins has one more below zero than above it, as fftshift leaves it.
    below = above + 1 if below > above else below
    return np.arange(-below, above + 1) % count


@dataclass(frozen=True)
class WindowedImages:
    """FLSS, thesis Algorithm 3, over any expansion: per wavelength, the terms' images under the Gaussian window.

    `scale` turns |sum|^2 into PSD."""

    name: str
    images: TermImages
    expansion: Expansion
    sigma_f: float
    scale: float
    settings: Settings
    coherence: str = "patch"

    def density(self, u, v, w, wavelength_m) -> np.ndarray:
        """See Method; wavelength_m may be (n,)."""
        u, v, w, lam = np.broadcast_arrays(u, v, w, wavelength_m)
        s, which = np.unique(w / lam, return_inverse=True)
        coefficients = self.expansion.coefficients(s)[which.ravel()]
        amplitude = self.images.read(v / lam, u / lam, coefficients, self._weight, self.settings.texels)
        return self.scale * np.abs(amplitude).astype(float) ** 2 / lam**2

    def xyz(self, u, v, w) -> np.ndarray:
        """See Method."""
        return spectral_sum(self.density, u, v, w, self.settings)

    def _weight(self, axis: int, distance: np.ndarray) -> np.ndarray:
        return np.exp(-0.5 * (distance / (self.images.size_m[axis] * self.sigma_f)) ** 2)


def windowed(name: str, relief: Relief, expansion: Expansion, settings: Settings) -> WindowedImages:
    """An expansion's images under the patch model's window."""
    window = PatchWindow(relief, settings.patch_sigma_m)
    scale = window.density_scale() * window.kernel_at_zero() ** 2
    images = make_images(relief, expansion, settings.dtype)
    return WindowedImages(name, images, expansion, window.sigma_f, scale, settings)


def left_out(texels: int, sigma_bins: float) -> float:
    """Bound of the weights, along one axis, of all texels that are not read: sum of exp(-d^2 / (2 sigma^2)).

    The nearest texel is at most half a bin away, so on its side the first left out is at least texels / 2 bins away, on
    the other one at least half a bin more; 0.07 for 3 texels and a patch as long as its coherence (sigma = 2 / pi)."""
    distance = texels / 2 + np.arange(0, 64, 0.5)
    return float(np.exp(-0.5 * (distance / sigma_bins) ** 2).sum())

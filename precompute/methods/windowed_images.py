# SPDX-License-Identifier: GPL-3.0-or-later
"""FLSS over any expansion (thesis Algorithm 3): the images of the terms, read under the Gaussian window."""

from dataclasses import dataclass

import numpy as np

from ..spectra.spectrum import PatchWindow
from ..surface.relief import Relief
from .method import Coherence, Method, Settings
from .term_images import Expansion, ShaderImages, TermImages, make_images, read_spectrum


@dataclass(frozen=True)
class WindowedImages(Method):
    """The terms' images, read for each wavelength under a Gaussian window of sigma_f cycles per metre.

    `scale` turns |sum|^2 into a PSD, in square metres."""

    name: str
    images: TermImages
    expansion: Expansion
    sigma_f: float
    scale: float
    settings: Settings
    coherence: Coherence = "patch"

    def density(
        self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float, *, wavelength_m: np.ndarray | float
    ) -> np.ndarray:
        """See Method; wavelength_m may be (n,)."""
        directions = np.broadcast_arrays(u, v, w, wavelength_m)
        amplitude = read_spectrum(
            self.images, self.expansion, directions, weight=self._weight, texels=self.settings.texels
        )
        return self.scale * np.abs(amplitude).astype(float) ** 2 / directions[-1] ** 2

    @property
    def table_bytes(self) -> int:
        """Bytes of the images."""
        return self.images.terms.nbytes

    def shader_images(self) -> ShaderImages:
        """See Method."""
        return ShaderImages(self.images, self.expansion, self.scale, self.sigma_f)

    def _weight(self, axis: int, distance: np.ndarray) -> np.ndarray:
        return np.exp(-0.5 * (distance / (self.images.size_m[axis] * self.sigma_f)) ** 2)


def windowed(name: str, relief: Relief, expansion: Expansion, *, settings: Settings) -> WindowedImages:
    """Put an expansion's images under the patch model's window."""
    window = PatchWindow(relief, settings.patch_sigma_m)
    scale = window.density_scale() * window.kernel_at_zero() ** 2
    images = make_images(relief, expansion, settings.dtype)
    return WindowedImages(name, images, expansion, window.sigma_f, scale, settings)


def left_out(texels: int, sigma_bins: float) -> float:
    """Bound of the weights, along one axis, of all texels that are not read: sum of exp(-d^2 / (2 sigma^2)).

    The nearest texel is at most half a bin away. On its side, the first unread texel is therefore at least texels / 2
    bins away; on the other side it is at least half a bin further. The bound is 0.07 for 3 texels and a patch as long
    as its coherence (sigma = 2 / pi bins)."""
    distance = texels / 2 + np.arange(0, 64, 0.5)
    return float(np.exp(-0.5 * (distance / sigma_bins) ** 2).sum())

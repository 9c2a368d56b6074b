# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms of an expansion's terms as images, and their reading as in a shader: a few texels around a frequency.

The phasor is expanded as p = sum_n c_n(s) f_n(h). Its spectrum at any s is then sum_n c_n(s) F_n, where F_n is the
transform of f_n(h). The images F_n do not depend on s and are made once.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from ..base.failure import Setting
from ..base.machine import refuse_beyond_memory
from ..colour.observer import S_MAX
from ..surface.relief import SMALLER, Relief

# The memory per pixel of the relief while one term is transformed, in bytes, as measured.
_BYTES_PER_PIXEL = 64

# weight(axis, distance), see TermImages.read.
Weight = Callable[[int, np.ndarray], np.ndarray]


class Expansion(Protocol):
    """p = sum_n c_n(s) f_n(h). The heights are divided by scale_m in the terms."""

    @property
    def series(self) -> Literal["taylor", "chebyshev"]:
        """The name of the series."""
        ...

    @property
    def scale_m(self) -> float:
        """Metres of height that count as 1 in the series."""
        ...

    def fields(self, height_m: np.ndarray) -> Iterable[np.ndarray]:
        """f_n(h), one array of height_m's shape for each term."""
        ...

    def coefficients(self, s: np.ndarray) -> np.ndarray:
        """c_n(s) (m, terms) at s (m,) in cycles per metre."""
        ...


@dataclass(frozen=True)
class TermImages:
    """terms (ny, nx, N), complex: the DFT of each term times the apodisation, divided by the number of pixels.

    The zero frequency is in the middle, phases count from the middle pixel, and a bin is 1 / size_m (Ly, Lx) metres."""

    terms: np.ndarray
    size_m: tuple[float, float]

    @property
    def origin(self) -> tuple[int, int]:
        """Texel (y, x) of the zero frequency."""
        return self.terms.shape[0] // 2, self.terms.shape[1] // 2

    def read(
        self, q_y: np.ndarray, q_x: np.ndarray, coefficients: np.ndarray, *, weight: Weight, texels: int
    ) -> np.ndarray:
        """sum_n c_n F_n (m,) at frequencies q_y, q_x (m,), from texels x texels around the nearest texel.

        weight(axis, distance) is the weight of a texel that is `distance` (m,) bins away along an axis. Texels outside
        the images count as zero. Sums are in the images' own precision."""
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

    def _texel(self, axis: int, index: np.ndarray, place: np.ndarray, weight: Weight) -> tuple[np.ndarray, np.ndarray]:
        count = self.terms.shape[axis]
        inside = (index >= 0) & (index < count)
        return inside * weight(axis, index - place), np.clip(index, 0, count - 1)


def read_spectrum(
    images: TermImages, expansion: Expansion, directions: Sequence[np.ndarray], *, weight: Weight, texels: int
) -> np.ndarray:
    """The expanded phasor's spectrum (m,) at directions u, v, w and wavelengths in metres, each (m,).

    weight and texels are those of `TermImages.read`. Coefficients are computed once for each s = w / wavelength."""
    u, v, w, lam = directions
    s, which = np.unique(w / lam, return_inverse=True)
    coefficients = expansion.coefficients(s)[which.ravel()]
    return images.read(v / lam, u / lam, coefficients, weight=weight, texels=texels)


@dataclass(frozen=True)
class ShaderImages:
    """The inputs of a method's OSL shader.

    power      factor from |sum|^2 / lambda^2 to the density over (u, v), square metres
    sigma_f    standard deviation of the Gaussian window's transform, cycles per metre; 0 without a window
    copies     number of copies of the cell, along B (v) and T (u)
    period_m   period of the grating in metres; 0 if the method does not use it
    """

    images: TermImages
    expansion: Expansion
    power: float
    sigma_f: float = 0.0
    copies: tuple[int, int] = (1, 1)
    period_m: float = 0.0


def make_images(relief: Relief, expansion: Expansion, dtype: type) -> TermImages:
    """Make the images of an expansion, in float32 or float64, at the frequencies that |u|, |v| <= 2 reach.

    Raises GratingError if they would take more than half of the free memory."""
    kept = [_kept(n, length) for n, length in zip(relief.height_m.shape, relief.size_m, strict=True)]
    narrow = np.complex64 if dtype == np.float32 else np.complex128
    terms = expansion.coefficients(np.zeros(1)).shape[1]
    # np.stack holds the images twice.
    needed = 2 * terms * np.dtype(narrow).itemsize * math.prod(map(len, kept)) + _BYTES_PER_PIXEL * relief.height_m.size
    refuse_beyond_memory(needed, f"the relief's {terms} terms", (f"{SMALLER}, or lower ", Setting.TERMS))
    images = []
    for field in expansion.fields(relief.height_m):
        transform = np.fft.fft2(np.fft.ifftshift(relief.apodisation * field)) / relief.height_m.size
        images.append(transform[np.ix_(*kept)].astype(narrow))
    return TermImages(np.stack(images, axis=-1), relief.size_m)


def _kept(count: int, length_m: float) -> np.ndarray:
    """Indices into an unshifted transform, in ascending order of frequency, with the zero in the middle (size // 2)."""
    below = min(count // 2, int(np.ceil(S_MAX * length_m)) + 2)
    above = min((count - 1) // 2, below)
    # An even number of bins has one more below zero than above it, as after fftshift.
    below = above + 1 if below > above else below
    return np.arange(-below, above + 1) % count

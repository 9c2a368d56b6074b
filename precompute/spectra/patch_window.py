# SPDX-License-Identifier: GPL-3.0-or-later
"""The patch model of coherence (thesis 3.2): an endless repetition of the patch under one Gaussian amplitude window.

    P(q; s) = sum over pixels of g t p exp(-i 2 pi q.x),   g = exp(-|x|^2 / (2 sigma^2)),   PSD = dA |P|^2 / sum (g t)^2

p is the phasor at s = w / lambda, x a position, q a spatial frequency, dA the area of a pixel. t is the relief's
apodisation, which is 1 if its edges wrap. The integral of PSD over the Nyquist cell is 1.

The thesis convolves the patch's DFT with a Gaussian, which is the same as repeating the patch under a window. Its
window is centred on the patch's corner, so the seams of a raw scan show as a cross. Here it is centred on the patch.
"""

from dataclasses import dataclass

import numpy as np

from ..surface.relief import Relief

# The window ends at this many standard deviations, where it is exp(-7.5^2 / 2) = 6e-13 of its peak.
_WINDOW_REACH = 7.5


@dataclass(frozen=True)
class PatchWindow:
    """A Gaussian amplitude window of standard deviation sigma_m, in metres, over a relief."""

    relief: Relief
    sigma_m: float

    @property
    def sigma_f(self) -> float:
        """Standard deviation of the window's Fourier transform, in cycles per metre."""
        return 1 / (2 * np.pi * self.sigma_m)

    def positions(self, axis: int) -> np.ndarray:
        """Positions (pixels,) in metres from the window's centre, the middle pixel, along axis 0 (B) or 1 (T)."""
        count = self.relief.height_m.shape[axis]
        return (np.arange(count) - count // 2) * self.relief.pixel_size_m[axis]

    def copies(self, axis: int) -> np.ndarray:
        """Shifts (m,) in metres, along axis 0 (B) or 1 (T), of the patch's copies that the window reaches."""
        length = self.relief.size_m[axis]
        reach = int(np.ceil(_WINDOW_REACH * self.sigma_m / length + 0.5))
        return np.arange(-reach, reach + 1) * length

    def squared_sum(self) -> float:
        """The sum of (g t)^2 over the pixels of all copies."""
        along = [
            np.exp(-(((self.positions(axis)[:, None] + self.copies(axis)) / self.sigma_m) ** 2)).sum(axis=1)
            for axis in (0, 1)
        ]
        return float(along[0] @ self.relief.apodisation**2 @ along[1])

    def density_scale(self) -> float:
        """The factor dA / sum (g t)^2, in square metres, that turns |P|^2 into PSD."""
        return float(np.prod(self.relief.pixel_size_m)) / self.squared_sum()

    def kernel_at_zero(self) -> float:
        """The transform of g at q = 0, as a sum over pixels: the integral of g divided by a pixel's area."""
        return 2 * np.pi * self.sigma_m**2 / float(np.prod(self.relief.pixel_size_m))

    def waves(self, axis: int, q: np.ndarray) -> np.ndarray:
        """Sum g(x) exp(-i 2 pi q x) over the copies of each pixel along an axis: (n, pixels) for q (n,)."""
        x = self.positions(axis)
        total = np.zeros((len(q), len(x)), complex)
        for shift in self.copies(axis):
            window = np.exp(-0.5 * ((x + shift) / self.sigma_m) ** 2)
            total += np.exp(-2j * np.pi * shift * q)[:, None] * window
        return total * np.exp(-2j * np.pi * q[:, None] * x)

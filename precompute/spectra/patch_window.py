# SPDX-License-Identifier: GPL-3.0-or-later
"""The patch model of coherence (thesis 3.2): the patch, repeated without end, under one Gaussian amplitude window.

    P(q; s) = sum over pixels of g t p exp(-i 2 pi q.x),   g = exp(-|x|^2 / (2 sigma^2)),   PSD = dA |P|^2 / sum (g t)^2

with the apodisation t of the relief (1 where its edges wrap), so that the integral over the Nyquist cell is 1.
Repeating is what the thesis's convolution of the DFT with a Gaussian means; the window is centred on the patch, not on
its corner as there, where the seams of a raw scan run through the middle of the window and draw a cross.
"""

from dataclasses import dataclass

import numpy as np

from ..surface.relief import Relief

# exp(-7.5^2 / 2) = 6e-13 of the window's peak.
_WINDOW_REACH = 7.5


@dataclass(frozen=True)
class PatchWindow:
    """The Gaussian window, sigma_m in metres, over a relief."""

    relief: Relief
    sigma_m: float

    @property
    def sigma_f(self) -> float:
        """Standard deviation of the window's transform, cycles per metre."""
        return 1 / (2 * np.pi * self.sigma_m)

    def positions(self, axis: int) -> np.ndarray:
        """Metres (pixels,) from the window's centre, the middle pixel, along axis 0 (B) or 1 (T)."""
        count = self.relief.height_m.shape[axis]
        return (np.arange(count) - count // 2) * self.relief.pixel_size_m[axis]

    def copies(self, axis: int) -> np.ndarray:
        """Shifts in metres (m,) of the patch's copies that the window reaches."""
        length = self.relief.size_m[axis]
        reach = int(np.ceil(_WINDOW_REACH * self.sigma_m / length + 0.5))
        return np.arange(-reach, reach + 1) * length

    def squared_sum(self) -> float:
        """Sum of (g t)^2 over the pixels of all copies."""
        along = [
            np.exp(-(((self.positions(axis)[:, None] + self.copies(axis)) / self.sigma_m) ** 2)).sum(axis=1)
            for axis in (0, 1)
        ]
        return float(along[0] @ self.relief.apodisation**2 @ along[1])

    def density_scale(self) -> float:
        """dA / sum (g t)^2: what turns |P|^2 into PSD."""
        return float(np.prod(self.relief.pixel_size_m)) / self.squared_sum()

    def kernel_at_zero(self) -> float:
        """Transform of g at q = 0, as a sum over pixels."""
        return 2 * np.pi * self.sigma_m**2 / float(np.prod(self.relief.pixel_size_m))

    def waves(self, axis: int, q: np.ndarray) -> np.ndarray:
        """g(x) exp(-i 2 pi q x) summed over the copies (n, pixels), q (n,)."""
        x = self.positions(axis)
        total = np.zeros((len(q), len(x)), complex)
        for shift in self.copies(axis):
            window = np.exp(-0.5 * ((x + shift) / self.sigma_m) ** 2)
            total += np.exp(-2j * np.pi * shift * q)[:, None] * window
        return total * np.exp(-2j * np.pi * q[:, None] * x)

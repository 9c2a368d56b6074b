# SPDX-License-Identifier: GPL-3.0-or-later
"""The patch model of coherence (thesis 3.2): an endless repetition of the patch under one Gaussian amplitude window.

    P(q; s) = sum over pixels of g t p exp(-i 2 pi q.x),   g = exp(-|x|^2 / (2 sigma^2)),   PSD = dA |P|^2 / sum (g t)^2

p is the phasor at s = w / lambda, x a position, q a spatial frequency, dA the area of a pixel. t is the relief's
apodisation, which is 1 if its edges wrap. The integral of PSD over the Nyquist cell is 1.

The thesis convolves the patch's DFT with a Gaussian, which is the same as repeating the patch under a window. Its
window is centred on the patch's corner, so the seams of a raw scan show as a cross. Here it is centred on the patch.
A window elsewhere is the same as one in the middle of a patch that is shifted, because the patch repeats.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..base.failure import GratingError, Setting
from ..surface.relief import Relief

# The window ends at this many standard deviations, where it is exp(-7.5^2 / 2) = 6e-13 of its peak.
_WINDOW_REACH = 7.5
# A window elsewhere than in the middle must have this many standard deviations on each side, which is half of its
# coherence length. Along an axis, erfc(2) = 0.5 % of its light, which goes as the square of the amplitude, is beyond.
_HALF_COHERENCE = 2.0


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


def window_at(relief: Relief, sigma_m: float, centre_um: tuple[float, float] | None = None) -> PatchWindow:
    """A window at a place on the scan: (x, y) in micrometres, to the right and upwards from its lower left corner.

    By default it is in the middle. The place is rounded to a pixel. Raises GratingError if the window does not fit."""
    return PatchWindow(relief if centre_um is None else shifted(relief, sigma_m, centre_um), sigma_m)


def shifted(relief: Relief, sigma_m: float, centre_um: tuple[float, float]) -> Relief:
    """The relief, shifted around its edges until the place of window_at is its middle pixel."""
    x, y = centre_um
    _check_fits(relief, sigma_m, (y, x))
    shifts = [
        count // 2 - min(int(um * 1e-6 / pixel_m), count - 1)
        for um, pixel_m, count in zip((y, x), relief.pixel_size_m, relief.height_m.shape, strict=True)
    ]
    along_y, along_x = (np.roll(axis, shift) for axis, shift in zip(relief.apodisation_axes, shifts, strict=True))
    return replace(relief, height_m=np.roll(relief.height_m, shifts, (0, 1)), apodisation_axes=(along_y, along_x))


def _check_fits(relief: Relief, sigma_m: float, centre_um: tuple[float, float]) -> None:
    """Raise GratingError unless the window about (y, x) is on the scan. If the edges wrap, its centre must be."""
    half_um = 0.0 if relief.periodic else _HALF_COHERENCE * sigma_m * 1e6
    size_um = [length * 1e6 for length in relief.size_m]
    rounding = 1e-9 * max(size_um)
    if all(half_um - rounding <= um <= size - half_um + rounding for um, size in zip(centre_um, size_um, strict=True)):
        return
    (y, x), (high, wide) = centre_um, size_um
    fault = f"no window of {4 * sigma_m * 1e6:g} um about {x:g},{y:g} um fits on the scan of {wide:g} x {high:g} um"
    if 2 * half_um > min(size_um):
        raise GratingError("", fault, ("ask for a ", Setting.COHERENCE_UM, f" of at most {min(size_um):g}"))
    allowed = f" from {half_um:g},{half_um:g} to {wide - half_um:g},{high - half_um:g}"
    raise GratingError("", fault, ("give a ", Setting.PATCH_UM, allowed))

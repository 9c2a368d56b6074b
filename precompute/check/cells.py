# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes a relief's scattered spectrum in cells of frequency by direct sums, and spreads its light by a kernel.

There is no FFT and no expansion: the apodised phasor without its mean is summed against cosines and sines over every
pixel, at a list of frequencies.

A surface that wraps has orders at whole multiples of 1 / length, and no light at other frequencies. The spectrum of a
surface that does not wrap is continuous. It is sampled at multiples of 1 / (length + PAD / (2 pi sigma_q)), where
sigma_q is the standard deviation of the applied kernel in cycles per metre. At this spacing the kernel's sum over the
samples is the kernel's integral: blurring a spectrum by the kernel weights the lags of the scan's autocorrelation by a
Gaussian of standard deviation 1 / (2 pi sigma_q). Sampling the spectrum repeats this Gaussian with the period length +
PAD / (2 pi sigma_q), and the repetitions weight the lags as well. The longest lag of the scan, at which the apodised
scan barely overlaps itself, gets a weight of exp(-PAD^2 / 2) from a repetition, all other lags less.

The sums are in single precision. Each rounding is 6e-8 of its number. So the cells share about 1e-14 of the light that
belongs elsewhere.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..optics.region import FARTHEST
from ..surface.relief import Relief

# Padding of a scan that does not wrap, in units of 1 / (2 pi sigma_q).
PAD = 3.0
# The kernel is cut at this many standard deviations, where it is exp(-6^2 / 2) = 1.5e-8 of its peak.
KERNEL_REACH = 6.0
# The largest spacing of merged cells, in standard deviations of the kernel.
_MERGED = 1 / 3
# The shares of the light of a cell midway between six cells, by the interpolation of a polynomial through these six.
_SHARES = np.array([3, -25, 150, 150, -25, 3], np.float32) / 256
# Number of values gathered at once, to limit memory.
_GATHERED = 4_000_000


@dataclass(frozen=True)
class Cells:
    """The scattered spectrum in cells of frequency.

    q_y, q_x  the centres (ny,) and (nx,) of the cells, in cycles per metre, ascending
    power     (ny, nx) float32, the share of the light that is scattered into each cell
    window_q  widths (y, x) of the scan's apodisation window, in cycles per metre, which the cells' light already has"""

    q_y: np.ndarray
    q_x: np.ndarray
    power: np.ndarray
    window_q: tuple[float, float]

    def density(self, u: np.ndarray, v: np.ndarray, lam: float, *, sigma_b: float) -> np.ndarray:
        """Density (n,) over (u, v) at places u, v (n,), at the wavelength lam in metres, under a kernel of sigma_b.

        The light of each cell is spread about lam * q as a Gaussian of the rest of the kernel."""
        rows, kernel_y = _near(self.q_y, v, lam, _rest(sigma_b, lam * self.window_q[0]))
        cols, kernel_x = _near(self.q_x, u, lam, _rest(sigma_b, lam * self.window_q[1]))
        found = np.empty(len(u))
        at_once = max(1, _GATHERED // (rows.shape[1] * cols.shape[1]))
        for start in range(0, len(u), at_once):
            part = slice(start, start + at_once)
            along_x = self.power[rows[part, :, None], cols[part, None, :]] @ kernel_x[part, :, None]
            found[part] = (along_x[..., 0] * kernel_y[part]).sum(axis=1)
        return found

    def wide_density(
        self, u: np.ndarray, v: np.ndarray, lam: float, *, sigma: np.ndarray, farthest: float = FARTHEST
    ) -> np.ndarray:
        """The density (n,) under kernels of `sigma` (n,), of the light within |(u, v)| = farthest only: no pair of
        directions shows other light.

        Cells are merged where the kernel is wide against them."""
        cells = replace(self, power=self.power * (self.q_x**2 + self.q_y[:, None] ** 2 <= (farthest / lam) ** 2))
        found = np.empty(len(u))
        for each in np.unique(sigma):
            cells = cells.merged(each / lam)
            of_sigma = sigma == each
            found[of_sigma] = cells._summed(u[of_sigma], v[of_sigma], lam, each)
        return found

    def merged(self, sigma_q: float) -> "Cells":
        """The cells, merged by twos while their spacing stays below _MERGED of a kernel of sigma_q.

        A cell between two that stay gives its light to the three on either side. This is the transpose of interpolating
        the kernel there by the polynomial of degree 5 through six places, which is off by at most h^6 (225 / 64) / 720
        times the kernel's sixth derivative, for places h apart. A Gaussian's sixth derivative is at most 15 / sigma^6
        of its peak. So one merging at h = sigma / 3 is off by 1e-4 of the peak, all of both axes by 2.1e-4, which is a
        dE00 of at most 0.01."""
        q_y, power = _merged_along(self.q_y, self.power, _rest(sigma_q, self.window_q[0]))
        q_x, power = _merged_along(self.q_x, power.T, _rest(sigma_q, self.window_q[1]))
        return replace(self, q_y=q_y, q_x=q_x, power=power.T)

    def _summed(self, u: np.ndarray, v: np.ndarray, lam: float, sigma: float) -> np.ndarray:
        """The density (n,) as a sum over all cells."""
        kernel_y, kernel_x = (
            _gaussian(at[:, None] - lam * q, _rest(sigma, lam * width))
            for at, q, width in zip((v, u), (self.q_y, self.q_x), self.window_q, strict=True)
        )
        return np.einsum("nx,nx->n", kernel_y @ self.power, kernel_x)


def _rest(sigma: float, width: float) -> float:
    """The standard deviation, at least sigma / sqrt(5), that widens a window of this width to a kernel of sigma."""
    return float(np.sqrt(max(sigma**2 - width**2, sigma**2 / 5)))


def _near(q: np.ndarray, places: np.ndarray, lam: float, sigma: float) -> tuple[np.ndarray, np.ndarray]:
    """Indices (n, m) of the frequencies within the kernel's reach of places (n,), and the kernel there."""
    centres = lam * q
    first = np.searchsorted(centres, places - KERNEL_REACH * sigma)
    count = int((np.searchsorted(centres, places + KERNEL_REACH * sigma) - first).max(initial=1))
    index = first[:, None] + np.arange(count)
    inside = index < len(q)
    index = np.minimum(index, len(q) - 1)
    return index, inside * _gaussian(places[:, None] - centres[index], sigma)


def _gaussian(distance: np.ndarray, sigma: float) -> np.ndarray:
    """The normal density of standard deviation sigma at a distance, in single precision."""
    return np.exp(-0.5 * (distance / sigma).astype(np.float32) ** 2) / np.float32(np.sqrt(2 * np.pi) * sigma)


def _merged_along(q: np.ndarray, power: np.ndarray, sigma_q: float) -> tuple[np.ndarray, np.ndarray]:
    """Places q (n,) and their power (n, m), merged as in Cells.merged.

    Each merging adds two places at the lower end and three at the upper."""
    beside = len(_SHARES) // 2
    while len(q) > 1 and 2 * (q[1] - q[0]) <= _MERGED * sigma_q:
        between, step = power[1::2], 2 * (q[1] - q[0])
        power = np.pad(power[::2], [(beside - 1, beside), (0, 0)])
        for k, share in enumerate(_SHARES):
            power[k : k + len(between)] += share * between
        q = q[0] + step * (np.arange(len(power)) - (beside - 1))
    return q, power


def scattered_cells(relief: Relief, s: float, reach: tuple[float, float], *, sigma_q: float) -> Cells:
    """Cells of a relief at s = w / lambda, spaced finely enough for a kernel of sigma_q.

    The cells go up to `reach`, the largest |q_y| and |q_x|. All are in cycles per metre."""
    turns = s * relief.height_m
    phase = (-2 * np.pi * (turns - np.rint(turns))).astype(np.float32)
    parts = np.stack([np.cos(phase), np.sin(phase)])
    mean_y, mean_x = (apodisation**2 / np.sum(apodisation**2) for apodisation in relief.apodisation_axes)
    parts -= (mean_y @ parts @ mean_x)[:, None, None].astype(np.float32)
    parts *= relief.apodisation_axes[0][:, None].astype(np.float32)
    parts *= relief.apodisation_axes[1].astype(np.float32)
    (q_y, step_y), (q_x, step_x) = (_frequencies(relief, axis, reach[axis], sigma_q) for axis in (0, 1))
    waves_y, waves_x = _waves(q_y, relief, 0), _waves(q_x, relief, 1)
    sums = [
        [wave_y.T @ (part @ wave_x) for wave_x, part in zip(waves_x, _halves(along_y, axis=2), strict=True)]
        for wave_y, along_y in zip(waves_y, _halves(parts, axis=1), strict=True)
    ]
    energy = np.prod([np.sum(apodisation**2) for apodisation in relief.apodisation_axes])
    power = _power(sums) * np.float32(np.prod(relief.pixel_size_m) * step_y * step_x / energy)
    return Cells(np.concatenate([-q_y[:0:-1], q_y]), np.concatenate([-q_x[:0:-1], q_x]), power, relief.window_q)


def _frequencies(relief: Relief, axis: int, reach: float, sigma_q: float) -> tuple[np.ndarray, float]:
    """Frequencies from 0 to `reach`, within the Nyquist cell, and their spacing; cycles per metre."""
    length, pixel = relief.size_m[axis], relief.pixel_size_m[axis]
    # A scan of a single line is a profile, constant across its short axis, and needs no padding along that axis.
    if not relief.periodic and relief.height_m.shape[axis] > 1:
        length += PAD / (2 * np.pi * _rest(sigma_q, relief.window_q[axis]))
    most = min(reach * length, (length / pixel - 1) / 2 + 1e-6)
    return np.arange(int(most) + 1) / length, 1 / length


def _halves(parts: np.ndarray, *, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """The sums and differences of the pixels that lie alike on both sides of the middle of an axis, middle first.

    The cosine sums the former and the sine the latter, each over half of the pixels. A pixel in the middle counts
    once."""
    count = parts.shape[axis]
    half = (count + 1) // 2
    beyond = np.moveaxis(parts, axis, 0)[count - half :]
    before = np.moveaxis(parts, axis, 0)[half - 1 :: -1]
    even, odd = beyond + before, beyond - before
    if count % 2:
        even[0] /= 2
    return np.moveaxis(even, 0, axis), np.moveaxis(odd, 0, axis)


def _waves(q: np.ndarray, relief: Relief, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """cos and sin of 2 pi q x (pixels, n) for q (n,), at the pixels of _halves, whose x counts from the middle."""
    count = relief.height_m.shape[axis]
    x = (np.arange(count // 2, count) - (count - 1) / 2) * relief.pixel_size_m[axis]
    turns = np.outer(x, q)
    phase = (2 * np.pi * (turns - np.rint(turns))).astype(np.float32)
    return np.cos(phase), np.sin(phase)


def _power(sums: list[list[np.ndarray]]) -> np.ndarray:
    """|sum of p exp(-2 pi i (q_y y + q_x x))|^2 (2 ny - 1, 2 nx - 1) for both signs of both frequencies.

    p is the summed field, y and x are positions. `sums`: p's real and imaginary part (2, ny, nx) times cosines, then
    sines, along y; in each, along x."""
    (cc, cs), (sc, ss) = [[real + 1j * imaginary for real, imaginary in along_y] for along_y in sums]
    same, opposite = (cc - ss, cs + sc), (cc + ss, cs - sc)
    up_right, down_left = (_squared(same[0] + sign * same[1]) for sign in (-1j, 1j))
    down_right, up_left = (_squared(opposite[0] + sign * opposite[1]) for sign in (-1j, 1j))
    down = np.hstack([down_left[:0:-1, :0:-1], down_right[:0:-1]])
    return np.vstack([down, np.hstack([up_left[:, :0:-1], up_right])])


def _squared(amplitude: np.ndarray) -> np.ndarray:
    return amplitude.real**2 + amplitude.imag**2

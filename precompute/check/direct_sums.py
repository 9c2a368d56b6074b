# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the ensemble model's radiance by direct sums, a second way to precompute/reference, for `check` only.

This file shares no code with the reference or the bake, except the relief (levelled, filled, refined and apodised) and
the observer's tables. There is no FFT and no expansion: the apodised phasor without its mean is summed against cosines
and sines over every pixel, at a list of frequencies.

A surface that wraps has orders at whole multiples of 1 / length, and no light at other frequencies. The spectrum of a
surface that does not wrap is continuous. It is sampled at multiples of 1 / (length + PAD / (2 pi sigma_q)), where
sigma_q is the standard deviation of the kernel in cycles per metre. At this spacing the kernel's sum over the samples
is the kernel's integral: blurring a spectrum by the kernel weights the lags of the scan's autocorrelation by a Gaussian
of standard deviation 1 / (2 pi sigma_q). Sampling the spectrum repeats this Gaussian with the period length + PAD / (2
pi sigma_q), and the repetitions weight the lags as well. The longest lag of the scan, at which the apodised scan barely
overlaps itself, gets a weight of exp(-PAD^2 / 2) from a repetition, all other lags less.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.progress import Progress, silent
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, observer, seen_wavelengths, spectral_weights
from ..measure.pairs import Pairs, cosine_weighted, pair_about
from ..optics.region import FARTHEST, Region
from ..reflectance.matter import MIRRORING, Matter
from ..surface.relief import Relief

# Padding of a scan that does not wrap, in units of 1 / (2 pi sigma_q).
PAD = 3.0
# The kernel is cut at this many standard deviations, where it is exp(-6^2 / 2) = 1.5e-8 of its peak.
KERNEL_REACH = 6.0
# Number of bands of wavelength, all of the same luminance, in which half vectors are drawn.
_DRAWN_AT = 12
# Number of classes of heights. On a relief of 2 um, a class spans 0.02 radians; the mean phasor is off by 1e-5.
_HEIGHT_CLASSES = 4096
# Number of values gathered at once, to limit memory.
_GATHERED = 4_000_000


@dataclass(frozen=True)
class Cells:
    """The scattered spectrum in cells of frequency.

    q_y, q_x  the centres (ny,) and (nx,) of the cells, in cycles per metre, ascending
    power     (ny, nx), the share of the light that is scattered into each cell"""

    q_y: np.ndarray
    q_x: np.ndarray
    power: np.ndarray

    def density(self, u: np.ndarray, v: np.ndarray, lam: float, *, sigma_b: float) -> np.ndarray:
        """Density (n,) over (u, v) at places u, v (n,), at the wavelength lam in metres.

        The light of each cell is spread as a Gaussian of sigma_b about lam * q."""
        rows, kernel_y = _near(self.q_y, v, lam, sigma_b)
        cols, kernel_x = _near(self.q_x, u, lam, sigma_b)
        found = np.empty(len(u))
        at_once = max(1, _GATHERED // (rows.shape[1] * cols.shape[1]))
        for start in range(0, len(u), at_once):
            part = slice(start, start + at_once)
            along_x = self.power[rows[part, :, None], cols[part, None, :]] @ kernel_x[part, :, None]
            found[part] = (along_x[..., 0] * kernel_y[part]).sum(axis=1)
        return found

    def wide_density(self, u: np.ndarray, v: np.ndarray, lam: float, *, sigma: np.ndarray) -> np.ndarray:
        """The density (n,) under kernels of `sigma` (n,), of the light within |(u, v)| = 2 only: no pair of directions
        shows other light, and no table holds it."""
        power = self.power * (np.hypot(self.q_x, self.q_y[:, None]) * lam <= FARTHEST)
        kernel_y, kernel_x = (
            np.exp(-0.5 * ((at[:, None] - lam * q) / sigma[:, None]) ** 2) / (np.sqrt(2 * np.pi) * sigma[:, None])
            for at, q in ((v, self.q_y), (u, self.q_x))
        )
        return ((kernel_y @ power) * kernel_x).sum(axis=1)


def _near(q: np.ndarray, places: np.ndarray, lam: float, sigma_b: float) -> tuple[np.ndarray, np.ndarray]:
    """Indices (n, m) of the frequencies within the kernel's reach of places (n,), and the kernel there."""
    centres = lam * q
    first = np.searchsorted(centres, places - KERNEL_REACH * sigma_b)
    count = int((np.searchsorted(centres, places + KERNEL_REACH * sigma_b) - first).max(initial=1))
    index = first[:, None] + np.arange(count)
    inside = index < len(q)
    index = np.minimum(index, len(q) - 1)
    kernel = np.exp(-0.5 * ((places[:, None] - centres[index]) / sigma_b) ** 2) / (np.sqrt(2 * np.pi) * sigma_b)
    return index, inside * kernel


def scattered_cells(relief: Relief, s: float, reach: tuple[float, float], *, sigma_q: float) -> Cells:
    """Cells of a relief at s = w / lambda, spaced finely enough for a kernel of sigma_q.

    The cells go up to `reach`, the largest |q_y| and |q_x|. All are in cycles per metre."""
    phase = (-2 * np.pi * s) * relief.height_m
    parts = np.stack([np.cos(phase), np.sin(phase)])
    mean_y, mean_x = (apodisation**2 / np.sum(apodisation**2) for apodisation in relief.apodisation_axes)
    parts -= (mean_y @ parts @ mean_x)[:, None, None]
    parts *= relief.apodisation_axes[0][:, None]
    parts *= relief.apodisation_axes[1]
    (q_y, step_y), (q_x, step_x) = (_frequencies(relief, axis, reach[axis], sigma_q) for axis in (0, 1))
    sums = _waves(q_y, relief, 0).T @ (parts @ _waves(q_x, relief, 1))
    energy = np.prod([np.sum(apodisation**2) for apodisation in relief.apodisation_axes])
    power = _power(sums[0] + 1j * sums[1]) * (np.prod(relief.pixel_size_m) * step_y * step_x / energy)
    return Cells(np.concatenate([-q_y[:0:-1], q_y]), np.concatenate([-q_x[:0:-1], q_x]), power)


def _frequencies(relief: Relief, axis: int, reach: float, sigma_q: float) -> tuple[np.ndarray, float]:
    """Frequencies from 0 to `reach`, within the Nyquist cell, and their spacing; cycles per metre."""
    length, pixel = relief.size_m[axis], relief.pixel_size_m[axis]
    # A scan of a single line is a profile, constant across its short axis, and needs no padding along that axis.
    if not relief.periodic and relief.height_m.shape[axis] > 1:
        length += PAD / (2 * np.pi * sigma_q)
    most = min(reach * length, (length / pixel - 1) / 2 + 1e-6)
    return np.arange(int(most) + 1) / length, 1 / length


def _waves(q: np.ndarray, relief: Relief, axis: int) -> np.ndarray:
    """cos and sin of 2 pi q x (pixels, 2 n), side by side, for q (n,)."""
    phase = 2 * np.pi * np.outer(np.arange(relief.height_m.shape[axis]) * relief.pixel_size_m[axis], q)
    return np.hstack([np.cos(phase), np.sin(phase)])


def _power(sums: np.ndarray) -> np.ndarray:
    """|sum of p exp(-2 pi i (q_y y + q_x x))|^2 (2 ny - 1, 2 nx - 1) for both signs of both frequencies.

    p is the summed field, y and x are positions. `sums` (2 ny, 2 nx): p times cosines, then sines, per axis."""
    ny, nx = sums.shape[0] // 2, sums.shape[1] // 2
    cc, cs, sc, ss = sums[:ny, :nx], sums[:ny, nx:], sums[ny:, :nx], sums[ny:, nx:]
    same, opposite = (cc - ss, cs + sc), (cc + ss, cs - sc)
    up_right, down_left = (_squared(same[0] + sign * same[1]) for sign in (-1j, 1j))
    down_right, up_left = (_squared(opposite[0] + sign * opposite[1]) for sign in (-1j, 1j))
    down = np.hstack([down_left[:0:-1, :0:-1], down_right[:0:-1]])
    return np.vstack([down, np.hstack([up_left[:, :0:-1], up_right])])


def _squared(amplitude: np.ndarray) -> np.ndarray:
    return amplitude.real**2 + amplitude.imag**2


def scattered_xyz(
    reliefs: Sequence[Relief], uvw: tuple[np.ndarray, np.ndarray, float], *, sigma_b: float | np.ndarray, step_m: float,
    illuminant: str = "D65", matter: Matter = MIRRORING, progress: Progress = silent,
) -> np.ndarray:  # fmt: skip
    """Scattered XYZ (n, 3) at the places u and v (n,), all at one w, by the mean of the reliefs' spectra.

    It is the density over (u, v) of the light that a surface of a matter and of the obliquity O = 1 reflects, scaled so
    that a perfect mirror's white has Y = 1. `sigma_b`, a number or (n,), is the kernel's standard deviation. The
    narrowest kernel spaces the cells. `progress` is called after each wavelength of each relief."""
    count = int(np.ceil((WAVELENGTH_MAX_M - WAVELENGTH_MIN_M) / step_m - 1e-6))
    lambdas = seen_wavelengths(np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, count + 1), illuminant)
    weights = spectral_weights(lambdas, illuminant) / len(reliefs)
    u, v, w = uvw
    reflectance = matter.reflectance(lambdas, np.minimum(np.sqrt(u**2 + v**2 + w**2) / 2, 1))
    sigmas = np.broadcast_to(np.asarray(sigma_b, float), u.shape)
    narrowest = float(sigmas.min(initial=1.0))
    narrow = sigmas == narrowest
    reach = [_reach(places, sigmas, narrowest) for places in (v, u)]
    found = np.zeros((len(u), 3))
    for n, relief in enumerate(reliefs):
        for k, (lam, weight) in enumerate(zip(lambdas, weights, strict=True)):
            cells = scattered_cells(relief, w / lam, (reach[0] / lam, reach[1] / lam), sigma_q=narrowest / lam)
            density = np.empty(len(u))
            density[narrow] = cells.density(u[narrow], v[narrow], lam, sigma_b=narrowest)
            if not narrow.all():
                density[~narrow] = cells.wide_density(u[~narrow], v[~narrow], lam, sigma=sigmas[~narrow])
            found += (density * reflectance[k])[:, None] * weight
            progress("check", (n + (k + 1) / len(lambdas)) / len(reliefs))
    return found


def _reach(places: np.ndarray, sigmas: np.ndarray, narrowest: float) -> float:
    """The largest |u| or |v| from which kernels of `sigmas` (n,) bring light to places (n,). Those wider than the
    narrowest bring none from beyond FARTHEST."""
    own = np.abs(places) + KERNEL_REACH * sigmas
    return float(np.where(sigmas > narrowest, np.minimum(own, FARTHEST), own).max(initial=0.0))


def zero_order_xyz(
    reliefs: Sequence[Relief], w: np.ndarray, illuminant: str = "D65", *, matter: Matter = MIRRORING
) -> np.ndarray:
    """The zero order's XYZ (n, 3) at w (n,), the mean over the reliefs, in wavelength steps of 1 nm."""
    lambdas = seen_wavelengths(np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, 401), illuminant)
    efficiency = sum(zero_order_efficiency(relief, w, lambdas) for relief in reliefs)
    efficiency = efficiency * matter.reflectance(lambdas, np.asarray(w) / 2).T
    return efficiency @ spectral_weights(lambdas, illuminant) / len(reliefs)


def zero_order_efficiency(relief: Relief, w: np.ndarray, lambdas: np.ndarray) -> np.ndarray:
    """A relief's efficiency in the zero order (n, m) at w (n,) and wavelengths (m,) in metres: the squared modulus of
    the characteristic function of its heights."""
    height, share = _distribution(relief)
    return np.stack([np.abs(np.exp(-2j * np.pi * each / lambdas[:, None] * height) @ share) ** 2 for each in w])


def _distribution(relief: Relief) -> tuple[np.ndarray, np.ndarray]:
    """The heights of a relief in classes: mean heights (n,) of the non-empty classes, and their shares (n,) of the
    surface, weighted by the squared apodisation."""
    weight = (relief.apodisation**2).ravel()
    height = relief.height_m.ravel()
    width = max(relief.height_range_m / _HEIGHT_CLASSES, np.finfo(float).tiny)
    index = np.minimum(((height - height.min()) / width).astype(int), _HEIGHT_CLASSES - 1)
    share = np.bincount(index, weight)
    mean = np.bincount(index, weight * height)[share > 0] / share[share > 0]
    return mean, share[share > 0] / weight.sum()


@dataclass(frozen=True)
class Held:
    """The directions that a table holds, and its light.

    sigma_b  standard deviation of the kernel in u and v
    region   of u and v
    least    the least cosine of both directions
    line_m   the wavelength of a laser's line in metres; None for white light"""

    sigma_b: float
    region: Region
    least: float = 0.0
    line_m: float | None = None


def draw_pairs(reliefs: Sequence[Relief], held: Held, w: float, *, count: int, rng: np.random.Generator) -> Pairs:
    """Draw up to `count` direction pairs with cos(ti) + cos(tr) = w among those that a table holds.

    Half of the pairs are cosine weighted, and half are drawn from the spectrum. Fewer are returned if pairs rarely fall
    in the region."""
    cosine = _cosine_within(w, count // 2, held, rng)
    half = _half_vectors(reliefs, w, count - count // 2, held, rng)
    wi, wr = pair_about(half, rng, least=held.least)
    drawn = np.arange(len(cosine.wi) + len(wi)) >= len(cosine.wi)
    return Pairs(np.concatenate([cosine.wi, wi]), np.concatenate([cosine.wr, wr]), drawn)


def _cosine_within(w: float, count: int, held: Held, rng: np.random.Generator) -> Pairs:
    wi, wr = np.empty((2, 0, 3))
    for _ in range(100):
        more = cosine_weighted(w, count, rng, least=held.least)
        kept = Pairs(*more, np.zeros(len(more[0]), bool)).within(held.region)
        wi, wr = np.concatenate([wi, kept.wi])[:count], np.concatenate([wr, kept.wr])[:count]
        if len(wi) == count:
            break
    return Pairs(wi, wr, np.zeros(len(wi), bool))


def _half_vectors(reliefs: Sequence[Relief], w: float, count: int, held: Held, rng: np.random.Generator) -> np.ndarray:
    """Draw up to `count` half vectors (n, 3) from the scattered power times luminance, blurred by the kernel."""
    region, sigma_b, line_m = held.region, held.sigma_b, held.line_m
    nm = np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, 401)
    luminance = np.cumsum(observer(nm)[:, 1])
    # Twice `count` half vectors are drawn, because the kernel moves some of them past the horizon.
    each = -(-2 * count // (_DRAWN_AT * len(reliefs)))
    radius = np.sqrt(4 - w**2)
    found = [np.empty((0, 2))]
    for k in range(_DRAWN_AT):
        at = np.append((k + rng.random(each)) / _DRAWN_AT, (k + 0.5) / _DRAWN_AT)
        *lambdas, middle = np.interp(at * luminance[-1], luminance, nm) if line_m is None else np.full(at.shape, line_m)
        for relief in reliefs:
            cells = scattered_cells(relief, w / middle, (radius / middle, radius / middle), sigma_q=sigma_b / middle)
            u, v = middle * cells.q_x, middle * cells.q_y[:, None]
            inside = region.contains(u, v)
            cumulative = np.cumsum(cells.power * (inside & (u**2 + v**2 < radius**2)))
            if cumulative[-1] > 0:
                bins = np.searchsorted(cumulative, rng.random(each) * cumulative[-1], side="right")
                row, col = np.unravel_index(np.minimum(bins, cumulative.size - 1), cells.power.shape)
                q = np.column_stack([cells.q_x[col], cells.q_y[row]])
                found.append(np.array(lambdas)[:, None] * q + sigma_b * rng.standard_normal((each, 2)))
    uv = rng.permutation(np.concatenate(found))
    uv = uv[region.contains(uv[:, 0], uv[:, 1]) & (np.sum(uv**2, axis=1) < radius**2)][:count]
    return np.column_stack([uv, np.full(len(uv), w)])

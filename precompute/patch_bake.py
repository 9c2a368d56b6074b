# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake of the patch model (thesis 3.2), in the same table as the ensemble's: plan, carry out, self-check.

The model's window is fixed in metres (methods/patch_window.py), so its kernel in (u, v) grows with the wavelength and
the zero order interferes with the rest: there is no Z(w) kernel(u, v) to take out. So Z is 0, and the table holds all
of the light over w^2, which no polynomial follows down to w = 0: it begins at W_MIN, under which the rim stands for
what the table lacks. The table has no limit to its albedo, and no sample set beside it: it is for key lights.

|P|^2 is made on a grid of frequencies half again as fine as the window's speckle and read between its points as a
non-uniform Fourier transform does (A. Dutt and V. Rokhlin, 1993): its transform, which ends with the window's
autocorrelation, is divided by a Gaussian's, so that a sum over Gaussians about the points is |P|^2 itself. Hence the
bake's Resampler does for both models, and leaves out of each Gaussian what cubic reading adds.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from . import budget, chebyshev, coherence, metric
from .bake import (
    ZERO_ORDER_SAMPLES,
    Bake,
    Plan,
    Progress,
    bake_wavelengths,
    narrower,
    texel_middles,
    wider_levels,
    xyz_over_w2,
)
from .colour import WAVELENGTH_MIN_M, spectral_weights
from .failure import GratingError
from .figures import Errors, Truth
from .methods.exact import Patch
from .methods.method import THESIS_COHERENCE_M, Settings
from .methods.patch_window import PatchWindow
from .needs import EVERYTHING, Needs
from .reference import wavelengths
from .relief import Relief
from .resample import KERNEL_REACH
from .self_check import pairs_within, w_within
from .series import SpectrumSeries, bound
from .spectrum import FrequencyGrid, fft_order, phasor

# The table's range of w begins here unless the needs begin later. A skin of 150 nm, the whole of (u, v), takes 13 terms
# from 0.25, 11 from 0.5, 8 from 0.75, 6 from 1, each for a dE00 of at most 0.5; 13 from 0.1 are off by 42.
W_MIN = 0.25
# Window and transform reach so many sigma_s from their middle: the window has fallen to 3e-4 of its amplitude, its
# autocorrelation, exp(-x^2 / (4 sigma_s^2)), to 1e-7 of its peak.
_WINDOW_REACH, _LAG_REACH = 4.0, 8.0
# From here on the transform of |P|^2, 1e-4 of its peak, is let go, so that dividing by the Gaussian's stays small.
_LAG_KEPT = 6.0
# The Gaussian's standard deviation, in units of sigma_f: what folds back is weighed by exp(-48 0.45^2) = 6e-5 where
# the autocorrelation is 2e-3 of its peak, and by less elsewhere.
_GAUSSIAN = 0.5
# Of the Gaussian's variance, what reading a coarse table may not take off: 0.3 sigma_f still weighs by 1e-2.
_GAUSSIAN_LEFT = 0.36
# Points past the region, where dividing meets the rim of the grid.
_MARGIN = 40
_SERIES_TOLERANCE = 1e-4
_ROWS_AT_ONCE = 64
_CHECK_GROUPS, _CHECK_PAIRS = 3, 200


@dataclass(frozen=True)
class PatchSeries(SpectrumSeries):
    """The patch model's power per bin at Chebyshev nodes in s; `scattered_over_s2` holds the power itself, all of it,
    which does not vanish with s, and `amplitude` nothing. A bin is a Gaussian of `gaussian` in q; the kernel asked for,
    `sigma_b` and what reading the table takes off, is only told by its difference."""

    gaussian: float = 0.0
    sigma_b: float = 0.0

    def weights(self, s: np.ndarray) -> np.ndarray:
        """See SpectrumSeries: of the power over s^2."""
        return super().weights(s) / np.asarray(s)[..., None] ** 2

    def zero_order(self, s: np.ndarray) -> np.ndarray:
        """None apart from the rest."""
        return np.zeros(np.shape(s))

    def kernel_left(self, sigma: float, wavelength_m: float) -> float:
        """The bins' Gaussian in (u, v), narrower by what `sigma` is narrower than sigma_b."""
        whole = (wavelength_m * self.gaussian) ** 2
        return math.sqrt(max(whole + sigma**2 - self.sigma_b**2, _GAUSSIAN_LEFT * whole))


def patch_series(window: PatchWindow, reach: float, tick=None) -> PatchSeries:
    """The series of a window's relief for |u|, |v| <= reach. tick(done, total) is called after each transform."""
    s_max = 2 / WAVELENGTH_MIN_M
    gaussian = _GAUSSIAN * window.sigma_f
    q_max = reach / WAVELENGTH_MIN_M + KERNEL_REACH * gaussian
    axes = [_Axis(window, axis, q_max) for axis in (0, 1)]
    count = bound(window.relief, s_max, _SERIES_TOLERANCE)
    power = np.empty((count, *(len(axis.q) for axis in axes)), np.float32)
    for k, s in enumerate(chebyshev.nodes(count, 0, s_max)):
        power[k] = _power(window, axes, s)
        if tick:
            tick(k + 1, count)
    grid = FrequencyGrid(axes[0].q, axes[1].q, (axes[0].transform, axes[1].transform))
    sigma_b = coherence.kernel_sigma(4 * window.sigma_m)
    return PatchSeries(grid, s_max, power, np.zeros(count), 0.0, True, gaussian, sigma_b)


class _Axis:
    """Pixels under the window, the window, and the frequencies that are kept, along axis 0 (B) or 1 (T)."""

    def __init__(self, window: PatchWindow, axis: int, q_max: float):
        pixel, count = window.relief.pixel_size_m[axis], window.relief.height_m.shape[axis]
        half = math.ceil(_WINDOW_REACH * window.sigma_m / pixel)
        offset = np.arange(-half, half + 1)
        self.pixels = (offset + count // 2) % count
        self.window = np.exp(-0.5 * (offset * pixel / window.sigma_m) ** 2) * window.relief.tapers[axis][self.pixels]
        self.transform = math.ceil(2 * _LAG_REACH * window.sigma_m / pixel)
        self.spacing = 1 / (self.transform * pixel)
        last = min(math.ceil(q_max / self.spacing) + _MARGIN, (self.transform - 1) // 2)
        self.q = np.arange(-last, last + 1) * self.spacing
        lag = np.abs(np.fft.fftfreq(len(self.q), self.spacing)) / window.sigma_m
        fall = np.clip((lag - _LAG_KEPT) / (_LAG_REACH - _LAG_KEPT), 0, 1)
        self.undo = np.exp(0.5 * (_GAUSSIAN * np.minimum(lag, _LAG_REACH)) ** 2) * (0.5 + 0.5 * np.cos(np.pi * fall))


def _power(window: PatchWindow, axes: Sequence[_Axis], s: float) -> np.ndarray:
    """PSD per bin (ny, nx) at s, its transform divided by the Gaussian's."""
    y, x = axes
    field = phasor(window.relief.height_m, s).astype(np.complex64)
    half = np.empty((len(y.pixels), len(x.q)), np.complex64)
    for start in range(0, len(y.pixels), _ROWS_AT_ONCE):
        part = slice(start, start + _ROWS_AT_ONCE)
        rows = field[np.ix_(y.pixels[part], x.pixels)] * (y.window[part, None] * x.window).astype(np.float32)
        half[part] = np.fft.fft(rows, x.transform, axis=1)[:, fft_order(x.q, x.transform)]
    power = np.empty((len(y.q), len(x.q)), np.float32)
    for start in range(0, len(x.q), _ROWS_AT_ONCE):
        part = slice(start, start + _ROWS_AT_ONCE)
        kept = np.fft.fft(half[:, part], y.transform, axis=0)[fft_order(y.q, y.transform)]
        power[:, part] = kept.real**2 + kept.imag**2
    transform = np.fft.rfft2(power)
    transform *= y.undo[:, None] * x.undo[: transform.shape[1]]
    return np.fft.irfft2(transform, power.shape) * (window.density_scale() * y.spacing * x.spacing)


def plan(
    reliefs: Sequence[Relief],
    coherence_length_m: float | None = None,
    delta_e: float = 1.0,
    illuminant: str = "D65",
    needs: Needs = EVERYTHING,
    progress: Progress = lambda stage, fraction: None,
    finer: float = 1.0,
) -> Plan:
    """As bake.plan, under one window of coherence_length_m (None: the thesis's); no kernel is widened to fit.

    Raises GratingError for several reliefs: the model is of one patch."""
    if len(reliefs) != 1:
        raise GratingError(f"{len(reliefs)} scans: the patch model is of one; give one, or take --model ensemble")
    needs = replace(needs, w=(max(needs.w[0], W_MIN), needs.w[1]))
    window = PatchWindow(reliefs[0], (coherence_length_m or THESIS_COHERENCE_M) / 4)
    series = patch_series(window, needs.reach, lambda done, total: progress("transforms", done / total))
    sigma_b = series.sigma_b
    # The kernel is narrowest in the blue: its wavelengths and texels do for all.
    narrowest = sigma_b * WAVELENGTH_MIN_M / coherence.REFERENCE_WAVELENGTH_M
    lambdas = bake_wavelengths(narrowest, delta_e, needs.reach)
    probe = budget.probe((series,), sigma_b, lambdas, illuminant, needs)
    terms = probe.terms(delta_e)
    texels = min(finer * probe.texels_per_sigma(delta_e), budget.TEXELS_MAX)
    texel = narrowest / texels
    axes = tuple(texel_middles(*side, texel) for side in (needs.v, needs.u))
    precision = np.float16 if probe.halves_do(terms, delta_e) else np.float32
    return Plan((series,), lambdas, sigma_b, texel, axes, terms, needs.w, precision)


def carry_out(chosen: Plan, illuminant: str = "D65", progress: Progress = lambda stage, fraction: None) -> Bake:
    """As bake.carry_out."""
    nodes = chebyshev.nodes(chosen.terms, *chosen.w_range)
    at_nodes = xyz_over_w2(chosen, nodes, narrower(chosen.sigma_b, chosen.texel), illuminant, progress)
    terms = np.tensordot(chebyshev.coefficients_from_nodes(chosen.terms).astype(np.float32), at_nodes, axes=1)
    v, u = chosen.axes
    return Bake(
        terms, np.zeros((ZERO_ORDER_SAMPLES, 3)), chosen.sigma_b, chosen.texel, illuminant, first=(v[0], u[0]),
        w_range=chosen.w_range, precision=chosen.precision,
        wider=wider_levels(terms, (v, u), chosen.sigma_b, chosen.texel),
    )  # fmt: skip


def self_check(reliefs: Sequence[Relief], chosen: Plan, stored: Bake, progress: Progress) -> Errors:
    """The error of a bake as its file holds it against "reference-patch" (methods/exact.py), at a few w of direction
    pairs."""
    rng = np.random.default_rng(0)
    window = PatchWindow(reliefs[0], coherence.coherence_length(chosen.sigma_b) / 4)
    reference = Patch(window, Settings(illuminant=stored.illuminant))
    reach = max(float(np.abs(axis).max()) for axis in chosen.axes)
    # An order moves by 1.25 kernels a step: a Gaussian summed at that spacing is flat to 7e-6.
    lambdas = wavelengths(1.25 * chosen.sigma_b / reach * WAVELENGTH_MIN_M**2 / coherence.REFERENCE_WAVELENGTH_M)
    weights = spectral_weights(lambdas, stored.illuminant)
    found = []
    for k, w in enumerate(w_within(chosen.w_range, _CHECK_GROUPS, rng)):
        pairs = pairs_within(chosen, w, _CHECK_PAIRS, rng)
        xyz = np.zeros((len(pairs.wi), 3))
        for n, (lam, weight) in enumerate(zip(lambdas, weights, strict=True)):
            xyz += reference.density(pairs.u, pairs.v, w, lam)[:, None] * weight
            progress("self-check", (k + (n + 1) / len(lambdas)) / _CHECK_GROUPS)
        found.append(Truth(w, pairs, xyz, np.zeros(3)))
    return metric.measure(found, stored.candidate, stored.illuminant)

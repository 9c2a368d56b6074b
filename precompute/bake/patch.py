# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes under the patch model of coherence (thesis 3.2): one window on one patch of the surface.

The table is of the same kind as the ensemble model's. The window has a fixed size in metres (spectra/spectrum.py), so
its kernel in (u, v) grows with the wavelength. The zero order interferes with the other light, so there is no product
Z(w) kernel(u, v) to separate. Therefore Z is 0, and the table holds all of the light, divided by w^2. No polynomial
follows this quotient down to w = 0, so the table begins at w = W_MIN. Below W_MIN the materials show black. The table
has no sample set: it serves lamps only.

The power spectrum |P|^2 is computed on a grid of frequencies 1.5 times as fine as the window's speckle. Between the
grid's points it is read as by a non-uniform Fourier transform (A. Dutt and V. Rokhlin, Fast Fourier transforms for
nonequispaced data, 1993): the transform of |P|^2, which ends where the window's autocorrelation ends, is divided by the
transform of a Gaussian. Gaussians about the grid's points, with the quotient's values, then sum to |P|^2. The ensemble
model's Resampler makes such sums, so it serves here as well. As in the ensemble model, each Gaussian is narrowed by
what the cubic reading of the table adds.

sigma_s is the standard deviation of the window in metres, sigma_f = 1 / (2 pi sigma_s) that of its transform in cycles
per metre (docs/theory.md, section "Coherence")."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.failure import GratingError, Setting
from ..base.progress import Progress, silent
from ..colour.illuminants import has_bands
from ..colour.observer import WAVELENGTH_MIN_M, seen_wavelengths, spectral_weights, wavelengths
from ..maths import chebyshev
from ..measure.errors import Truth, measure
from ..optics import coherence
from ..optics.coherence import THESIS_COHERENCE_M
from ..reference.reference import PatchReference
from ..reflectance.matter import DIELECTRIC
from ..spectra.series import KERNEL_REACH, SpectrumSeries, bound
from ..spectra.spectrum import FrequencyGrid, PatchWindow, fft_order, phasor, window_at
from ..surface.relief import Relief
from ..table.table import ZERO_ORDER_SAMPLES, Table
from .ensemble import channels_over_w2
from .levels_and_basis import narrower
from .needs import WIDTH_MIN
from .plan import TEXELS_MAX, Plan, bake_wavelengths, probe, texel_middles
from .request import MODELS, BakeRequest
from .self_check import Judge, pairs_within, w_within

# The reach of the window from its centre, and of the transform of |P|^2 from lag 0, both in units of sigma_s. There the
# window has fallen to 3e-4, and its autocorrelation, exp(-x^2 / (4 sigma_s^2)) at the lag x, to 1e-7 of its peak.
_WINDOW_REACH, _LAG_REACH = 4.0, 8.0
# From this lag, in units of sigma_s, to _LAG_REACH, the transform of |P|^2 is faded to 0. It is at most 1e-4 of its
# peak there. The fade keeps its quotient by the Gaussian's transform small.
_LAG_KEPT = 6.0
# The Gaussian's standard deviation, in units of sigma_f. The transform of |P|^2 repeats after 2 _LAG_REACH, and the
# Gaussian's transform suppresses the repetitions. The repetition of lag -5, where the autocorrelation is 2e-3 of its
# peak, is at lag 11. Its weight is exp(-48 0.45^2) = 6e-5: reading a table leaves about 0.45 of the 0.5. Shorter lags
# weigh less.
_GAUSSIAN = 0.5
# Cubic reading widens the Gaussian, so the Gaussian is narrowed. This share of its variance always stays, however
# coarse the table. It leaves a standard deviation of 0.3 sigma_f, and a weight of 1e-2 at lag 11.
_GAUSSIAN_LEFT = 0.36
# Number of points of the frequency grid beyond the requested region: near the rim of the grid the quotient is wrong.
_MARGIN = 40
# Share of the power that the series in s may omit.
_SERIES_TOLERANCE = 1e-4
# Rows or columns that are transformed at once, to save memory.
_ROWS_AT_ONCE = 64


@dataclass(frozen=True, kw_only=True)
class PatchSeries(SpectrumSeries):
    """The patch model's power per bin, at Chebyshev nodes in s.

    `scattered_over_s2` holds all of the power, not divided by s^2, because it does not vanish with s. `amplitude` is 0.
    The light of a bin is a Gaussian of standard deviation `gaussian` in q. `sigma_b` is the standard deviation of the
    window's own kernel in (u, v) at the reference wavelength. A requested kernel is narrower than sigma_b: kernel_left
    subtracts the difference of the variances from each bin's Gaussian. The patch is under `window`."""

    window: PatchWindow
    gaussian: float
    sigma_b: float

    def weights(self, s: np.ndarray) -> np.ndarray:
        """Like SpectrumSeries.weights, divided by s^2, because scattered_over_s2 holds the power itself here."""
        return super().weights(s) / np.asarray(s)[..., None] ** 2

    def zero_order(self, s: np.ndarray) -> np.ndarray:
        """Zero: the zero order is not separated from the other light."""
        return np.zeros(np.shape(s))

    def kernel_left(self, sigma: float, wavelength_m: float) -> tuple[float, float]:
        """The standard deviation, twice, of the bins' Gaussian in (u, v) at a wavelength, for a kernel sigma up to
        sigma_b.

        The Gaussian's variance is smaller by sigma_b^2 - sigma^2, but at least the share _GAUSSIAN_LEFT."""
        whole = (wavelength_m * self.gaussian) ** 2
        left = math.sqrt(max(whole + sigma**2 - self.sigma_b**2, _GAUSSIAN_LEFT * whole))
        return left, left


def patch_series(window: PatchWindow, reach: float, progress: Progress = silent) -> PatchSeries:
    """Compute the series of a window's relief for |u|, |v| <= reach. `progress` is called after each transform."""
    s_max = 2 / WAVELENGTH_MIN_M
    gaussian = _GAUSSIAN * window.sigma_f
    q_max = reach / WAVELENGTH_MIN_M + KERNEL_REACH * gaussian
    axes = [_Axis(window, axis, q_max) for axis in (0, 1)]
    count = bound(window.relief, s_max, _SERIES_TOLERANCE)
    power = np.empty((count, *(len(axis.q) for axis in axes)), np.float32)
    for k, s in enumerate(chebyshev.nodes(count, 0, s_max)):
        power[k] = _power(window, axes, s)
        progress("transforms", (k + 1) / count)
    grid = FrequencyGrid(axes[0].q, axes[1].q, (axes[0].transform, axes[1].transform))
    sigma_b = coherence.kernel_sigma(4 * window.sigma_m)
    return PatchSeries(grid, s_max, power, np.zeros(count), window=window, gaussian=gaussian, sigma_b=sigma_b)


class _Axis:
    """The pixels under the window, the window, and the kept frequencies, along axis 0 (B) or 1 (T)."""

    def __init__(self, window: PatchWindow, axis: int, q_max: float):
        pixel, count = window.relief.pixel_size_m[axis], window.relief.height_m.shape[axis]
        half = math.ceil(_WINDOW_REACH * window.sigma_m / pixel)
        offset = np.arange(-half, half + 1)
        self.pixels = (offset + count // 2) % count
        self.window = (
            np.exp(-0.5 * (offset * pixel / window.sigma_m) ** 2) * window.relief.apodisation_axes[axis][self.pixels]
        )
        self.transform = math.ceil(2 * _LAG_REACH * window.sigma_m / pixel)
        self.spacing = 1 / (self.transform * pixel)
        last = min(math.ceil(q_max / self.spacing) + _MARGIN, (self.transform - 1) // 2)
        self.q = np.arange(-last, last + 1) * self.spacing
        lag = np.abs(np.fft.fftfreq(len(self.q), self.spacing)) / window.sigma_m
        fall = np.clip((lag - _LAG_KEPT) / (_LAG_REACH - _LAG_KEPT), 0, 1)
        self.undo = np.exp(0.5 * (_GAUSSIAN * np.minimum(lag, _LAG_REACH)) ** 2) * (0.5 + 0.5 * np.cos(np.pi * fall))


def _power(window: PatchWindow, axes: Sequence[_Axis], s: float) -> np.ndarray:
    """PSD per bin (ny, nx) at s, after its transform was divided by the Gaussian's."""
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


# The start of the table's range of w, unless the needs begin later. Measured on a skin of 150 nm, over the whole of (u,
# v) and for a dE00 of at most 0.5: a range from w = 0.25 takes 13 terms, from 0.5 11, from 0.75 8, and from 1 6. A
# range from 0.1 has a dE00 of 42 with 13 terms.
W_MIN = 0.25
# Number of values of w for the self-check, and of direction pairs at each. Both are small, because the reference sums
# over all pixels for each pair.
_CHECK_GROUPS, _CHECK_PAIRS = 3, 200


def plan(
    reliefs: Sequence[Relief],
    request: BakeRequest,
    *,
    progress: Progress = silent,
) -> Plan:
    """Like ensemble.plan, under one window of the request's coherence length (THESIS_COHERENCE_M by default).

    The kernel is never widened to make the table fit. Raises GratingError for several reliefs, since the model is of
    one patch, for a matter other than a dielectric, for a spread of directions, for needs that end below W_MIN, and as
    window_at does."""
    if len(reliefs) != 1:
        remedy = ("give one, or take ", Setting.MODEL, " ensemble")
        raise GratingError(f"{len(reliefs)} scans", "the patch model takes one", remedy)
    if request.matter.baked:
        raise GratingError(
            "", "the patch model takes only a dielectric",
            ("choose ", Setting.MODEL, f" {MODELS[0]}, or ", Setting.MATTER, f" {DIELECTRIC}"),
        )  # fmt: skip
    if request.spread_deg is not None:
        other = ("choose ", Setting.MODEL, f" {MODELS[0]}, or leave ", Setting.SPREAD_DEG, " out")
        raise GratingError("", "the patch model has only one direction", other)
    needs, delta_e = request.needs, request.delta_e
    needs = replace(needs, w=(max(needs.w[0], W_MIN), needs.w[1]))
    if needs.w[1] - needs.w[0] < WIDTH_MIN:
        raise GratingError(
            f"w up to {needs.w[1]:g}", f"the patch model begins at {W_MIN:g}", "give a larger w in the needs"
        )
    window = window_at(reliefs[0], (request.coherence_length_m or THESIS_COHERENCE_M) / 4, request.patch_um)
    series = patch_series(window, needs.region.reach, progress)
    sigma_b = series.sigma_b
    # The kernel is narrowest at the shortest wavelength, so texels that are fine enough there are always fine enough.
    narrowest = sigma_b * WAVELENGTH_MIN_M / coherence.REFERENCE_WAVELENGTH_M
    lambdas = bake_wavelengths(narrowest, delta_e, needs.region.reach, illuminant=request.illuminant)
    lambdas = seen_wavelengths(lambdas, request.illuminant)
    measured = probe((series,), sigma_b, lambdas, request=request)
    terms = measured.terms(delta_e)
    texels = min(measured.texels_per_sigma(delta_e), TEXELS_MAX)
    texel = narrowest / texels
    v, u = (texel_middles(*side, texel) for side in (needs.region.v, needs.region.u))
    precision = np.float16 if measured.halves_do(terms, delta_e) else np.float32
    return Plan((series,), lambdas, sigma_b, texel, (v, u), terms, needs.w, precision)


def carry_out(chosen: Plan, illuminant: str = "D65", progress: Progress = silent) -> Table:
    """Like ensemble.carry_out, without a zero order."""
    nodes = chebyshev.nodes(chosen.terms, *chosen.w_range)
    at_nodes = channels_over_w2(
        chosen, nodes, narrower(chosen.sigma_b, chosen.texel), illuminant=illuminant, progress=progress
    )
    terms = np.tensordot(chebyshev.coefficients_from_nodes(chosen.terms).astype(np.float32), at_nodes, axes=1)
    v, u = chosen.axes
    return Table(
        terms, np.zeros((ZERO_ORDER_SAMPLES, terms.shape[-1])), chosen.sigma_b, chosen.texel, illuminant,
        first=(v[0], u[0]), w_range=chosen.w_range, precision=chosen.precision,
    )  # fmt: skip


def judge(reliefs: Sequence[Relief], chosen: Plan, illuminant: str, *, progress: Progress) -> Judge:
    """What a plan's table is judged by: the patch model's reference, on direction pairs at a few values of w."""
    rng = np.random.default_rng(0)
    (series,) = chosen.ensemble
    assert isinstance(series, PatchSeries)
    reference = PatchReference(series.window)
    reach = max(float(np.abs(axis).max()) for axis in chosen.axes)
    # From one wavelength to the next an order moves by 1.25 standard deviations of the kernel: a sum of Gaussians at
    # this spacing is flat to 7e-6. Bands of an illuminant need a spacing of a fifth (self_check.py).
    share = 0.2 if has_bands(illuminant) else 1.25
    step_m = share * chosen.sigma_b / reach * WAVELENGTH_MIN_M**2 / coherence.REFERENCE_WAVELENGTH_M
    lambdas = seen_wavelengths(wavelengths(step_m), illuminant)
    weights = spectral_weights(lambdas, illuminant)
    found = []
    for k, w in enumerate(w_within(chosen.w_range, _CHECK_GROUPS, rng)):
        pairs = pairs_within(chosen, w, _CHECK_PAIRS, rng=rng, illuminant=illuminant)
        xyz = np.zeros((len(pairs.wi), 3))
        for n, (lam, weight) in enumerate(zip(lambdas, weights, strict=True)):
            xyz += reference.density(pairs.u, pairs.v, w, wavelength_m=lam)[:, None] * weight
            progress("self-check", (k + (n + 1) / len(lambdas)) / _CHECK_GROUPS)
        found.append(Truth(w, pairs, xyz, np.zeros(3)))
    return Judge(lambda table: measure(found, table.candidate, illuminant))


def sample_set(chosen: Plan) -> None:
    """None: the zero order cannot be separated from the spectrum, so no samples can be drawn."""

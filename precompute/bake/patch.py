# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes under the patch model of coherence (thesis 3.2): one window on one patch of the surface.

The table is of the same kind as the ensemble model's. The window has a fixed size in metres (spectra/patch_window.py),
so its kernel in (u, v) grows with the wavelength. The zero order interferes with the other light, so there is no
product Z(w) kernel(u, v) to separate. Therefore Z is 0, and the table holds all of the light, divided by w^2. No
polynomial follows this quotient down to w = 0, so the table begins at w = W_MIN. Below W_MIN the materials show black.
The table has no sample set: it serves lamps only.

The power spectrum |P|^2 is computed on a grid of frequencies 1.5 times as fine as the window's speckle. Between the
grid's points it is read as by a non-uniform Fourier transform (A. Dutt and V. Rokhlin, Fast Fourier transforms for
nonequispaced data, 1993): the transform of |P|^2, which ends where the window's autocorrelation ends, is divided by the
transform of a Gaussian. Gaussians about the grid's points, with the quotient's values, then sum to |P|^2. The ensemble
model's Resampler makes such sums, so it serves here as well. As in the ensemble model, each Gaussian is narrowed by
what the cubic reading of the table adds.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..base.failure import GratingError, Setting
from ..base.progress import Progress, silent
from ..colour.illuminants import has_bands
from ..colour.observer import WAVELENGTH_MIN_M, seen_wavelengths, spectral_weights, wavelengths
from ..maths import chebyshev
from ..measure.errors import Truth, measure
from ..optics import coherence
from ..optics.coherence import THESIS_COHERENCE_M
from ..reference.patch_reference import PatchReference
from ..reflectance.matter import DIELECTRIC
from ..spectra.patch_window import window_at
from ..surface.relief import Relief
from ..table.table import ZERO_ORDER_SAMPLES, Table
from .blur_levels import narrower
from .needs import WIDTH_MIN
from .patch_series import PatchSeries, patch_series
from .plan import Plan
from .request import MODELS, BakeRequest
from .resolution import texel_middles
from .self_check import Judge, pairs_within, w_within
from .terms_and_texels import TEXELS_MAX, probe
from .tiles import channels_over_w2
from .wavelengths import bake_wavelengths

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
        raise GratingError(f"{len(reliefs)} scans", "the patch model is of one", remedy)
    if request.matter.baked:
        raise GratingError(
            "", "the patch model is of a dielectric",
            ("choose ", Setting.MODEL, f" {MODELS[0]}, or ", Setting.MATTER, f" {DIELECTRIC}"),
        )  # fmt: skip
    if request.spread_deg is not None:
        other = ("choose ", Setting.MODEL, f" {MODELS[0]}, or leave ", Setting.SPREAD_DEG, " out")
        raise GratingError("", "one patch lies in one direction", other)
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
    """Like tiles.carry_out, without a zero order."""
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

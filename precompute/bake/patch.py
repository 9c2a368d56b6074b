# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake of the patch model (thesis 3.2), in the same table as the ensemble's: plan, carry out, self-check.

The model's window is fixed in metres (spectra/patch_window.py), so its kernel in (u, v) grows with the wavelength and
the zero order interferes with the rest: there is no Z(w) kernel(u, v) to take out. So Z is 0, and the table holds all
of the light over w^2, which no polynomial follows down to w = 0: it begins at W_MIN, under which the rim stands for
what the table lacks. The table has no albedo bound, and no sample set beside it: it is for lamps alone.

|P|^2 is made on a grid of frequencies half again as fine as the window's speckle and read between its points as a
non-uniform Fourier transform does (A. Dutt and V. Rokhlin, 1993): its transform, which ends with the window's
autocorrelation, is divided by a Gaussian's, so that a sum over Gaussians about the points is |P|^2 itself. Hence the
bake's Resampler does for both models, and leaves out of each Gaussian what cubic reading adds.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..base.failure import GratingError
from ..base.progress import Progress, silent
from ..colour.observer import WAVELENGTH_MIN_M, spectral_weights, wavelengths
from ..maths import chebyshev
from ..measure.errors import Errors, Truth, measure
from ..optics import coherence
from ..optics.coherence import THESIS_COHERENCE_M
from ..reference.patch import PatchReference
from ..spectra.patch_window import PatchWindow
from ..surface.relief import Relief
from ..table.table import ZERO_ORDER_SAMPLES, Table
from .patch_series import patch_series
from .plan import Plan
from .probe import TEXELS_MAX, probe
from .request import BakeRequest
from .resolution import bake_wavelengths, texel_middles
from .self_check import pairs_within, w_within
from .tiles import narrower, wider_levels, xyz_over_w2

# The table's range of w begins here unless the needs begin later. A skin of 150 nm, the whole of (u, v), takes 13 terms
# from 0.25, 11 from 0.5, 8 from 0.75, 6 from 1, each for a dE00 of at most 0.5; 13 from 0.1 are off by 42.
W_MIN = 0.25


_CHECK_GROUPS, _CHECK_PAIRS = 3, 200


def plan(
    reliefs: Sequence[Relief],
    request: BakeRequest,
    *,
    progress: Progress = silent,
    finer: float = 1.0,
) -> Plan:
    """As ensemble.plan, under one window of the request's coherence length (None: the thesis's); no kernel is widened
    to fit.

    Raises GratingError for several reliefs: the model is of one patch."""
    if len(reliefs) != 1:
        raise GratingError(f"{len(reliefs)} scans: the patch model is of one; give one, or take --model ensemble")
    needs, delta_e = request.needs, request.delta_e
    needs = replace(needs, w=(max(needs.w[0], W_MIN), needs.w[1]))
    window = PatchWindow(reliefs[0], (request.coherence_length_m or THESIS_COHERENCE_M) / 4)
    series = patch_series(window, needs.region.reach, progress)
    sigma_b = series.sigma_b
    # The kernel is narrowest in the blue: its wavelengths and texels do for all.
    narrowest = sigma_b * WAVELENGTH_MIN_M / coherence.REFERENCE_WAVELENGTH_M
    lambdas = bake_wavelengths(narrowest, delta_e, needs.region.reach)
    measured = probe((series,), sigma_b, lambdas, request.illuminant, needs)
    terms = measured.terms(delta_e)
    texels = min(finer * measured.texels_per_sigma(delta_e), TEXELS_MAX)
    texel = narrowest / texels
    axes = tuple(texel_middles(*side, texel) for side in (needs.region.v, needs.region.u))
    precision = np.float16 if measured.halves_do(terms, delta_e) else np.float32
    return Plan((series,), lambdas, sigma_b, texel, axes, terms, needs.w, precision)


def carry_out(chosen: Plan, illuminant: str = "D65", progress: Progress = silent) -> Table:
    """As tiles.carry_out."""
    nodes = chebyshev.nodes(chosen.terms, *chosen.w_range)
    at_nodes = xyz_over_w2(chosen, nodes, narrower(chosen.sigma_b, chosen.texel), illuminant, progress)
    terms = np.tensordot(chebyshev.coefficients_from_nodes(chosen.terms).astype(np.float32), at_nodes, axes=1)
    v, u = chosen.axes
    return Table(
        terms, np.zeros((ZERO_ORDER_SAMPLES, 3)), chosen.sigma_b, chosen.texel, illuminant, first=(v[0], u[0]),
        w_range=chosen.w_range, precision=chosen.precision,
        wider=wider_levels(terms, (v, u), chosen.sigma_b, chosen.texel),
    )  # fmt: skip


def self_check(reliefs: Sequence[Relief], chosen: Plan, stored: Table, progress: Progress) -> Errors:
    """The error of a bake as its file holds it against the patch model's reference, at a few w of direction
    pairs."""
    rng = np.random.default_rng(0)
    window = PatchWindow(reliefs[0], coherence.coherence_length(chosen.sigma_b) / 4)
    reference = PatchReference(window)
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
    return measure(found, stored.candidate, stored.illuminant)


def sample_set(chosen: Plan) -> None:
    """None: the model's spectrum cannot be told apart from its zero order, and is not drawn from."""

# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake under the ensemble model of coherence: kernel, wavelengths, texels and terms, chosen for a colour error on
this very surface."""

import math
from collections.abc import Sequence

import numpy as np

from ..base.progress import Progress
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M
from ..spectra.fast import fast_series
from ..spectra.resample import KERNEL_REACH
from ..spectra.series import SpectrumSeries
from ..surface.relief import Relief
from ..table.table import Table
from ..table.tiling import BYTES_PER_TEXEL
from .kernel import kernel_for, too_fine
from .needs import EVERYTHING, Needs
from .plan import Plan
from .probe import TEXELS_MAX, TEXELS_MIN, probe
from .resolution import (
    DEFAULT_BYTES,
    RESOLUTION_MAX,
    RESOLUTION_MIN,
    bake_wavelengths,
    blender_bytes,
    resolution_for,
    texel_middles,
    texel_size,
)
from .tiles import carry_out

# Bins this far past |u| = 2 are kept, so that the kernel may still be widened.
_REACH_MIN = 0.15


# Of the light, for a dE00 of 1: a bin may be off by more where it is dark, 2e-4 is a hundredth of what shows.
_SERIES_TOLERANCE = 2e-4


def plan(
    reliefs: Relief | Sequence[Relief],
    coherence_length_m: float | None = None,
    delta_e: float = 1.0,
    illuminant: str = "D65",
    needs: Needs = EVERYTHING,
    progress: Progress = lambda stage, fraction: None,
    finer: float = 1.0,
) -> Plan:
    """Choose kernel, texels and terms for reliefs, a coherence length in metres (None: auto) and a dE00.

    An automatic kernel is widened until the table fits DEFAULT_BYTES. Texels are `finer` times as many as measured.
    Raises GratingError if an asked length needs a finer table than there is."""
    reliefs = (reliefs,) if isinstance(reliefs, Relief) else tuple(reliefs)
    auto = coherence_length_m is None
    sigma_b = kernel_for(reliefs, coherence_length_m, delta_e, needs)
    if auto:  # what no table of that size holds anyway need not be resolved
        sigma_b = max(sigma_b, TEXELS_MIN * texel_size(int(math.sqrt(DEFAULT_BYTES / BYTES_PER_TEXEL / 4))))
    ensemble = _spectra(reliefs, sigma_b, delta_e, needs, progress)
    lambdas = bake_wavelengths(sigma_b, delta_e, needs.reach)
    measured = probe(ensemble, sigma_b, lambdas[::2], illuminant, needs)
    terms = measured.terms(delta_e)
    texels = min(finer * measured.texels_per_sigma(delta_e), TEXELS_MAX)
    resolution = resolution_for(sigma_b, texels)
    finest = min(RESOLUTION_MAX, int(math.sqrt(DEFAULT_BYTES / (BYTES_PER_TEXEL * terms))) // 2 * 2)
    while (
        blender_bytes(terms, (finest, finest), texels * texel_size(finest)) > DEFAULT_BYTES and finest > RESOLUTION_MIN
    ):
        finest -= 2
    if not auto and resolution > RESOLUTION_MAX:
        raise too_fine(coherence_length_m, delta_e)
    if auto and resolution > finest:
        resolution, sigma_b = finest, texels * texel_size(finest)
        lambdas = bake_wavelengths(sigma_b, delta_e, needs.reach)
    texel = texel_size(resolution)
    axes = tuple(texel_middles(*side, texel) for side in (needs.v, needs.u))
    precision = np.float16 if measured.halves_do(terms, delta_e) else np.float32
    return Plan(ensemble, lambdas, sigma_b, texel, axes, terms, needs.w, precision)


def _spectra(reliefs, sigma_b, delta_e, needs, progress) -> tuple[SpectrumSeries, ...]:
    reach = max(KERNEL_REACH * sigma_b, _REACH_MIN)
    found = []
    for k, relief in enumerate(reliefs):

        def tick(done, total, k=k):
            progress("transforms", (k + done / total) / len(reliefs))

        found.append(
            fast_series(
                relief, (needs.reach + reach) / WAVELENGTH_MIN_M, needs.w[1] / WAVELENGTH_MIN_M,
                sigma_b / WAVELENGTH_MAX_M, _SERIES_TOLERANCE * delta_e, tick,
            )
        )  # fmt: skip
    return tuple(found)


def bake(
    reliefs: Relief | Sequence[Relief],
    coherence_length_m: float | None = None,
    delta_e: float = 1.0,
    illuminant: str = "D65",
    needs: Needs = EVERYTHING,
    progress: Progress = lambda stage, fraction: None,
) -> Table:
    """Bake reliefs for a dE00 of delta_e; see plan for the arguments and the errors raised."""
    return carry_out(plan(reliefs, coherence_length_m, delta_e, illuminant, needs, progress), illuminant, progress)

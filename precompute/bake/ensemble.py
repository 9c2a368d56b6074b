# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes under the ensemble model of coherence: the mean over all places of the coherence window.

Kernel, wavelengths, texels and terms are chosen so that the given surface keeps the requested colour error.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..base.failure import GratingError, Setting
from ..base.progress import Progress, part_of, silent, span_of
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M
from ..optics.region import FARTHEST, W_MAX
from ..spectra.fast import fast_series
from ..spectra.resample import KERNEL_REACH
from ..spectra.series import SpectrumSeries
from ..surface.relief import Relief
from ..table.sample_set import SampleSet
from ..table.table import Table
from ..table.tiling import BYTES_PER_TEXEL
from .blur_levels import with_levels
from .expected import tell
from .kernel import kernel_for, too_fine
from .largest_albedo import largest_albedo
from .plan import Plan
from .request import MODELS, BakeRequest
from .resolution import (
    DEFAULT_BYTES,
    RESOLUTION_MAX,
    RESOLUTION_MIN,
    blender_bytes,
    resolution_for,
    texel_middles,
    texel_size,
)
from .sample_draws import make_sample_set
from .self_check import judge as judge
from .terms_and_texels import TEXELS_MAX, TEXELS_MIN, probe
from .tiles import carry_out as carry_out
from .wavelengths import wavelengths_of

# The request with every value at its default.
ANY = BakeRequest()
# Bins are kept at least this far past |u| = 2, so that the kernel may still be widened.
_REACH_MIN = 0.15
# The allowed error of the series as a share of all light, for a dE00 of 1. In a dark bin it may be a larger share of
# the bin's light. The eye sees errors a hundred times as large.
_SERIES_TOLERANCE = 2e-4
# The share of the transforms in the time of making spectra whose directions are spread, on the scan of Elaphe.
_TRANSFORMED = 0.15


def plan(
    reliefs: Relief | Sequence[Relief],
    request: BakeRequest = ANY,
    *,
    progress: Progress = silent,
    finer: float = 1.0,
) -> Plan:
    """Choose kernel, texels and terms for reliefs and a request.

    If the request leaves the coherence length open, the kernel is widened until the table fits DEFAULT_BYTES. The table
    has `finer` times as many texels as the probe finds necessary. `progress` is called after each transform.

    Raises GratingError if the requested coherence length needs a finer table than RESOLUTION_MAX allows, for a request
    with a patch, and for a spread of the directions of a surface that wraps or of a profile."""
    if request.patch_um is not None:
        remedy = ("choose ", Setting.MODEL, f" {MODELS[1]}, or leave ", Setting.PATCH_UM, " out")
        raise GratingError("", "the ensemble model is the mean over all places of its window", remedy)
    reliefs = (reliefs,) if isinstance(reliefs, Relief) else tuple(reliefs)
    if request.spread_deg is not None and any(relief.periodic or 1 in relief.height_m.shape for relief in reliefs):
        fault = "only a scan of an area whose edges do not wrap has directions to spread"
        raise GratingError("", fault, ("leave ", Setting.SPREAD_DEG, " out"))
    delta_e, needs = request.delta_e, request.needs
    asked_m, plate_ior = request.coherence_length_m, request.matter.plate_ior
    sigma_b = kernel_for(reliefs, request)
    if asked_m is None:  # a kernel too narrow for a table of DEFAULT_BYTES need not be resolved
        sigma_b = max(sigma_b, TEXELS_MIN * texel_size(int(math.sqrt(DEFAULT_BYTES / BYTES_PER_TEXEL / 4))))
    if request.matter.has_plate:  # from here on everything is that of the directions inside the plate
        sigma_b, needs = sigma_b / plate_ior, needs.inside_plate(plate_ior)
        request = replace(request, needs=needs)
        reliefs = tuple(relief.scaled(plate_ior) for relief in reliefs)
    ensemble = _spectra(reliefs, sigma_b, request, progress)
    lambdas = wavelengths_of(sigma_b, request)
    measured = probe(ensemble, sigma_b, lambdas[::2], request=request)
    terms = measured.terms(delta_e)
    texels = min(finer * measured.texels_per_sigma(delta_e), TEXELS_MAX)
    resolution = resolution_for(sigma_b, texels)
    if asked_m is None:
        finest = int(_finest(terms, texels, math.ceil(resolution / plate_ior)) * plate_ior) // 2 * 2
        if resolution > finest:
            resolution, sigma_b = finest, texels * texel_size(finest)
            lambdas = wavelengths_of(sigma_b, request)
    elif resolution > int(RESOLUTION_MAX * plate_ior) // 2 * 2:  # a tile spans 4 / plate_ior
        raise too_fine(asked_m, delta_e)
    texel = texel_size(resolution)
    v, u = (texel_middles(*side, texel) for side in (needs.region.v, needs.region.u))
    precision = np.float16 if measured.halves_do(terms, delta_e) else np.float32
    matter = request.matter
    # A plate's gains send out as much as arrives (trapped_light.py).
    divided = matter.baked and not matter.has_plate
    albedo = largest_albedo(ensemble, matter, request.illuminant) if divided else 1.0
    return Plan(ensemble, lambdas, sigma_b, texel, (v, u), terms, needs.w, precision, matter, albedo)


def _finest(terms: int, texels: float, wanted: int) -> int:
    """The even number of texels a side, at least `wanted` if possible, of a whole table that fits DEFAULT_BYTES."""

    def fits(count: int) -> bool:
        return blender_bytes(terms, (count, count), texels * texel_size(count)) <= DEFAULT_BYTES

    finest = min(RESOLUTION_MAX, int(math.sqrt(DEFAULT_BYTES / (BYTES_PER_TEXEL * terms))) // 2 * 2)
    wanted += wanted % 2
    if wanted <= finest and fits(wanted):
        return wanted
    while finest > RESOLUTION_MIN and not fits(finest):
        finest -= 2
    return finest


def _spectra(
    reliefs: Sequence[Relief], sigma_b: float, request: BakeRequest, progress: Progress
) -> tuple[SpectrumSeries, ...]:
    """The series of each relief, for the requested region and for kernels of sigma_b and wider."""
    needs = request.needs
    # The largest albedo is that of the light in all directions, whatever the scene needs.
    farthest, greatest_w = (FARTHEST, W_MAX) if request.matter.baked else (needs.region.reach, needs.w[1])
    if request.spread_deg is not None:
        farthest = min(math.sqrt(2) * farthest, FARTHEST)  # the rings through the region's corners
    reach = farthest + max(KERNEL_REACH * sigma_b, _REACH_MIN)
    wavelengths = len(wavelengths_of(sigma_b, request))
    transformed = 1.0 if request.spread_deg is None else _TRANSFORMED
    transforming = span_of(progress, 0, transformed)
    found = []
    for k, relief in enumerate(reliefs):
        found.append(
            fast_series(
                relief, reach / WAVELENGTH_MIN_M, greatest_w / WAVELENGTH_MIN_M,
                finest_kernel=sigma_b / WAVELENGTH_MAX_M, tolerance=_SERIES_TOLERANCE * request.delta_e,
                progress=part_of(transforming, "transforms", done=k, total=len(reliefs)),
                before=partial(
                    tell, wavelengths=wavelengths, scans=len(reliefs) - k, progress=silent if k else progress
                ),
            )
        )  # fmt: skip
    if request.spread_deg is None:
        return tuple(found)
    spreading = span_of(progress, transformed, 1)
    return tuple(
        series.over_turns(math.radians(request.spread_deg), part_of(spreading, "directions", done=k, total=len(found)))
        for k, series in enumerate(found)
    )


def bake(
    reliefs: Relief | Sequence[Relief],
    request: BakeRequest = ANY,
    *,
    progress: Progress = silent,
) -> Table:
    """Bake the table of a request, without measuring its error. Raises GratingError as `plan` does."""
    return with_levels(carry_out(plan(reliefs, request, progress=progress), request.illuminant, progress))


def sample_set(chosen: Plan) -> SampleSet:
    """The sample set that belongs to the table, over the largest albedo too."""
    drawn = make_sample_set(chosen.ensemble, chosen.sigma_b)
    return replace(drawn, pieces=drawn.pieces / np.float32(chosen.largest_albedo))

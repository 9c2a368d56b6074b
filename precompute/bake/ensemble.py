# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes under the ensemble model of coherence: the mean over all places of the coherence window.

`plan` chooses kernel, wavelengths, texels and terms so that the given surface keeps the requested colour error. Then
the tiles of the plan's table are made. For each wavelength, the spectrum at each node of w is blurred by the kernel and
resampled onto (u, v). The kernel is a product of factors along u and v with a fixed size in (u, v), so this takes two
products with banded matrices. Between wavelengths only the bins' places in (u, v) change. The results are weighted by
the observer and summed over the wavelengths. A cosine transform over the nodes of w then gives the terms B_k. Several
scans of one skin are averaged, which is exact because every step is linear in the spectrum."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..base.failure import GratingError, Setting
from ..base.progress import Progress, part_of, silent, span_of
from ..colour.channels import channel_weights
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, seen_wavelengths
from ..maths import chebyshev
from ..optics.region import FARTHEST, W_MAX
from ..reflectance.matter import reflectance_at
from ..spectra.series import KERNEL_REACH, Resampler, SpectrumSeries, fast_series
from ..surface.relief import Relief
from ..table.blur_levels import BYTES_PER_TEXEL
from ..table.sample_set import SampleSet
from ..table.table import ZERO_ORDER_SAMPLES, Table
from .largest_albedo import largest_albedo
from .levels_and_basis import narrower, with_levels
from .plan import (
    DEFAULT_BYTES,
    RESOLUTION_MAX,
    RESOLUTION_MIN,
    TEXELS_MAX,
    TEXELS_MIN,
    Plan,
    blender_bytes,
    kernel_for,
    probe,
    resolution_for,
    tell,
    texel_middles,
    texel_size,
    too_fine,
    wavelengths_of,
)
from .request import MODELS, BakeRequest
from .sample_draws import make_sample_set
from .self_check import judge as judge
from .trapped_light import plate_gains

# Number of texels past |(u, v)| = 2 that are kept. A reading at |(u, v)| = 2 uses texels less than two texels away
# along each axis, so less than 2.9 texels away in all.
_RIM = 3
# Number of wavelengths, and of rows of the table, that are summed at once, to fit into a core's cache.
_WAVELENGTHS_AT_ONCE, _ROWS_AT_ONCE = 8, 16
# Number of bins that are mixed at once, over several nodes: 32 MiB of floats.
_BINS_AT_ONCE = 1 << 23


def carry_out(chosen: Plan, illuminant: str = "D65", progress: Progress = silent) -> Table:
    """Make the table of a plan, without wider blur levels. `progress` is called with the share of the table."""
    sigma_table = narrower(chosen.sigma_b, chosen.texel)
    nodes = chebyshev.nodes(chosen.terms, *chosen.w_range)
    at_nodes = channels_over_w2(chosen, nodes, sigma_table, illuminant=illuminant, progress=progress)
    to_terms = chebyshev.coefficients_from_nodes(chosen.terms).astype(np.float32)
    terms = np.tensordot(to_terms, at_nodes, axes=1)
    v, u = chosen.axes
    terms[:, v[:, None] ** 2 + u**2 > (2 + _RIM * chosen.texel) ** 2] = 0
    zero_order = zero_order_curve(chosen, illuminant)
    gains = None
    if chosen.matter.has_plate:
        gains = plate_gains(chosen.ensemble, chosen.sigma_b, matter=chosen.matter, illuminant=illuminant)
    return Table(
        terms, zero_order, chosen.sigma_b, chosen.texel, illuminant, chosen.matter.ratio_ior, (v[0], u[0]),
        chosen.w_range, chosen.precision, plate_ior=chosen.matter.plate_ior, largest_albedo=chosen.largest_albedo,
        gains=gains,
    )  # fmt: skip


def zero_order_curve(chosen: Plan, illuminant: str) -> np.ndarray:
    """The channels of Z (n, channels), at equal steps of w from 0 to 2, times the reflectance of a matter that the
    table holds, over the largest albedo."""
    lambdas = seen_wavelengths(np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, 401), illuminant)
    w = np.linspace(0, 2, ZERO_ORDER_SAMPLES)
    efficiency = sum(series.zero_order(w[:, None] / lambdas) for series in chosen.ensemble) / len(chosen.ensemble)
    if chosen.holds_reflectance:
        efficiency = efficiency * chosen.matter.reflectance(lambdas, w / 2).T
    return efficiency @ channel_weights(lambdas, illuminant) / chosen.largest_albedo


def channels_over_w2(
    chosen: Plan, w_nodes: np.ndarray, sigma: float, *, illuminant: str, progress: Progress = silent
) -> np.ndarray:
    """Channels over w^2 (K, rows, columns, channels) float32 of the scattered light, at nodes of w (K,) and the plan's
    texels.

    `sigma` is the standard deviation of the sampled kernel. `progress` is called after each group of wavelengths."""
    v, u = chosen.axes
    lambdas = chosen.wavelengths
    over = len(chosen.ensemble) * chosen.largest_albedo
    weights = (channel_weights(lambdas, illuminant) / over).astype(np.float32)
    out = np.zeros((len(w_nodes), len(v), weights.shape[1], len(u)), np.float32)
    radius = 2 + _RIM * chosen.texel
    reflectance = reflectance_at(chosen.matter, lambdas, (u, v[:, None], w_nodes[:, None, None]))
    images = np.zeros((len(w_nodes), len(v), _WAVELENGTHS_AT_ONCE, len(u)), np.float32)
    done = 0
    for series in chosen.ensemble:
        for start in range(0, len(lambdas), _WAVELENGTHS_AT_ONCE):
            group = slice(start, min(start + _WAVELENGTHS_AT_ONCE, len(lambdas)))
            for g, lam in enumerate(lambdas[group]):
                resample = Resampler(series.grid, u, v, lam, series.kernel_left(sigma, lam), radius)
                mix = series.weights(w_nodes / lam) / lam**2
                bins = math.prod(kept.stop - kept.start for kept in resample.kept)
                at_once = max(1, _BINS_AT_ONCE // max(bins, 1))
                for first in range(0, len(mix), at_once):
                    spectra = series.mixed(mix[first : first + at_once], resample.kept)
                    for k in range(spectra.shape[1]):
                        resample(spectra[:, k], out=images[first + k, :, g])
                if chosen.holds_reflectance:
                    images[:, :, g] *= reflectance(start + g)
            count = group.stop - group.start
            for tile, image in zip(out, images, strict=True):
                for row in range(0, len(v), _ROWS_AT_ONCE):
                    rows = slice(row, row + _ROWS_AT_ONCE)
                    tile[rows] += weights[group].T @ image[rows, :count]
            done += count
            progress("wavelengths", done / (len(lambdas) * len(chosen.ensemble)))
    return np.moveaxis(out, 2, -1)


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
) -> Plan:
    """Choose kernel, texels and terms for reliefs and a request.

    If the request leaves the coherence length open, the kernel is widened until the table fits DEFAULT_BYTES.
    `progress` is called after each transform.

    Raises GratingError if the requested coherence length needs a finer table than RESOLUTION_MAX allows, for a request
    with a patch, and for a spread of the directions of a surface that wraps or of a profile."""
    if request.patch_um is not None:
        remedy = ("choose ", Setting.MODEL, f" {MODELS[1]}, or leave ", Setting.PATCH_UM, " out")
        raise GratingError("", "the ensemble model averages over all places of the scan", remedy)
    reliefs = (reliefs,) if isinstance(reliefs, Relief) else tuple(reliefs)
    if request.spread_deg is not None and any(relief.periodic or 1 in relief.height_m.shape for relief in reliefs):
        fault = "a surface whose edges wrap, or a profile, has only one direction"
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
    texels = min(measured.texels_per_sigma(delta_e), TEXELS_MAX)
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

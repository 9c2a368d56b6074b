# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the error of a table's wider blur levels, and of kernels between two levels.

The self-check (self_check.py) sums the bins of the spectra, which would take too long under wide kernels. So the wider
kernels are compared with the table of the first level, as it was before its functions of w were learnt and rounded. Its
texels are samples of the light under a known Gaussian. Their sum under one more Gaussian is the light under the wider
kernel. What this table itself is wrong by is in the errors of the first level, and is added by squares.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..maths import bspline
from ..maths.banded import banded_sums
from ..maths.gaussian_sums import gaussian_sums
from ..measure.errors import Errors, Truth, measure
from ..measure.pairs import Pairs, cosine_weighted, pair_and_kept
from ..optics.plate import least_cosine
from ..optics.region import FARTHEST
from ..table.table import Table
from .basis import lit_places
from .blur_levels import sky_share

# The number of values of w, and of direction pairs at each, under each kernel.
_GROUPS, _PAIRS = 8, 80
# The Gaussian is cut at this many standard deviations, where it is 3e-7 of its peak.
_CUT = 5.5
# The standard deviation, in samples, of the Gaussian that an octave's samples are under, and the least variance, in
# squared samples, of the Gaussian that is left to a sum over them. At the highest frequency of the samples these leave
# 8e-3 and 0.03 of the light, so the sum is off by about 1e-3. With the first level's own texels the dE00's p99 is 0.07.
_RESOLVED, _LEFT = 1.4, 0.7
# Octaves have at least this many samples a side. An octave loses the light that its Gaussian moves beyond the lattice,
# so the Gaussian must be narrow against the lattice. With 16, 64 and 128, the dE00's p99 at level 17 of the scan of
# Xenopeltis is 2.6, 1.3 and 0.9.
_SIDE_MIN = 128
# Where a table ends within the sky, the light beyond is unknown. Pairs keep this many standard deviations away from it.
_FROM_RIM = 3.0


@dataclass(frozen=True)
class Wide:
    """The errors under one kernel that is wider than the first level's.

    level   its place between the blur levels: 1 is the second level, 0.5 the middle of the first two
    errors  the errors of colour and light there"""

    level: float
    errors: Errors


def wide_errors(stored: Table, exact: Table, first: Errors, *, illuminant: str) -> tuple[Wide, ...]:
    """The errors of a stored table with levels at every wider level, and halfway between two, by variance's logarithm.

    `exact` is the table of the first level that it was made from, and `first` its own errors."""
    levels = [half / 2 for half in range(1, 2 * len(stored.levels) - 1)]
    rng = np.random.default_rng(2)
    at_w = [list(_truths(stored, exact, w, levels, rng)) for w in _values_of_w(exact)]
    return tuple(
        Wide(level, _with(first, _measured(stored, level, truths, illuminant)))
        for level, *truths in zip(levels, *at_w, strict=True)
        if any(len(truth.pairs.wi) for truth in truths)
    )


def _values_of_w(table: Table) -> np.ndarray:
    """The Chebyshev nodes of the range of w, which are dense at its ends, where functions of w err most."""
    low, high = max(table.w_range[0], 2 * least_cosine(table.plate_ior)), table.w_range[1]
    return (low + high) / 2 - (high - low) / 2 * np.cos(np.pi * (np.arange(_GROUPS) + 0.5) / _GROUPS)


def _added(table: Table, level: float) -> float:
    """The variance that is added to a table's kernel at a place between its levels."""
    return (table.spacing.grown(level) - 1) * table.sigma_b**2


def _measured(stored: Table, level: float, truths: list[Truth], illuminant: str) -> Errors:
    u, v = (np.concatenate([getattr(truth.pairs, axis) for truth in truths]) for axis in "uv")
    counts = [len(truth.pairs.wi) for truth in truths]
    w = np.repeat([truth.w for truth in truths], counts)
    light = np.split(stored.scattered_over_w2(u, v, w, variance=_added(stored, level)), np.cumsum(counts)[:-1])
    answers = {truth.w: (each, stored.zero_order_xyz(truth.w)) for truth, each in zip(truths, light, strict=True)}
    return measure(truths, lambda u, v, w: answers[w], illuminant, ratio_ior=stored.ratio_ior)


def _with(first: Errors, wide: Errors) -> Errors:
    """Add the errors of the first level to those of a wider kernel by squares, because their origins differ."""
    return replace(
        wide,
        mean=math.hypot(wide.mean, first.mean),
        p95=math.hypot(wide.p95, first.p95),
        p99=math.hypot(wide.p99, first.p99),
        max=math.hypot(wide.max, first.max),
        relative_dy=math.hypot(wide.relative_dy, first.relative_dy),
        relative_rms=math.hypot(wide.relative_rms, first.relative_rms),
    )


def _truths(
    stored: Table, exact: Table, w: float, levels: Sequence[float], rng: np.random.Generator
) -> Iterator[Truth]:
    """The light of a table at one w under the kernel of each of some levels, at direction pairs."""
    image = exact.at_w(w).astype(np.float32) * sky_share(exact)[..., None]
    # The texels' own kernel is narrower than sigma_b by what a reading adds.
    octaves = _octaves(image, (exact.sigma_b / exact.texel) ** 2 - bspline.VARIANCE)
    zero_order = exact.zero_order_xyz(w)
    drawn = _pairs(stored, exact, image, w, levels, rng)
    for level, pairs in zip(levels, drawn, strict=True):
        variance = exact.sigma_b**2 * stored.spacing.grown(level)
        yield Truth(w, pairs, _blurred(exact, octaves, pairs, variance) * w**2, zero_order)


def _pairs(
    stored: Table, exact: Table, image: np.ndarray, w: float, levels: Sequence[float], rng: np.random.Generator
) -> Iterator[Pairs]:
    """Draw direction pairs of one w for each level: half are cosine weighted, and half follow the light there."""
    half, least = _PAIRS // 2, least_cosine(exact.plate_ior)
    cosine = cosine_weighted(w, half, rng, least=least)
    places = lit_places(exact, image[..., 1], w, count=half * len(levels), rng=rng)
    sigmas = np.array([math.sqrt(_added(stored, level)) for level in levels])
    number = np.arange(len(places)) % len(levels)
    uv = places + sigmas[number, None] * rng.standard_normal(places.shape)
    inside = np.sum(uv**2, axis=1) < FARTHEST**2 - w**2
    *ways, kept = pair_and_kept(np.column_stack([uv, np.full(len(uv), w)])[inside], rng, least=least)
    number = number[inside][kept]
    for k, sigma in enumerate(sigmas):
        wi, wr = (np.concatenate([first, way[number == k]]) for first, way in zip(cosine, ways, strict=True))
        pairs = Pairs(wi, wr, np.arange(len(wi)) >= len(cosine[0]))
        yield pairs.within(exact.region.known(_FROM_RIM * sigma))


def _octaves(image: np.ndarray, variance: float) -> list[tuple[np.ndarray, float]]:
    """An image (rows, columns, 3) of texels with a Gaussian of a variance, in squared texels; and copies of half, a
    quarter and so on of its texels a side, under wider Gaussians. Each with its variance, in its own squared texels."""
    found = [(image, variance)]
    while min(found[-1][0].shape[:2]) > 2 * _SIDE_MIN:
        image, variance = found[-1]
        added = 4 * _RESOLVED**2 - variance
        # A Gaussian narrower than a texel would be no Gaussian. The image is then smooth enough.
        added = added if added > 1 else 0.0
        for axis in (0, 1):
            image = np.moveaxis(_halved(np.moveaxis(image, axis, 0), math.sqrt(added)), 0, axis)
        found.append((np.ascontiguousarray(image), (variance + added) / 4))
    return found


def _halved(image: np.ndarray, sigma: float) -> np.ndarray:
    """Every second row of an image (rows, ...), blurred by a Gaussian of sigma rows; no light is beyond its ends."""
    if not sigma:
        return image[::2]
    reach = math.ceil(_CUT * sigma)
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2) / (math.sqrt(2 * math.pi) * sigma)
    kept = np.arange(0, len(image), 2)
    sums = banded_sums(image.reshape(1, len(image), -1), kept - reach, np.tile(taps, (len(kept), 1)))
    return sums.reshape(-1, *image.shape[1:])


def _blurred(table: Table, octaves: Sequence[tuple[np.ndarray, float]], pairs: Pairs, variance: float) -> np.ndarray:
    """The light (n, 3) of a table's texels at each pair's (u, v), under a kernel of `variance` in all.

    Each value is a sum over the samples of the coarsest octave that leaves enough of the kernel to the sum."""
    for octave in range(len(octaves) - 1, -1, -1):
        step = 2**octave * table.texel
        image, held = octaves[octave]
        left = variance / step**2 - held
        if left >= _LEFT or not octave:
            break
    y, x = ((at - first) / step for at, first in zip((pairs.v, pairs.u), table.first, strict=True))
    return gaussian_sums(image, y, x, sigma=(math.sqrt(left),) * 2, cut=_CUT)

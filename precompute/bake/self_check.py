# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures a bake's own error, at about half the cost of the bake itself.

The reference (precompute/reference) takes one Fourier transform for every w and every wavelength, which takes minutes.
The bake has a series in s instead, made from a few transforms. So the error is measured in two parts. The series is
compared with exact transforms, at other values of s than its nodes. All other errors (of wavelengths, kernel, texels,
terms and half floats) are measured by the error metric, against sums over the series' bins at each direction.

Lamps of other spectra than the bake's light are measured on the same sums. Their errors are stated, and limit nothing.

make.py compares the errors with the requested dE00. The verb `check` measures the same errors independently
(laboratory/check).

Under the kernels of the wider blur levels, and those between two levels, sums over the bins would take too long. These
kernels are compared with the table of the first level, as it was before its functions of w were learnt and rounded. Its
texels are samples of the light under a known Gaussian. Their sum under one more Gaussian is the light under the wider
kernel. What this table itself is wrong by is in the errors of the first level, and is added by squares."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..base.progress import Progress, part_of
from ..colour.channels import channel_weights, lamp_matrix
from ..colour.illuminants import FIRST, JOINT, first_of, has_bands, line_of
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, seen_wavelengths
from ..maths import bspline
from ..maths.bspline import banded_sums
from ..maths.gaussian_sums import gaussian_sums
from ..measure.errors import Errors, Pairs, Truth, cosine_weighted, draw_w, measure, pair_and_kept
from ..measure.shown_colours import SHOWN_Y, Shown, chosen_by_light, in_all_spaces
from ..measure.truths import Binned, Spectrum, draw_pairs
from ..optics.brdf import NO_RATIO, half_angle_cosine
from ..optics.plate import least_cosine
from ..optics.region import FARTHEST
from ..spectra.density import CUT, density_at
from ..spectra.series import SpectrumSeries, exact_error
from ..surface.relief import Relief
from ..table.radiance import reflected_xyz
from ..table.table import Table
from .levels_and_basis import lit_places, sky_share
from .plan import Plan

# Number of values of w at which a bake is checked.
GROUPS = 16
# The least and the greatest number of direction pairs at each w. In between, about _BINS_SUMMED bins are summed per w.
_PAIRS_MIN, _PAIRS_MAX, _BINS_SUMMED = 150, 300, 150_000
# The dE00 per relative error of luminance, at Y = 1: the derivative of L* = 116 Y^(1/3) - 16 is 116 / 3.
_DELTA_E_PER_UNIT = 116 / 3
# The wavelengths' spacing under an illuminant of narrow bands: its error is half of that in the bake's own spacing.
_OF_BANDS = 0.2
# The lamps whose errors a bake states: black bodies, daylight, LEDs and a tube.
LAMPS = ("2000K", "2700K", "4000K", "10000K", "D5500", "LED-B1", "LED-RGB1", "FL11")
# Number of values of s at which each series is compared with an exact transform.
_SERIES_PROBES = 2


@dataclass(frozen=True)
class Judge:
    """What a bake is judged by.

    errors_of  a function that measures the errors of a plan's table
    lamps      the truths of each lamp, XYZ beside daylight as white; empty for a bake under another light than daylight
    ratio_ior  the index of the ratio form, if table and truths hold the reflectance of their matter; else NO_RATIO"""

    errors_of: Callable[[Table], Errors]
    lamps: dict[str, list[Truth]] = field(default_factory=dict)
    ratio_ior: float = NO_RATIO

    def errors_under_lamps(self, table: Table) -> dict[str, Errors]:
        """The errors of a table's colours under each lamp, at the exposure with the largest 95th percentile."""
        first = next(iter(self.lamps.values()), [])
        answered = [(table.channels_over_w2(t.pairs.u, t.pairs.v, t.w), table.zero_order_xyz(t.w)) for t in first]

        def errors(lamp: str, truths: list[Truth]) -> Errors:
            matrix = lamp_matrix(table.illuminant, lamp).T
            answers = {t.w: (channels @ matrix, z) for t, (channels, z) in zip(truths, answered, strict=True)}
            return measure(truths, lambda u, v, w: answers[w], ratio_ior=self.ratio_ior, worst_by="p95")

        return {lamp: errors(lamp, truths) for lamp, truths in self.lamps.items()}


def wavelengths_for(sigma_b: float, illuminant: str = "D65") -> np.ndarray:
    """Wavelengths (n,) in metres, equally spaced in their logarithm.

    At |u| = 1 an order moves by sigma_b from one wavelength to the next. A sum of Gaussians at this spacing is flat to
    5e-9; at the rim, |u| = 2, to 1.4 %. Under an illuminant of narrow bands it moves by _OF_BANDS of that, less than in
    the bake itself (plan.py)."""
    step = min(sigma_b * (_OF_BANDS if has_bands(illuminant) else 1), np.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) / 80)
    return np.geomspace(
        WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, int(np.ceil(np.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) / step)) + 1
    )


def judge(reliefs: Sequence[Relief], chosen: Plan, illuminant: str, *, progress: Progress) -> Judge:
    """What a plan's table is judged by.

    It is measured at a few values of w, on direction pairs that the bake was not made from. The series' error is added
    to every error of colour and to every relative error of luminance, but not to those under other lamps. `progress` is
    called with the stage "self-check"."""
    rng = np.random.default_rng(0)
    found: list[list[Truth]] = []
    lamps = LAMPS if first_of(illuminant) == FIRST else ()
    pairs = _affordable_pairs(chosen)
    least = least_cosine(chosen.matter.plate_ior)
    for k, w in enumerate(w_within(chosen.w_range, GROUPS, rng, least=least)):
        drawn = pairs_within(chosen, w, pairs, rng=rng, illuminant=illuminant)
        found.append(
            _truths(
                chosen, drawn, w, (first_of(illuminant), *lamps), illuminant,
                part_of(progress, "self-check", done=k, total=GROUPS),
            )
        )  # fmt: skip
    own, *of_lamps = (list(truths) for truths in zip(*found, strict=True))
    s = rng.uniform(0.3, 1, _SERIES_PROBES) * chosen.ensemble[0].s_max
    scale = chosen.matter.plate_ior
    lacking = max(
        exact_error(relief.scaled(scale), series, s) for relief, series in zip(reliefs, chosen.ensemble, strict=True)
    )

    def errors_of(table: Table) -> Errors:
        errors = measure(own, table.candidate, illuminant, ratio_ior=chosen.matter.ratio_ior)
        return errors.worse_by(_DELTA_E_PER_UNIT * lacking, lacking)

    return Judge(errors_of, dict(zip(lamps, of_lamps, strict=True)), chosen.matter.ratio_ior)


def _affordable_pairs(chosen: Plan) -> int:
    """The number of direction pairs at each w that can be measured in reasonable time.

    A wide kernel reaches more bins for each pair. It also shows less detail, so fewer pairs are enough."""
    bins = 1.0
    for q in (chosen.ensemble[0].grid.q_y, chosen.ensemble[0].grid.q_x):
        if len(q) > 1:
            bins *= 1 + 2 * CUT * chosen.sigma_b / (550e-9 * (q[1] - q[0]))
    return int(np.clip(_BINS_SUMMED / bins, _PAIRS_MIN, _PAIRS_MAX))


def w_within(w_range: tuple[float, float], count: int, rng: np.random.Generator, *, least: float = 0.0) -> np.ndarray:
    """Draw values of w (count,) within a range, distributed as for two cosine-weighted directions whose cosines are at
    least `least`.

    One value comes from each of `count` quantiles. One is always large, where a deep relief is hardest."""
    drawn = np.sort(draw_w(4096, rng, least=least))
    drawn = drawn[(drawn >= w_range[0]) & (drawn <= w_range[1])]
    if len(drawn) < count:
        drawn = np.linspace(max(w_range[0], 2 * least), w_range[1], 4 * count)
    return drawn[((np.arange(count) + rng.random(count)) / count * len(drawn)).astype(int)]


def pairs_within(chosen: Plan, w: float, count: int, *, rng: np.random.Generator, illuminant: str = "D65") -> Pairs:
    """Draw up to `count` direction pairs of one w, with (u, v) inside the table's region.

    For a small region up to 64 times as many are drawn, until at least half of `count` are inside."""
    for more in (1, 4, 16, 64):
        drawn = draw_pairs(
            _spectrum(chosen.ensemble, rng), chosen.sigma_b, w, count=more * count, rng=rng,
            line_m=line_of(illuminant), least=least_cosine(chosen.matter.plate_ior),
        )  # fmt: skip
        drawn = drawn.within(chosen.region)
        if 2 * len(drawn.wi) >= count:
            break
    return drawn.only(slice(None, None, -(-len(drawn.wi) // count) or 1))


def _spectrum(ensemble: Sequence[SpectrumSeries], rng: np.random.Generator) -> Spectrum:
    """A Spectrum that returns a random scan's at each call, so that pairs drawn from it follow the mean spectrum."""

    def at(s: float) -> Binned:
        series = ensemble[int(rng.integers(len(ensemble)))]
        mix = series.weights(np.array(s)) * s**2
        return Binned(series.grid, mix @ series.row_sums, lambda row: mix @ series.scattered_over_s2[:, row])

    return at


def _truths(
    chosen: Plan, pairs: Pairs, w: float, lights: Sequence[str], illuminant: str, progress: Progress
) -> list[Truth]:
    """The truth at the pairs under each light: scattered XYZ and the zero order's XYZ, as sums over the bins of the
    scans' series, times the reflectance of a matter that the table holds, over the largest albedo."""
    ensemble, sigma_b = chosen.ensemble, chosen.sigma_b
    lambdas = seen_wavelengths(wavelengths_for(sigma_b, illuminant), illuminant)
    reflectance = np.ones((len(lambdas), len(pairs.wi) + 1))
    if chosen.holds_reflectance:
        cosines = np.append(half_angle_cosine(pairs.wi, pairs.wr), w / 2)  # the zero order's is the last
        reflectance = chosen.matter.reflectance(lambdas, cosines)
    weights = channel_weights(lambdas, JOINT.join(lights)) / (len(ensemble) * chosen.largest_albedo)
    scattered, zero_order = np.zeros((len(pairs.wi), weights.shape[1])), np.zeros(weights.shape[1])
    for n, series in enumerate(ensemble):
        density = density_at(series, pairs.u, pairs.v, w=w, lambdas=lambdas, sigma=sigma_b)
        scattered += (density * reflectance[:, :-1]).T @ weights
        zero_order += (series.zero_order(w / lambdas) * reflectance[:, -1]) @ weights
        progress("self-check", (n + 1) / len(ensemble))
    thirds = (np.split(each, len(lights), axis=-1) for each in (scattered, zero_order))
    return [Truth(w, pairs, *of_light) for of_light in zip(*thirds, strict=True)]


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
    at_w = [list(_wide_truths(stored, exact, w, levels, rng)) for w in _values_of_w(exact)]
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


def _wide_truths(
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
    """Every second row of an image (rows, ...), blurred by a Gaussian of sigma rows; light outside counts as 0."""
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


# Within this many standard deviations of the kernel, light counts as the mirror image.
_MIRROR = 5.0


def shown_colours(table: Table) -> Shown:
    """What each space does to a table's colours beside its mirror image."""
    xyz = colours_by_light(table, np.random.default_rng(0))
    return in_all_spaces(xyz, xyz, table.illuminant)


def colours_by_light(table: Table, rng: np.random.Generator, tried: int = 20_000) -> np.ndarray:
    """Colours (n, 3) in XYZ that a surface shows beside its mirror image, at Y = SHOWN_Y. They are drawn by their light
    from `tried` pairs of directions."""
    turn, square = 2 * np.pi * rng.random((2, tried)), rng.random((2, tried))
    sine = np.sqrt(square)
    wi, wr = np.stack([sine * np.cos(turn), sine * np.sin(turn), np.sqrt(1 - square)], axis=-1)
    xyz = reflected_xyz(table, wi, wr)
    u, v = (wi + wr)[:, :2].T
    chosen = chosen_by_light(np.where(np.hypot(u, v) > _MIRROR * table.sigma_b, xyz[:, 1], 0), rng)
    return SHOWN_Y * xyz[chosen] / xyz[chosen, 1:2]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures a bake's own error, at about half the cost of the bake itself.

The reference (precompute/reference) takes one Fourier transform for every w and every wavelength, which takes minutes.
The bake has a series in s instead, made from a few transforms. So the error is measured in two parts. The series is
compared with exact transforms, at other values of s than its nodes. All other errors (of wavelengths, kernel, texels,
terms and half floats) are measured by the error metric, against sums over the series' bins at each direction.

Lamps of other spectra than the bake's light are measured on the same sums. Their errors are stated, and limit nothing.

make.py compares the errors with the requested dE00. The verb `check` measures the same errors independently
(precompute/check).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..base.progress import Progress, part_of
from ..colour.channels import channel_weights, lamp_matrix
from ..colour.illuminants import FIRST, JOINT, first_of, has_bands, line_of
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, seen_wavelengths
from ..measure.errors import Errors, Truth, measure
from ..measure.pairs import Pairs, draw_w
from ..measure.truths import Binned, Spectrum, draw_pairs
from ..optics.brdf import NO_RATIO, half_angle_cosine
from ..optics.plate import least_cosine
from ..spectra.density import CUT, density_at
from ..spectra.fast import exact_error
from ..spectra.series import SpectrumSeries
from ..surface.relief import Relief
from ..table.table import Table
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
    the bake itself (wavelengths.py)."""
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

# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures a bake's errors again, from its file and the height maps only.

They are the errors of its colours, of its zero order, and of its colours under the lamps that its header states. The
table is read by table_file.py and compared with the sums of direct_sums.py. The check shares no code with baking,
packing or reading a bake. It shares the error metrics and the direction pairs (precompute/measure), the observer's
tables, the mapping of colours into a renderer's space, and the levelled relief that counts as the surface."""

import hashlib
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from precompute.base.failure import GratingError, Setting
from precompute.base.progress import Progress, part_of, silent
from precompute.colour.channels import channel_weights, lamp_matrix
from precompute.colour.illuminants import FIRST, JOINT, first_of, has_bands, is_illuminant, line_of
from precompute.colour.observer import WAVELENGTH_MIN_M
from precompute.measure.errors import RELATIVE_DY, Errors, Truth, draw_w, measure
from precompute.measure.shown_colours import Shown, shown_against
from precompute.optics.plate import least_cosine
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import Relief, prepare
from precompute.surface.steps.pipeline import DEFAULT, steps_of
from precompute.surface.steps.step import Step

from . import direct_sums
from .direct_sums import (
    Held,
    Wide,
    claimed,
    draw_pairs,
    levels_of,
    measured_under,
    pairs_under,
    scattered_xyz,
    sigma_at,
)
from .table_file import Table, read_table

# The greatest number of lamps in a header; a bake states eight.
_MOST = 32


@dataclass(frozen=True)
class Lamp:
    """The errors of a bake's colours under a lamp, and the dE00 that their 95th percentile keeps by the bake's header:
    at other directions, and however the values of w are distributed."""

    errors: Errors
    claimed: float

    @property
    def keeps_claim(self) -> bool:
        """Whether the measured percentile keeps the claim, up to its sampling error."""
        return self.errors.p95 <= self.claimed + self.errors.p95_allowance

    def as_dict(self) -> dict[str, Any]:
        """Convert to JSON; null stands for an infinite error."""
        told = self.errors.as_dict()
        figures = {name: told[name] for name in ("mean", "p95", "pairs")}
        return {**figures, "p95_allowance": self.errors.p95_allowance, "p95_claimed": self.claimed}


def fault_of(lamps: Mapping[str, Lamp]) -> str:
    """A sentence on the lamp that exceeds its claim most; "" if none does."""
    wrong = {lamp: its for lamp, its in lamps.items() if not its.keeps_claim}
    if not wrong:
        return ""
    lamp, its = max(wrong.items(), key=lambda each: each[1].errors.p95 - each[1].claimed)
    return f"dE00 p95 {its.errors.p95:.2f} under {lamp:.40}, claimed {its.claimed:.2f}"


def claims(table: Table, bake: Path) -> dict[str, float]:
    """The dE00 that the 95th percentile keeps under each lamp by a bake's header.

    Raises GratingError for a header that no bake has."""
    delta_e = table.record.get("delta_e")
    told = delta_e.get("lamps_claim", {}) if isinstance(delta_e, dict) else {}
    if not (
        isinstance(told, dict)
        and len(told) <= _MOST
        and (first_of(table.illuminant) == FIRST or not told)
        and all(JOINT not in lamp and is_illuminant(lamp) for lamp in told)
        and all(type(claim) in (int, float) and claim >= 0 for claim in told.values())
    ):
        raise GratingError(bake, "its header's lamps_claim is invalid", "bake it again")
    return {lamp: float(claim) for lamp, claim in told.items()}


def of_lamps(table: Table, truths: Mapping[str, Sequence[Truth]], claimed: Mapping[str, float]) -> dict[str, Lamp]:
    """The errors of a table's colours under each lamp, by the lamps' truths on the same pairs.

    Daylight is white, so that a lamp's own colour counts. The exposure is the one with the largest 95th percentile."""
    pairs = next(iter(truths.values()), ())
    held = [(table.channels_over_w2(t.pairs.u, t.pairs.v, t.w), table.zero_order_channels(t.w)) for t in pairs]

    def errors(lamp: str) -> Errors:
        matrix, own = lamp_matrix(table.illuminant, lamp).T, list(truths[lamp])
        under = {t.w: (light @ matrix, mirrored @ matrix) for t, (light, mirrored) in zip(own, held, strict=True)}
        return measure(own, lambda u, v, w: under[w], ratio_ior=table.ratio_ior, worst_by="p95")

    return {lamp: Lamp(errors(lamp), claimed[lamp]) for lamp in truths}


# Number of values of w at which the zero order is checked.
_AT = 17
# The relative rounding error of a half float.
_HALF_STEP = 2.0**-11
# Share of the light that the bake's expansion of the phasor may miss for a dE00 of 1. The zero order, which has all of
# its light in one place, may miss the same share.
_EXPANSION = 2e-4


def zero_order_off(table: Table, reliefs: Sequence[Relief]) -> float:
    """The largest |dY| of the zero order at some values of w, and the largest error of its channels beyond XYZ.

    A channel's error counts over the integral of its curve's absolute value, which is 1 for Y. So zero_order_budget
    holds for every channel."""
    w = np.linspace(0, 2, _AT) + 1 / len(table.zero_order)
    w = w[(w >= table.w_range[0]) & (w <= table.w_range[1])]
    exact = direct_sums.zero_order_xyz(reliefs, w, table.illuminant, matter=table.matter)
    weights = channel_weights(direct_sums.at_each_nanometre(table.illuminant), table.illuminant)
    off = np.abs(table.zero_order_channels(w) - exact) / np.abs(weights).sum(axis=0)
    return float(off[:, [1, *range(3, off.shape[1])]].max(initial=0.0))


def zero_order_budget(reliefs: Sequence[Relief], samples: int, asked: float) -> float:
    """The largest |dY| of the zero order that passes: the sum of three errors, times `asked` if above 1.

    The first error is the rounding of a half float. The second is the smoothing of Z(w) by B-splines over samples h
    apart: at most |Z''| h^2 / 6 <= (2 pi sigma / lambda)^2 h^2 / 3 for heights of variance sigma^2, where Z'' is the
    second derivative of Z. The third is the expansion's tolerance."""
    step = 2 / (samples - 1)
    variance = max(np.average(relief.height_m**2, weights=relief.apodisation**2) for relief in reliefs)
    bend = (2 * np.pi / WAVELENGTH_MIN_M) ** 2 * variance * step**2 / 3
    return max(1.0, asked) * float(_HALF_STEP + bend + _EXPANSION)


# Borders of the rings around the zero order, as distances sqrt(u^2 + v^2), for which errors are reported separately.
RINGS = (0.0, 0.1, 0.5, 1.0, 2.0)
# Differs from the seed of the bake's own check, because a bake could be tuned to the directions of that check.
_SEED = 1
# The least wavelength step in metres: a fifth of the width of a gas discharge lamp's lines.
_FINEST_STEP_M = 0.2e-9


@dataclass(frozen=True)
class Ring:
    """The errors of the pairs with u_from <= sqrt(u^2 + v^2) < u_to.

    pairs        number of these pairs
    light        their share of the light of all pairs
    relative_dy  sum of their |dY| over the sum of their Y"""

    u_from: float
    u_to: float
    pairs: int
    light: float
    relative_dy: float


@dataclass(frozen=True)
class Verdict:
    """The result of a check.

    errors             error metrics
    asked              dE00 that the bake must keep
    zero_order_dy      largest |dY| of the zero order, and error of its channels beyond XYZ (zero_order_off)
    zero_order_budget  the largest zero_order_dy that passes
    rings              the errors by distance from the zero order
    wide               the errors under wider kernels
    wide_claimed       the p99 with its sampling error that the bake claims under wider kernels
    lamps              the errors of the colours under lamps of other spectra, which the bake's header states
    shown              the colours as a renderer's spaces show them, against the exact ones
    w                  values of w at which pairs were measured
    step_m             wavelength step in metres
    seconds            duration of the check in seconds
    """

    errors: Errors
    asked: float
    zero_order_dy: float
    zero_order_budget: float
    rings: list[Ring]
    wide: list[Wide]
    wide_claimed: float
    lamps: dict[str, Lamp]
    shown: Shown
    w: list[float]
    step_m: float
    seconds: float

    @property
    def relative_dy_budget(self) -> float:
        """The largest |dY| relative to Y that passes."""
        return RELATIVE_DY * max(1.0, self.asked)

    @property
    def worst_wide(self) -> Wide:
        """The wider kernel whose p99, less its sampling error, is the largest."""
        return max(self.wide, key=lambda each: each.errors.p99 - each.errors.p99_allowance)

    @property
    def faults(self) -> list[str]:
        """Sentences on the limits that the bake exceeds; empty if it passes."""
        found, errors, budget = [], self.errors, self.relative_dy_budget
        if not errors.p99 <= self.asked + errors.p99_allowance:
            found.append(f"dE00 p99 {errors.p99:.2f}, asked {self.asked:g}")
        if self.wide and not self.worst_wide.errors.p99 <= self.wide_claimed + self.worst_wide.errors.p99_allowance:
            p99, level = self.worst_wide.errors.p99, self.worst_wide.level
            found.append(f"dE00 p99 {p99:.2f} at blur level {level:g}, claimed {self.wide_claimed:.2f}")
        if not errors.relative_dy <= budget:
            found.append(f"|dY| {errors.relative_dy:.1%}, asked {budget:.1%}")
        if not self.zero_order_dy <= self.zero_order_budget:
            found.append(f"zero order off by {self.zero_order_dy:.1e}, asked {self.zero_order_budget:.1e}")
        return [*found, *filter(None, [fault_of(self.lamps)])]

    def as_dict(self) -> dict[str, Any]:
        """Convert the result to JSON."""
        return {
            "passed": not self.faults,
            "faults": self.faults,
            "asked_delta_e": self.asked,
            "delta_e": self.errors.as_dict(),
            "relative_dy_budget": self.relative_dy_budget,
            "zero_order": {"dy": self.zero_order_dy, "budget": self.zero_order_budget},
            "wide": [each.as_dict() for each in self.wide],
            "lamps": {lamp: its.as_dict() for lamp, its in self.lamps.items()},
            "rings": [asdict(ring) for ring in self.rings],
            "shown": {space: found.as_dict() for space, found in self.shown.items()},
            "w": self.w,
            "step_nm": self.step_m * 1e9,
            "seconds": self.seconds,
        }


def check(
    bake: Path,
    height_maps: Sequence[HeightMap],
    *,
    delta_e: float | None = None,
    groups: int = 2,
    pairs: int = 4000,
    step_m: float | None = None,
    progress: Progress = silent,
) -> Verdict:
    """Measure a bake's error again, at `groups` values of w with up to `pairs` direction pairs each.

    The wavelengths are summed in steps of step_m metres, by default default_step. delta_e is the dE00 to keep, by
    default the one in the file's header. Raises GratingError if the file is no bake of these height maps."""
    started = time.perf_counter()
    table = read_table(bake)
    _refuse_another_surface(bake, table.record, height_maps)
    claimed_of_lamps = claims(table, bake)
    asked = float(table.record.get("asked_delta_e", 1.0)) if delta_e is None else delta_e
    step_m = default_step(table.sigma_b, table.illuminant) if step_m is None else step_m
    steps = steps_in(table.record, str(bake))
    plate_ior = table.matter.plate_ior
    reliefs = [prepare(height_map, steps, plate_ior=plate_ior).scaled(plate_ior) for height_map in height_maps]
    truth, under, of_each = truths(
        table, reliefs, tuple(claimed_of_lamps), groups=groups, pairs=pairs, step_m=step_m, progress=progress
    )
    if not sum(len(t.scattered_xyz) for t in truth):
        raise GratingError(bake, f"none of {pairs} direction pairs lies in its region", "give more --pairs")
    errors = _measured(table, truth)
    return Verdict(
        errors=errors,
        asked=asked,
        zero_order_dy=max(zero_order_off(table, reliefs), errors.zero_order_dy),
        zero_order_budget=zero_order_budget(reliefs, len(table.zero_order), asked),
        rings=_rings(table, truth),
        wide=measured_under(table, under),
        wide_claimed=claimed(table.record),
        lamps=of_lamps(table, of_each, claimed_of_lamps),
        shown=shown_against(truth, table.candidate, table.illuminant, ratio_ior=table.ratio_ior),
        w=[t.w for t in truth],
        step_m=step_m,
        seconds=time.perf_counter() - started,
    )


def _refuse_another_surface(bake: Path, record: dict[str, Any], height_maps: Sequence[HeightMap]) -> None:
    told = record.get("heights_sha256", [])
    if len(told) != len(height_maps):
        raise GratingError(
            bake, f"a bake of {len(told)} height maps, not {len(height_maps)}", "name them all, in order"
        )
    for digest, height_map in zip(told, height_maps, strict=True):
        if hashlib.sha256(np.ascontiguousarray(height_map.height_m).tobytes()).hexdigest() != digest:
            raise GratingError(
                bake,
                f"a bake of another surface than {height_map.source}",
                ("name the file, ", Setting.SIZE_UM, ", ", Setting.HEIGHT_NM, " and ", Setting.CHANNEL, " of the bake"),
            )
    pixel = record.get("pixel_size_m", height_maps[0].pixel_size_m)
    if not np.allclose(pixel, height_maps[0].pixel_size_m, rtol=1e-6, atol=0):
        raise GratingError(
            bake,
            f"baked from pixels of {pixel[1] * 1e9:.4g} nm, and those of {height_maps[0].source} are "
            f"{height_maps[0].pixel_size_m[1] * 1e9:.4g} nm",
            ("give the scan that was baked, with its ", Setting.SIZE_UM),
        )


def steps_in(record: dict[str, Any], source: str) -> tuple[Step, ...]:
    """The steps in a bake's header that levelled its scans. Raises GratingError for unknown steps."""
    request = record.get("request")
    told = request.get("levelling") if isinstance(request, dict) else None
    return steps_of(told, f"{source}: its header's levelling") if isinstance(told, list) else DEFAULT


def default_step(sigma_b: float, illuminant: str = "D65") -> float:
    """Wavelength step in metres for a kernel of sigma_b.

    With this step, an order at |u| = 1 moves by at most one sigma_b from one wavelength to the next. A sum of Gaussians
    at this spacing is flat to 5e-9. The step is from 1 to 3 nm, so that it resolves the observer. Under an illuminant
    of narrow bands it is at most 1 nm, and the order moves by at most half a sigma_b."""
    if has_bands(illuminant):
        return float(np.clip(WAVELENGTH_MIN_M * sigma_b / 2, _FINEST_STEP_M, 1e-9))
    return float(np.clip(WAVELENGTH_MIN_M * sigma_b, 1e-9, 3e-9))


def truths(
    table: Table, reliefs: Sequence[Relief], lamps: Sequence[str], *, groups: int, pairs: int, step_m: float,
    progress: Progress = silent,
) -> tuple[list[Truth], list[list[Truth]], dict[str, list[Truth]]]:  # fmt: skip
    """The exact colours for a table, at `groups` values of w with up to `pairs` direction pairs each; under each of
    levels_of, at fewer pairs; and under each of the lamps, at all pairs.

    All pairs are within the region and the range of w that the table covers."""
    rng, rng_under = (np.random.default_rng(_SEED + k) for k in range(2))
    found: list[Truth] = []
    under: list[list[Truth]] = [[] for _ in levels_of(table)]
    of_lamp: dict[str, list[Truth]] = {lamp: [] for lamp in lamps}
    illuminants = JOINT.join([first_of(table.illuminant), *lamps])
    held = Held(table.sigma_b, table.region, least_cosine(table.matter.plate_ior), line_of(table.illuminant))
    sigmas = [table.sigma_b, *(sigma_at(table, level) for level in levels_of(table))]
    for k, w in enumerate(_draw_w(table.w_range, groups, rng, least=held.least)):
        first = draw_pairs(reliefs, held, w, count=pairs, rng=rng)
        drawn = [first, *pairs_under(table, first, w, groups=groups, rng=rng_under)]
        counts = [len(each.wi) for each in drawn]
        u, v = (np.concatenate(places) for places in zip(*((each.u, each.v) for each in drawn), strict=True))
        scattered = scattered_xyz(
            reliefs, (u, v, w), sigma_b=np.repeat(sigmas, counts), step_m=step_m, illuminant=illuminants,
            matter=table.matter, progress=part_of(progress, "check", done=k, total=groups),
        )  # fmt: skip
        zero_order = direct_sums.zero_order_xyz(reliefs, np.array([w]), illuminants, matter=table.matter)[0]
        parts = np.split(scattered, np.cumsum(counts)[:-1])
        for to, one, part in zip([found, *under], drawn, parts, strict=True):
            to.append(Truth(float(w), one, part[:, :3], zero_order[:3]))
        for number, its in enumerate(of_lamp.values(), 1):
            own = slice(3 * number, 3 * number + 3)
            its.append(Truth(float(w), first, parts[0][:, own], zero_order[own]))
    return found, under, of_lamp


def _draw_w(w_range: tuple[float, float], count: int, rng: np.random.Generator, *, least: float) -> np.ndarray:
    """Draw values of w (count,) in a range, distributed as for two cosine-weighted directions with cosines of at least
    `least`.

    One value comes from each of `count` quantiles."""
    low, high = w_range
    every = np.sort(draw_w(4096, rng, least=least))
    inside = every[(every >= low) & (every <= high)]
    if len(inside) < count:
        inside = np.linspace(max(low, 2 * least), high, 4 * count)
    return inside[((np.arange(count) + rng.random(count)) / count * len(inside)).astype(int)]


def _measured(table: Table, truth: list[Truth]) -> Errors:
    return measure(truth, table.candidate, table.illuminant, ratio_ior=table.ratio_ior)


def _rings(table: Table, truth: list[Truth]) -> list[Ring]:
    parts = [[_in_ring(t, low, high) for t in truth] for low, high in zip(RINGS, RINGS[1:], strict=False)]
    light = [sum(_light(t, ratio_ior=table.ratio_ior) for t in part) for part in parts]
    found = []
    for low, high, part, lit in zip(RINGS, RINGS[1:], parts, light, strict=False):
        pairs = sum(len(t.scattered_xyz) for t in part)
        found.append(
            Ring(
                u_from=low,
                u_to=high,
                pairs=pairs,
                light=lit / max(sum(light), np.finfo(float).tiny),
                relative_dy=_measured(table, part).relative_dy if pairs else 0.0,
            )
        )
    return found


def _light(truth: Truth, *, ratio_ior: float) -> float:
    return float(truth.pairs.radiance_factor(ratio_ior=ratio_ior) @ truth.scattered_xyz[:, 1]) / truth.w**2


def _in_ring(truth: Truth, low: float, high: float) -> Truth:
    radius = np.hypot(truth.pairs.u, truth.pairs.v)
    kept = (radius >= low) & (radius < high)
    return truth.only(kept)

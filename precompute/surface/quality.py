# SPDX-License-Identifier: GPL-3.0-or-later
"""Describes a scan before a bake, and rates whether it is good enough.

Each limit has a finding, with a traffic light and a sentence. For dust, scars, shifted rows and spikes, steps are tried
that remove them and keep the grating."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from ..base.failure import GratingError, Setting, Words, spelled
from ..colour.observer import WAVELENGTH_MIN_M
from .height_map import HeightMap, Plane, plane_of
from .periods import COARSEST_PERIOD_M, FINEST_PERIOD_M, Wave, Waves, length_in_words, middle_of, waves_of
from .relief import Relief
from .steps.repairs import aligned_rows, dust, outliers, scars
from .steps.step import loss_in_words, losses_of

# A defect covers at most this share of the scan; a larger one is relief.
_RELIEF_SHARE = 0.1
# A defect whose removal takes half of a wave's power is part of the grating.
_HALF = 0.5
# The side of the examined parts in pixels, so that a large scan takes no longer than a small one.
SIDE = 512
_ROWS_AT_ONCE = 256


def _streaks(height: np.ndarray, *, shifted: bool) -> np.ndarray:
    """Return the mask (rows, cols) of what looks like scars, either in rows that are shifted as a whole or in others.

    A shifted row does not stand out once the rows are aligned."""
    found = scars(height, 1.0)
    stay = found & scars(aligned_rows(height, "median"), 1.0)
    is_shifted = 2 * stay.sum(axis=1) < found.sum(axis=1)
    return found & (is_shifted if shifted else ~is_shifted)[:, None]


# The steps with their default numbers, and the pixels of the defects that they remove.
_FIND: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "dust": lambda height: dust(height, 5.0),
    "scars": lambda height: _streaks(height, shifted=False),
    "lines": lambda height: _streaks(height, shifted=True),
    "outliers": lambda height: outliers(height, 8.0),
}


@dataclass(frozen=True)
class Defect:
    """The pixels of a scan that a step would remove, or put right.

    share  share of the scan
    harm   the damage to the grating in words, "" for none
    loss   largest share of a wave's power that the step would take"""

    step: str
    share: float
    harm: str
    loss: float

    @property
    def belongs(self) -> bool:
        """Whether the defect is part of the grating."""
        return bool(self.harm) and self.loss >= _HALF


@dataclass(frozen=True)
class Spike:
    """The height of a scan that lies farthest off its relief.

    off_m     distance in metres above the highest, or below the lowest, of the other heights
    relief_m  range of the other heights in metres
    step      the step that removes the spike without harm to the grating; "" if there is none"""

    off_m: float
    relief_m: float
    step: str = ""

    @property
    def times(self) -> float:
        """The spike's distance as a multiple of the relief; 0 without relief."""
        return self.off_m / self.relief_m if self.relief_m else 0.0


@dataclass(frozen=True)
class Surface:
    """A scan, its levelling plane, its lowest and highest levelled height in metres, and its gratings."""

    height_map: HeightMap
    plane: Plane
    reach_m: tuple[float, float]
    gratings: Sequence[Wave]

    def around(self, place: tuple[int, int]) -> tuple[slice, slice]:
        """Return the rows and columns around a pixel, at most SIDE each."""
        shape = self.height_map.height_m.shape
        starts = [min(max(0, at - SIDE // 2), max(0, n - SIDE)) for at, n in zip(place, shape, strict=True)]
        return slice(starts[0], starts[0] + SIDE), slice(starts[1], starts[1] + SIDE)

    def levelled(self, part: tuple[slice, slice]) -> np.ndarray:
        """Return the levelled heights of a part."""
        return self.plane.level_part(self.height_map, part)

    def coarse(self) -> tuple[slice, slice]:
        """Return evenly spaced rows and columns of the whole scan, at most SIDE each."""
        rows, cols = (slice(None, None, -(-n // SIDE)) for n in self.height_map.height_m.shape)
        return rows, cols


def defects_of(surface: Surface) -> tuple[Defect, ...]:
    """Find the dust, the scars and the shifted rows of a scan."""
    rows, cols = surface.height_map.height_m.shape
    middle = surface.around((rows // 2, cols // 2))
    places = {"dust": surface.coarse(), "scars": middle, "lines": middle}
    found = (_tried(surface, step, part) for step, part in places.items())
    return tuple(each for each in found if each is not None)


def spike_of(surface: Surface, defects: Sequence[Defect], *, least: float) -> Spike:
    """Find the spike of a scan with these defects, and, if it exceeds `least` times the relief, its step."""
    coarse = surface.levelled(surface.coarse())
    dusty = any(each.step == "dust" and not each.belongs for each in defects)
    # If the grating itself looks like dust, only single pixels can be distinguished from it.
    off = _FIND["dust" if dusty else "outliers"](coarse)
    rest = coarse[np.isfinite(coarse) & ~off]
    if not rest.size:
        return Spike(0.0, 0.0)
    low, high = float(rest.min()), float(rest.max())
    spike = Spike(max(0.0, low - surface.reach_m[0], surface.reach_m[1] - high), high - low)
    if spike.times <= least:
        return spike
    return replace(spike, step=_removes(surface, _farthest(surface, low, high)))


def _tried(surface: Surface, step: str, part: tuple[slice, slice]) -> Defect | None:
    """Try a step on a part of the scan; None if it would remove nothing, or so much that it is the relief."""
    height = surface.levelled(part)
    mask = _FIND[step](height)
    share = float(mask.mean())
    if not 0 < share <= _RELIEF_SHARE or mask[np.isfinite(height)].all():
        return None
    dy, dx = (side * (each.step or 1) for side, each in zip(surface.height_map.pixel_size_m, part, strict=True))
    before = HeightMap(height, (dy, dx), surface.height_map.source)
    if step == "lines":
        after, holes = replace(before, height_m=aligned_rows(height, "median")), 0.0
    else:
        after, holes = replace(before, height_m=np.where(mask, np.nan, height)), share
    losses = losses_of(before, after, surface.gratings)
    return Defect(step, share, loss_in_words(losses, holes), max((loss for _, loss in losses), default=0.0))


def _farthest(surface: Surface, low: float, high: float) -> tuple[int, int]:
    """Return row and column of the height farthest above `high` or below `low`, both in metres."""
    off, place = -math.inf, (0, 0)
    for start in range(0, surface.height_map.rows, _ROWS_AT_ONCE):
        level = surface.levelled((slice(start, start + _ROWS_AT_ONCE), slice(None)))
        beyond = np.nan_to_num(np.maximum(level - high, low - level), nan=-math.inf)
        row, col = np.unravel_index(np.argmax(beyond), beyond.shape)
        if beyond[row, col] > off:
            off, place = float(beyond[row, col]), (start + int(row), int(col))
    return place


def _removes(surface: Surface, place: tuple[int, int]) -> str:
    """Name the step that removes the pixel at `place` without harm to the grating; "" if there is none."""
    part = surface.around(place)
    at = place[0] - part[0].start, place[1] - part[1].start
    height = surface.levelled(part)
    for step in ("dust", "outliers"):
        tried = _tried(surface, step, part) if _FIND[step](height)[at] else None
        if tried is not None and not tried.harm:
            return step
    return ""


LIGHTS = ("good", "usable", "poor")

# Each pair of numbers below holds the limits of "good" and of "usable".

# Pixels: two must resolve the finest period that diffracts visible light.
_PIXEL_M = (FINEST_PERIOD_M / 2, FINEST_PERIOD_M)
# The wavelength of green light, for which an eye is most sensitive.
_GREEN_M = 555e-9
# Pixels per period of the grating: with four, a cubic curve through them misses a sine's top by 10 %.
_PIXELS_A_PERIOD = (8.0, 4.0)
# The share of the surface steeper than 45 degrees, where light hits the surface twice. A bake ignores the second hit.
_STEEP_SHARE = (0.01, 0.1)
# The contrast of the grating's peak, and its repeats. Noise reaches a contrast of 23; gratings exceed 50 (periods.py).
_CONTRAST = (200.0, 75.0)
_REPEATS = (10.0, 5.0)
# Larger contrasts are not written out.
_PLAIN = 1000.0
# Levelling by subtraction shortens a surface by the cosine of its tilt: 0.06 % and 1.5 %.
_TILT_DEG = (2.0, 10.0)
# The share of the scan that is dust, scratches, scars, shifted rows or missing.
_DIRT_SHARE = (1e-3, 0.05)
# The distance of dust from the relief, in multiples of the relief. A bake grows in proportion to the height range.
_SPIKE_TIMES = (1.0, 10.0)
_NAMES = {"dust": "dust or scratches", "lines": "scan lines shifted as a whole"}
# The phase shift in radians that one height step gives violet light reflected back to its source.
_STEP_RADIANS = (0.1, 0.5)
# The ratio of the valleys' sharpness to that of the tops, which a blunt tip rounds.
_ROUNDED = (3.0, 30.0)
# The percentile of the curvatures that counts as the sharpest. Dust and noise are rarer.
_SHARPEST = 99.9
# Height steps below this share of the range are rounding errors.
_ROUNDING = 1e-7
# A tenth of an atom's height: finer steps are not written out, and no microscope resolves a lower relief.
_FINE_STEP_M = 1e-11
# A lower relief is a rounding error.
_NO_RELIEF_M = 1e-15


@dataclass(frozen=True)
class Finding:
    """One thing that limits a scan.

    light     one of LIGHTS
    words     the fault and the remedy
    figure    the decisive number, by topic: "pixel" side in metres; "slopes" share of steep ones; "period" contrast;
              "tilt" degrees; "dirt" share of the scan; "steps" metres; "tip" ratio of the valleys' sharpness to the
              tops'; "size" relief in metres"""

    topic: str
    light: str
    words: Words
    figure: float

    @property
    def sentence(self) -> str:
        """The words, with the command line's names of settings."""
        return spelled(self.words)

    def as_dict(self) -> dict[str, object]:
        """Ready for JSON."""
        return {"topic": self.topic, "light": self.light, "sentence": self.sentence, "figure": self.figure}


@dataclass(frozen=True)
class Quality:
    """All findings of a scan."""

    findings: tuple[Finding, ...]

    @property
    def light(self) -> str:
        """The worst traffic light of the findings."""
        return _worst(*(finding.light for finding in self.findings))

    def as_dict(self) -> dict[str, object]:
        """Return the findings for JSON."""
        return {"light": self.light, "findings": [finding.as_dict() for finding in self.findings]}

    def in_words(self) -> list[str]:
        """Return a line for the scan, and one for each finding."""
        return [f"quality: {self.light}", *(f"  {each.topic}: {each.light}; {each.sentence}" for each in self.findings)]


def judge(height_map: HeightMap, plane: Plane, waves: Waves, *, reach_m: tuple[float, float]) -> Quality:
    """Rate a scan by its measured heights, their plane, the waves, and the lowest and highest levelled height."""
    surface = Surface(height_map, plane, reach_m, waves.gratings)
    centre = surface.levelled(surface.around(tuple(n // 2 for n in height_map.height_m.shape)))
    of_surface = _pixel(height_map, waves), _slopes(centre, height_map), _period(waves)
    if height_map.periodic:  # synthetic
        return Quality(of_surface)
    measured = _tilt(height_map, plane), _dirt(surface), _steps(height_map), _tip(centre, height_map)
    return Quality((*_odd_size(reach_m[1] - reach_m[0], height_map), *of_surface, *measured))


def _worst(*lights: str) -> str:
    return max(lights, key=LIGHTS.index)


def _light(value: float, limits: tuple[float, float]) -> str:
    """Rate a value: good up to the first limit, usable up to the second. A larger first limit reverses the order."""
    sign = 1 if limits[0] <= limits[1] else -1
    return LIGHTS[sum(sign * value > sign * limit for limit in limits)]


def replaced_width(height_map: HeightMap) -> str:
    """Describe the user's width if it replaces the file's own; else ""."""
    stored, (_, width) = height_map.stored_width_m, height_map.size_m
    if stored is None or math.isnan(stored):
        return ""
    return f"the width is {length_in_words(width)} as given, instead of the {length_in_words(stored)} in the file"


def _odd_size(relief: float, height_map: HeightMap) -> tuple[Finding, ...]:
    """Return a finding if the user's width replaces the file's own, or if the relief is impossible, which means a wrong
    width or unit; else ()."""
    if relief > max(height_map.size_m):
        sentence = (
            f"the relief of {length_in_words(relief)} is larger than the scan, {length_in_words(height_map.size_m[1])} "
            "wide; is the width right, and the unit of height?"
        )
    elif relief < _FINE_STEP_M:
        found = f"the relief of {relief * 1e12:.2g} pm is finer than an atom" if relief > _NO_RELIEF_M else "no relief"
        sentence = f"{found}; is the unit of height right?"
    elif replaced := replaced_width(height_map):
        return (Finding("size", "usable", replaced, relief),)
    else:
        return ()
    return (Finding("size", "poor", sentence, relief),)


def _pixel(height_map: HeightMap, waves: Waves) -> Finding:
    side = max(height_map.pixel_size_m)
    light = _light(side, _PIXEL_M)
    lost = f"waves finer than {length_in_words(2 * side)} are not in the scan"
    sentence = {
        "good": f"{length_in_words(side)} show every wave that diffracts light",
        "usable": f"{length_in_words(side)}, so {lost}; they send light out at grazing angles only",
        "poor": f"{length_in_words(side)}, so {lost}; scan a smaller field with as many pixels",
    }[light]
    if waves.gratings:
        across = waves.gratings[0].period_m / side
        light = _worst(light, _light(across, _PIXELS_A_PERIOD))
        sentence += f"; the grating has {across:.3g} pixels to a period"
    return Finding("pixel", light, sentence, side)


def _slopes(centre: np.ndarray, height_map: HeightMap) -> Finding:
    if min(centre.shape) < 2:
        return Finding("slopes", "good", "too few pixels to measure slopes", 0.0)
    dy, dx = height_map.pixel_size_m
    along_y, along_x = np.diff(centre[:, :-1], axis=0) / dy, np.diff(centre[:-1], axis=1) / dx
    steep = float((along_y**2 + along_x**2 > 1).mean())
    light = _light(steep, _STEEP_SHARE)
    slope = math.degrees(math.atan(math.sqrt(_finite_mean(along_y**2 + along_x**2))))
    sentence = f"the surface rises by {slope:.2g} deg (rms)"
    if light != "good":
        sentence += f", and {steep:.0%} of it by over 45 deg, where light meets it twice; its colours are less sure"
    return Finding("slopes", light, sentence, steep)


def _finite_mean(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else 0.0


def _period(waves: Waves) -> Finding:
    noise = ""
    if waves.noise is not None:
        is_noise = "may be line noise of the microscope"
        if waves.one_way:
            is_noise = "is line noise of the microscope, as the scan in the other direction lacks it"
        noise = f"{waves.noise.in_words()} {is_noise}, and is left out"
    if not waves.gratings:
        remedy = f"; {noise}; turn the sample by 90 deg and scan it again" if noise else "; scan another place"
        return Finding("period", "poor", f"no wave stands out that would show colours{remedy}", 0.0)
    first, *others = waves.gratings
    light = _worst(_light(first.contrast, _CONTRAST), _light(first.repeats, _REPEATS))
    sure = {"good": "sure", "usable": "likely", "poor": "a guess"}[light]
    stands = f"{first.contrast:.0f}" if first.contrast < _PLAIN else f"over {_PLAIN:.0f}"
    sentence = (
        f"{first.in_words()} is {sure}: it repeats {first.repeats:.3g} times, and stands {stands} times over the "
        "waves of its length"
    )
    if others:
        sentence += f"; fainter ones: {', '.join(wave.in_words() for wave in others)}"
    sentence += _where_seen(first.period_m)
    if noise:
        sentence += f"; {noise}"
    return Finding("period", light, sentence, first.contrast)


def _where_seen(period_m: float) -> str:
    """Where a lamp must stand for the first order of a fine period: lambda / d = sin(ti) + sin(tr), with both angles on
    one side of the normal. Empty for a period that shows colours under a lamp at the normal."""
    sines = _GREEN_M / period_m
    if sines <= 1:
        return ""
    angle = math.degrees(math.asin(min(sines / 2, 1.0)))
    return f"; green shows only on the lamp's side, with lamp and view both about {angle:.0f} deg from the normal"


def _tilt(height_map: HeightMap, plane: Plane) -> Finding:
    rises = [float(np.ptp(each)) for each in (plane.along_y, plane.along_x)]
    # From the centre of the first pixel to the centre of the last.
    runs = [max(1, n - 1) * side for n, side in zip(height_map.height_m.shape, height_map.pixel_size_m, strict=True)]
    degrees = math.degrees(math.atan(math.hypot(*(rise / run for rise, run in zip(rises, runs, strict=True)))))
    light = _light(degrees, _TILT_DEG)
    sentence = f"{degrees:.2g} deg, {length_in_words(sum(rises))} over the scan, are removed"
    if light != "good":
        sentence += "; mount the sample flatter, for levelling does not turn the surface back"
    return Finding("tilt", light, sentence, degrees)


def _dirt(surface: Surface) -> Finding:
    missing = float(np.isnan(surface.height_map.height_m).mean())
    found = defects_of(surface)
    dirt = [each for each in found if not each.belongs]
    spike = spike_of(surface, found, least=_SPIKE_TIMES[0])
    share = missing + sum(each.share for each in dirt)
    lights = _light(share, _DIRT_SHARE), _light(spike.times, _SPIKE_TIMES)
    stands = lights[1] != LIGHTS[0]
    parts = [f"{missing:.2%} of it is missing"] if missing else []
    if stands:
        off, relief = length_in_words(spike.off_m), length_in_words(spike.relief_m)
        parts.append(f"dust or a spike stands {off} off the relief of {relief}, which makes bakes larger")
    parts += [f"{each.share:.2%} of it is like {_NAMES.get(each.step, each.step)}" for each in dirt]
    words: list[str | Setting] = [", ".join(parts) or "nothing is seen"]
    if _worst(*lights) != LIGHTS[0]:
        steps = [each.step for each in dirt if not each.harm]
        steps += [spike.step] if stands and spike.step and spike.step not in steps else []
        if steps:
            words += ["; bake it with ", Setting.LEVEL, f" plane,{','.join(steps)}"]
        elif stands or dirt:
            words.append("; clean the sample and scan it again")
    harms: dict[str, list[str]] = {}
    for each in found:
        if each.harm:
            harms.setdefault("removes the grating" if each.belongs else each.harm, []).append(each.step)
    for harm, names in harms.items():
        which = f"step {names[0]}, which" if len(names) == 1 else f"steps {' and '.join(names)}, each of which"
        words.append(f"; leave out the {which} {harm}")
    return Finding("dirt", _worst(*lights), tuple(words), share)


def _steps(height_map: HeightMap) -> Finding:
    """Rate the resolution of the measured heights: the least difference between two of a sample of them."""
    rows, cols = (slice(None, None, -(-n // (SIDE // 2))) for n in height_map.height_m.shape)
    values = np.unique(height_map.height_m[rows, cols])
    gaps = np.diff(values[np.isfinite(values)])
    gaps = gaps[gaps > _ROUNDING * gaps.sum()]
    step = float(gaps.min()) if gaps.size else 0.0
    radians = 4 * math.pi * step / WAVELENGTH_MIN_M
    light = _light(radians, _STEP_RADIANS)
    if step < _FINE_STEP_M:
        return Finding("steps", light, "the heights come in steps finer than 0.01 nm", step)
    sentence = f"the heights come in steps of {step * 1e9:.2g} nm, {radians:.2g} rad of violet light's phase"
    if light != "good":
        sentence += "; export them with 16 bits or as floating point"
    return Finding("steps", light, sentence, step)


def _tip(centre: np.ndarray, height_map: HeightMap) -> Finding:
    """Rate the tip. A blunt tip widens tops by its radius and leaves valleys sharp, where its flanks meet."""
    tops, valleys = [], []
    for axis, side in enumerate(height_map.pixel_size_m):
        bend = np.diff(centre, n=2, axis=axis) / side**2
        bend = bend[np.isfinite(bend)]
        if bend.size:
            tops.append(np.percentile(-bend, _SHARPEST))
            valleys.append(np.percentile(bend, _SHARPEST))
    top, valley = max(tops, default=0.0), max(valleys, default=0.0)
    if top <= 0:
        return Finding("tip", "good", "there are no tops for the tip to round", 0.0)
    rounded = float(max(valley, 0.0) / top)
    light = _light(rounded, _ROUNDED)
    sentence = f"the sharpest tops have a radius of {length_in_words(1 / top)}"
    if light != "good":
        sentence += (
            f", and valleys are {rounded:.2g} times as sharp, as a blunt tip leaves them; use a sharper tip, or bake "
            "with "
        )
        return Finding("tip", light, (sentence, Setting.LEVEL, " plane,tip:NM, the tip's radius"), rounded)
    return Finding("tip", light, sentence, rounded)


@dataclass(frozen=True)
class Description:
    """The facts of a height map; see `describe`.

    rows, cols         the size in pixels
    pixel_size_m       (dy, dx) in metres
    height_range_m     highest minus lowest measured height in metres, after plane levelling
    height_rms_m       standard deviation of the same heights in metres
    source_range_m     highest minus lowest height in metres as measured, including the tilt
    periods_m          at most five periods in metres that diffract visibly, brightest first
    period_angles_deg  direction of each grating vector in degrees: from T, counterclockwise towards B, in (-90, 90]
    waves              all waves: gratings, waviness, fine wave and line noise
    quality            the findings that limit the scan
    channels           labels of all channels of the source"""

    rows: int
    cols: int
    pixel_size_m: tuple[float, float]
    height_range_m: float
    height_rms_m: float
    source_range_m: float
    waves: Waves
    quality: Quality
    channels: tuple[str, ...]

    @property
    def periods_m(self) -> tuple[float, ...]:
        return tuple(wave.period_m for wave in self.waves.gratings)

    @property
    def period_angles_deg(self) -> tuple[float, ...]:
        return tuple(wave.angle_deg for wave in self.waves.gratings)

    def as_dict(self) -> dict[str, object]:
        """Return the facts for JSON: tuples become lists, missing waves null."""
        waves = asdict(self.waves)
        return {
            "rows": self.rows,
            "cols": self.cols,
            "pixel_size_m": list(self.pixel_size_m),
            "height_range_m": self.height_range_m,
            "height_rms_m": self.height_rms_m,
            "source_range_m": self.source_range_m,
            "periods_m": list(self.periods_m),
            "period_angles_deg": list(self.period_angles_deg),
            "gratings": list(waves["gratings"]),
            "waviness": waves["waviness"],
            "fine": waves["fine"],
            "line_noise": waves["noise"],
            "quality": self.quality.as_dict(),
            "channels": list(self.channels),
        }

    def in_words(self) -> list[str]:
        """Describe the relief and its waves, a line each, and why a wave is or is not the grating."""
        gratings, waviness, fine, noise = self.waves.gratings, self.waves.waviness, self.waves.fine, self.waves.noise
        band = f"from {length_in_words(FINEST_PERIOD_M)} to {length_in_words(COARSEST_PERIOD_M)}"
        lines = [f"relief: {self.relief_in_words()}"]
        if gratings:
            lines.append(
                f"grating: {_told(gratings[0])}; it sends out the most light of all waves {band}, which show colours"
            )
        else:
            lines.append(f"grating: none; no wave stands out {band}, where gratings show colours")
        if noise is not None:
            reason = (
                "the scan in the other direction lacks it; compare its channel, or turn the sample"
                if self.waves.one_way
                else "scan lines that shift at random show such a wave too; if it has grooves along them, turn it"
            )
            lines.append(
                f"line noise: {_told(noise)}; not taken for a grating, as {reason} by 90 deg and scan it again"
            )
        if waviness is not None and not (gratings and waviness.amplitude_m <= gratings[0].amplitude_m):
            lines.append(
                f"waviness: {_told(waviness)}; not the grating though it is higher, for its colours leave closer "
                "together than the sun is wide"
            )
        if fine is not None and not gratings:
            lines.append(f"finer than light: {_told(fine)}; no visible light leaves by its first order")
        return lines

    def relief_in_words(self) -> str:
        """Format the relief's height: "375 nm", or, if levelling changed it, "408 nm levelled (375 nm as scanned)"."""
        level, source = (
            f"{nm:.0f} nm" if nm >= 10 else f"{nm:.2g} nm"
            for nm in (self.height_range_m * 1e9, self.source_range_m * 1e9)
        )
        return level if level == source else f"{level} levelled ({source} as scanned)"


def describe(height_map: HeightMap, other_way: Callable[[], HeightMap | None] | None = None) -> Description:
    """Measure a height map: its relief before and after plane levelling, its waves, and its quality.

    `other_way` reads the opposite scan direction (trace or retrace), levelled by the same steps, or returns None
    (`read_other_way` of readers/reader_registry.py). It is called only if a wave may be a grating. If it raises
    GratingError, the scan is described alone."""
    plane = plane_of(height_map)

    def other() -> HeightMap | None:
        try:
            found = other_way() if other_way else None
        except GratingError:
            return None
        return found and _middle(found, plane_of(found))

    waves = waves_of(_middle(height_map, plane), height_map.size_m, other=other)
    low, high, rms = _levelled(height_map, plane)
    return Description(
        rows=height_map.rows,
        cols=height_map.cols,
        pixel_size_m=height_map.pixel_size_m,
        height_range_m=high - low,
        height_rms_m=rms,
        source_range_m=float(np.nanmax(height_map.height_m) - np.nanmin(height_map.height_m)),
        waves=waves,
        quality=judge(height_map, plane, waves, reach_m=(low, high)),
        channels=height_map.channels,
    )


def _middle(height_map: HeightMap, plane: Plane) -> HeightMap:
    """Return the middle of a scan, levelled by the plane through the whole scan."""
    return replace(height_map, height_m=plane.level_part(height_map, middle_of(height_map)))


def _levelled(height_map: HeightMap, plane: Plane) -> tuple[float, float, float]:
    """Return lowest, highest and standard deviation of the levelled heights, whose mean is 0.

    It levels a few rows at a time, since all levelled heights would take as much memory as the scan."""
    lows, highs, total, count = [], [], 0.0, 0
    for start in range(0, height_map.rows, _ROWS_AT_ONCE):
        level = plane.level_part(height_map, (slice(start, start + _ROWS_AT_ONCE), slice(None)))
        level = level[np.isfinite(level)]
        count += level.size
        if level.size:
            lows.append(level.min())
            highs.append(level.max())
            total += float(level @ level)
    return float(min(lows)), float(max(highs)), math.sqrt(total / count)


def _told(wave: Wave) -> str:
    return f"{wave.in_words()}, {wave.repeats:.3g} repeats in the scan"


# Copies of a cell may differ by this share of the relief's range, the rounding errors of levelling and upsampling.
_ALIKE = 1e-6


def unit_cell(relief: Relief) -> Relief:
    """Return the smallest cell that tiles a periodic relief exactly, or else the relief itself.

    The cell has at least as many rows as columns, or all rows of the relief."""
    if not relief.periodic:
        return relief
    cols = _repeat(relief.height_m, 1, 1)
    rows = _repeat(relief.height_m, 0, min(cols, relief.height_m.shape[0]))
    apodisation_axes = relief.apodisation_axes[0][:rows], relief.apodisation_axes[1][:cols]
    return replace(relief, height_m=relief.height_m[:rows, :cols], apodisation_axes=apodisation_axes)


def _repeat(height: np.ndarray, axis: int, least: int) -> int:
    """Return the shortest period in pixels, at least `least`, of the heights along an axis."""
    count = height.shape[axis]
    allowed = _ALIKE * max(np.ptp(height), 1e-12)
    for length in range(least, count // 2 + 1):
        if count % length == 0 and np.abs(height - np.roll(height, length, axis)).max() <= allowed:
            return length
    return count


def grating_period(relief: Relief, period_m: float | None = None) -> float:
    """Return a relief's period in metres: `period_m` if given, else the unit cell's length along T, else the brightest
    period in the spectrum. Raises GratingError if there is none of the three."""
    if period_m is not None:
        return period_m
    cell = unit_cell(relief)
    if 1 < cell.height_m.shape[1] < relief.height_m.shape[1]:
        return cell.size_m[1]
    heights = HeightMap(relief.height_m[::-1], relief.pixel_size_m, "relief", periodic=relief.periodic)
    periods = describe(heights).periods_m
    if not periods:
        raise GratingError("", "the relief has no period", ("give ", Setting.PERIOD_NM))
    return periods[0]

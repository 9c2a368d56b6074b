# SPDX-License-Identifier: GPL-3.0-or-later
"""Rates whether a scan is good enough to bake: one finding for each limit, with a traffic light and a sentence."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..base.failure import Setting, Words, spelled
from ..colour.observer import WAVELENGTH_MIN_M
from .dirt import SIDE, Surface, defects_of, spike_of
from .first_order import FINEST_PERIOD_M
from .height_map import HeightMap
from .least_squares_plane import Plane
from .periods import Waves, length_in_words

LIGHTS = ("good", "usable", "poor")
# Each pair of numbers holds the limits of "good" and of "usable".
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
_NAMES = {"dust": "dust or scratches", "lines": "rows shifted as a whole"}
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
        return LIGHTS[max(LIGHTS.index(finding.light) for finding in self.findings)]

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
        light = max(light, _light(across, _PIXELS_A_PERIOD), key=LIGHTS.index)
        sentence += f"; the grating has {across:.3g} pixels to a period"
    return Finding("pixel", light, sentence, side)


def _slopes(centre: np.ndarray, height_map: HeightMap) -> Finding:
    if min(centre.shape) < 2:
        return Finding("slopes", "good", "too few pixels to tell slopes", 0.0)
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
    light = max(_light(first.contrast, _CONTRAST), _light(first.repeats, _REPEATS), key=LIGHTS.index)
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
    sentence = f"{degrees:.2g} deg, {length_in_words(sum(rises))} over the scan, are taken out"
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
    words: list[str | Setting] = [", ".join(parts) or "none is seen"]
    if max(lights, key=LIGHTS.index) != LIGHTS[0]:
        steps = [each.step for each in dirt if not each.harm]
        steps += [spike.step] if stands and spike.step and spike.step not in steps else []
        if steps:
            words += ["; bake it with ", Setting.LEVEL, f" plane,{','.join(steps)}"]
        elif stands or dirt:
            words.append("; clean the sample and scan it again")
    harms: dict[str, list[str]] = {}
    for each in found:
        if each.harm:
            harms.setdefault("takes the grating out" if each.belongs else each.harm, []).append(each.step)
    for harm, names in harms.items():
        which = f"step {names[0]}, which" if len(names) == 1 else f"steps {' and '.join(names)}, each of which"
        words.append(f"; leave out the {which} {harm}")
    return Finding("dirt", max(lights, key=LIGHTS.index), tuple(words), share)


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

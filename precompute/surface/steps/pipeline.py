# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of steps, and the pipeline of steps from a scan to its levelled heights."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.failure import GratingError
from ..height_map import HeightMap, fill_missing
from .repairs import (
    align_lines,
    background,
    calibrate,
    crop,
    invert,
    mask,
    plane,
    remove_dust,
    remove_outliers,
    remove_scars,
    remove_tip,
    rotate,
    scale_heights,
    whole_periods,
)
from .step import Done, Kind, Number, Step, Word, main_wave

# Twice the width of the largest scan.
_UM_MAX = 2e6
_RECTANGLE = tuple(Number(side, 0, _UM_MAX) for side in ("LEFT", "TOP", "RIGHT", "BOTTOM"))


# The largest share of missing points that needs no warning. A step that removes more points warns by itself.
_MISSING_MOST = 0.2


def _fill(height_map: HeightMap) -> Done:
    told = _missing(height_map)
    return Done(fill_missing(height_map), told, warns=bool(told))


def _missing(height_map: HeightMap) -> str:
    """A message if so many points are missing that filling them makes the colours a guess, or ""."""
    share = float(np.isnan(height_map.height_m).mean())
    remedy = "scan again, or crop to the measured part"
    return f"{share:.2%} of the points are missing and filled in; {remedy}" if share > _MISSING_MOST else ""


KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind("plane", "remove the tilt; robust: ignores dust", plane, (Word(("least-squares", "robust")),)),
        Kind("poly", "remove a polynomial background of this degree", background, (Number("DEGREE", 1, 5, 2, True),)),
        Kind("lines", "shift each scan line (left to right) to fit; erases grooves along it", align_lines,
             (Word(("median", "difference")),)),
        Kind("scars", "streaks along scan lines, by K times the rms difference of lines and 3 nm or more", remove_scars,
             (Number("K", 0.1, 100, 1.0),)),
        Kind("outliers", "single pixels, by K standard deviations", remove_outliers, (Number("K", 1, 1000, 8.0),)),
        Kind("dust", "dust and scratches, by K standard deviations of the relief", remove_dust,
             (Number("K", 1, 1000, 5.0),)),
        Kind("fill", "fill holes here instead of after the last step", _fill),
        Kind("rotate", "turn counterclockwise by DEG", rotate, (Number("DEG", -360, 360),)),
        Kind("crop", "keep a rectangle, in um from the left and upper edge", crop, _RECTANGLE),
        Kind("periods", "crop to whole periods of the grating", whole_periods),
        Kind("mask", "mark a rectangle as missing, in um from the left and upper edge", mask, _RECTANGLE),
        Kind("invert", "turn heights into depths", invert),
        Kind("calibrate", "scale the pixels to a grating of NM", calibrate, (Number("NM", 1, 1e6),)),
        Kind("zscale", "multiply heights by FACTOR", scale_heights, (Number("FACTOR", 1e-3, 1e3),)),
        Kind("tip", "undo the rounding by a tip of radius NM", remove_tip, (Number("NM", 0.1, 1e4),)),
    )
}  # fmt: skip
# The steps if the user asks for no others.
DEFAULT = (KINDS["plane"].read([], "default"),)
# The start of a message about harm.
WARNING = "warning: "
# The word for no step.
NONE = "none"
_STEPS_MAX = 50


@dataclass(frozen=True)
class Levelled:
    """Heights after the steps, with NaN in holes, and the steps' messages, a line each; warnings start with WARNING."""

    height_map: HeightMap
    told: tuple[str, ...]


def level(height_map: HeightMap, steps: Sequence[Step] = DEFAULT) -> Levelled:
    """Carry out steps in order, by default `plane`, which subtracts the least-squares plane.

    Raises GratingError, naming the source, for a step that does not suit the scan.

    >>> levelled = level(read_height_map("sample:elaphe"), parse_steps("plane,dust"))
    >>> levelled.height_map.height_m.shape, levelled.told
    ((800, 800), ('dust:5: 0.15% of the pixels become holes, which are filled',))"""
    told = []
    for step in steps:
        done = step.carry_out(height_map)
        height_map = done.height_map
        if done.told:
            told.append(f"{WARNING if done.warns else ''}{step.text}: {done.told}")
    if missing := _missing(height_map):
        told.append(f"{WARNING}{missing}")
    return Levelled(height_map, tuple(told))


def parse_steps(text: str, source: str = "--level") -> tuple[Step, ...]:
    """Parse a text like "plane,poly:2,dust"; "none" gives no steps. Raises GratingError as steps_of does.

    >>> [step.text for step in parse_steps("plane,poly,dust:6")]
    ['plane', 'poly:2', 'dust:6']"""
    return () if text == NONE else steps_of(text.split(","), source)


def steps_of(texts: Sequence[str], source: str) -> tuple[Step, ...]:
    """Parse steps of one text each. Raises GratingError for unknown steps, wrong arguments, and too many steps."""
    if len(texts) > _STEPS_MAX:
        raise GratingError(source, f"{len(texts)} steps", f"give at most {_STEPS_MAX}")
    found = []
    for text in texts:
        name, *arguments = text.split(":") if isinstance(text, str) else ("",)
        if name not in KINDS:
            raise GratingError(source, "no such step", f"give one of {', '.join(KINDS)}")
        found.append(KINDS[name].read(arguments, source))
    return tuple(found)


def help_text() -> str:
    """Describe all steps in one sentence."""
    return "; ".join(f"{kind.form}: {kind.help}" for kind in KINDS.values())


# A sharp tip, in nanometres.
_TIP_NM = 10.0


def _whole(height_map: HeightMap) -> tuple[float, ...]:
    """Return the rectangle of the whole scan, in micrometres."""
    ly, lx = height_map.size_m
    return 0.0, 0.0, lx * 1e6, ly * 1e6


def _middle(height_map: HeightMap) -> tuple[float, ...]:
    """Return a rectangle in the scan's middle, a tenth of its sides, in micrometres."""
    ly, lx = height_map.size_m
    return 0.45e6 * lx, 0.45e6 * ly, 0.55e6 * lx, 0.55e6 * ly


_VALUES: dict[str, Callable[[HeightMap], tuple[float, ...]]] = {
    "rotate": lambda _: (0.0,),
    "crop": _whole,
    "mask": _middle,
    "calibrate": lambda height_map: (main_wave(height_map, "calibrate").period_m * 1e9,),
    "zscale": lambda _: (1.0,),
    "tip": lambda _: (_TIP_NM,),
}


def first_step(name: str, height_map: HeightMap) -> Step:
    """Make a step for a scan, with its defaults or with values that suit the scan.

    Raises GratingError if the scan has no grating to calibrate by."""
    values = _VALUES[name](height_map) if name in _VALUES else ()
    return KINDS[name].read([f"{value:.5g}" for value in values], height_map.source)

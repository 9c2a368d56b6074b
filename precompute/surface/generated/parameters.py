# SPDX-License-Identifier: GPL-3.0-or-later
"""The parameters of a grating, and their text: grating:KIND?NAME=VALUE&NAME=VALUE."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from ...base.failure import GratingError, printable
from ..height_map import GRATING_PREFIX
from .kinds import KINDS, PARAMETERS, PERIOD_UNITS, Kind

# The longest text in characters. A text with every parameter has about 200.
_LONGEST = 500
# Messages show this many characters of a faulty text.
_SHOWN = 60
_DEPTH_MAX_NM = PARAMETERS["depth_nm"].high
# The name of a grating's bake as a file (height_map.py).
_STEM = re.compile(r"grating_([a-z]+)_period_um=(\d{1,9}(?:\.\d{1,9})?)(?![\d.])")


@dataclass(frozen=True)
class GratingParameters:
    """The parameters of a grating, with the units of their names; 0 for a parameter that the kind lacks.

    kinds.py explains and limits each. An echelle's depth follows from its period and its angle."""

    kind: str
    period_um: float
    depth_nm: float
    angle_deg: float = 0.0
    duty: float = 0.0
    bit_nm: float = 0.0
    roundness: float = 0.0
    modulation_nm: float = 0.0
    wave_um: float = 0.0
    period_disorder: float = 0.0
    depth_disorder: float = 0.0
    direction_disorder_deg: float = 0.0
    seed: int = 0

    @property
    def period_m(self) -> float:
        """The period in metres."""
        return self.period_um / 1e6

    @property
    def depth_m(self) -> float:
        """The depth in metres."""
        return self.depth_nm / 1e9

    @property
    def is_regular(self) -> bool:
        """Whether all lines are alike."""
        return not (self.period_disorder or self.depth_disorder or self.direction_disorder_deg or self.modulation_nm)

    @property
    def text(self) -> str:
        """The canonical text. It has all values, since defaults may change, except zeros that are defaults."""
        return text_of(self.kind, {name: getattr(self, name) for name in KINDS[self.kind].defaults})

    @property
    def title(self) -> str:
        """A short name: kind and period."""
        return f"{KINDS[self.kind].title} {self.period_um:.4g} um"


def title_of_stem(stem: str) -> str:
    """A name for what was baked, by the file's name without extension: the title of a synthetic surface, else the
    file's name as one printable line."""
    found = _STEM.match(stem)
    if found is None or found[1] not in KINDS:
        return printable(stem)
    return f"{KINDS[found[1]].title} {float(found[2]):.4g} um"


def text_of(kind: str, values: Mapping[str, float]) -> str:
    """Write the text of a grating of a known kind. Values that are not given have their defaults."""
    defaults = KINDS[kind].defaults
    every = {name: values.get(name, defaults[name]) for name in PARAMETERS if name in defaults}
    written = [f"{name}={PARAMETERS[name].write(v)}" for name, v in every.items() if v or defaults[name]]
    return f"{GRATING_PREFIX}{kind}?{'&'.join(written)}"


def parse_grating(text: str) -> GratingParameters:
    """Parse "grating:KIND?NAME=VALUE&...". Parameters that are not given have the kind's defaults.

    Raises GratingError for an unknown kind or parameter, a value out of range, and lines that do not fit together."""
    shown = text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."
    if len(text) > _LONGEST:
        raise GratingError(shown, f"a text of {len(text)} characters", f"give at most {_LONGEST}")
    name, mark, rest = text.removeprefix(GRATING_PREFIX).partition("?")
    if name not in KINDS:
        raise GratingError(shown, "there is no such kind of grating", f"choose one of {', '.join(KINDS)}")
    kind = KINDS[name]
    values = dict(kind.defaults)
    given: set[str] = set()
    for pair in rest.split("&") if mark else ():
        parameter, value = _read(pair, kind, shown)
        if parameter in given:
            what = f"the period, by {', '.join(PERIOD_UNITS)}," if parameter == "period_um" else parameter
            raise GratingError(shown, f"{what} is given twice", "give it once")
        given.add(parameter)
        values[parameter] = value
    return _checked(name, values, shown)


def canonical(source: str) -> str:
    """The canonical text of a grating, so that equal gratings have equal names. Other sources, and texts that are no
    grating, stay as they are."""
    if not source.startswith(GRATING_PREFIX):
        return source
    try:
        return parse_grating(source).text
    except GratingError:
        return source


def _read(pair: str, kind: Kind, shown: str) -> tuple[str, float]:
    """Parse NAME=VALUE. The period in any unit becomes period_um."""
    name, mark, text = pair.partition("=")
    if name not in PERIOD_UNITS and name not in kind.defaults:
        units = ", ".join(unit for unit in PERIOD_UNITS if unit not in kind.defaults)
        raise GratingError(
            shown, f"{kind.title} has no parameter {name[:20]!r}", f"give {', '.join(kind.defaults)}, {units}"
        )
    number, scale, power = PERIOD_UNITS.get(name) or (PARAMETERS[name], 1.0, 1)
    value = number.read(text) if mark else None
    if value is None:
        raise GratingError(
            shown, f"{name}: cannot be {text[:20]!r}", f"give {number.wanted()}, as {name}={number.low:g}"
        )
    if name not in PERIOD_UNITS:
        return name, value
    # Twelve digits, as `Number` reads and writes them.
    return "period_um", float(f"{scale * value**power:.12g}")


def _checked(kind: str, values: dict[str, float], shown: str) -> GratingParameters:
    """Make the parameters of valid values. Raises GratingError if the values do not fit together."""
    others = {name: value for name, value in values.items() if name != "seed"}
    if "depth_nm" not in others:
        angle = math.radians(others["angle_deg"])
        others["depth_nm"] = 1e3 * others["period_um"] * math.sin(angle) * math.cos(angle)
    made = GratingParameters(kind, **others, seed=int(values["seed"]))
    if made.depth_nm > _DEPTH_MAX_NM:
        raise GratingError(
            shown,
            f"facets of {made.depth_nm:.0f} nm are deeper than {_DEPTH_MAX_NM:g} nm",
            "lower angle_deg or the period",
        )
    swing_um = made.modulation_nm * 1e-3
    if made.duty * made.period_um + 2 * swing_um > made.period_um:
        raise GratingError(shown, "neighbouring grooves would run into each other", "lower duty or modulation_nm")
    return made

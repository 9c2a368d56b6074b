# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a bake that serves several lamps, and how far off a lamp's colours are under another bake."""

import re
from collections.abc import Iterable, Mapping

from ..base.failure import GratingError
from .illuminants import FIRST, JOINT, OWN_MAX, canonical, parts_of

# Spectra as smooth as a black body's or daylight's.
_SMOOTH = re.compile("A|C|D[0-9]+|[0-9]+K")
_BLACK_BODY, _DAYLIGHT = re.compile("([0-9]+)K"), re.compile("D([0-9]{4,})")


def light_for(lamps: Iterable[str]) -> str:
    """The canonical text of the light under which a bake serves lamps (canonical texts): a set of channels for black
    bodies, daylight and LEDs, and own colours for tubes, lines and files.

    Raises GratingError if more lamps need colours of their own than a bake can have."""
    others = sorted({lamp for lamp in lamps if lamp != FIRST})
    own = [lamp for lamp in others if not (_SMOOTH.fullmatch(lamp) or lamp.startswith("LED-"))]
    if len(own) > OWN_MAX:
        told = ", ".join(f"{lamp:.20}" for lamp in own)
        raise GratingError(told, f"a bake has colours of their own for {OWN_MAX} lamps", "use fewer kinds of lamps")
    sets = ["led"] if any(lamp.startswith("LED-") for lamp in others) else ["smooth"] if len(others) > len(own) else []
    return canonical(JOINT.join([FIRST, *sets, *own])) if others else FIRST


def stated_error(lamp: str, light: str, stated: Mapping[str, tuple[float, float]]) -> tuple[float, float] | None:
    """The mean and the 95th percentile of dE00 under a lamp of a bake under a light, from those that its header states
    by lamp; None if nothing is stated. A lamp takes the error of one of its kind; a black body's is interpolated."""
    if not stated or lamp in parts_of(light):
        return None
    if lamp in stated:
        return stated[lamp]
    if kelvins := _BLACK_BODY.fullmatch(lamp):
        return _interpolated(1e6 / int(kelvins[1]), stated)
    if _SMOOTH.fullmatch(lamp):
        found = _DAYLIGHT.fullmatch(lamp)
        near = "D5500" if found is None or int(found[1]) < 7000 else "10000K"
        return stated.get(near)
    bands = {name: pair for name, pair in stated.items() if not _SMOOTH.fullmatch(name)}
    alike = [pair for name, pair in bands.items() if name.startswith("LED-") == lamp.startswith("LED-")]
    return max(alike, key=lambda pair: pair[1], default=None)


def _interpolated(mired: float, stated: Mapping[str, tuple[float, float]]) -> tuple[float, float] | None:
    """The error of a black body between the two stated ones around it, linear in mireds."""
    found = [(1e6 / int(match[1]), pair) for name, pair in stated.items() if (match := _BLACK_BODY.fullmatch(name))]
    below = max((each for each in found if each[0] <= mired), default=min(found, default=None))
    above = min((each for each in found if each[0] >= mired), default=max(found, default=None))
    if below is None or above is None:
        return None
    (low, first), (high, second) = below, above
    share = (mired - low) / (high - low) if high > low else 0.0
    share = min(max(share, 0.0), 1.0)
    return first[0] + share * (second[0] - first[0]), first[1] + share * (second[1] - first[1])

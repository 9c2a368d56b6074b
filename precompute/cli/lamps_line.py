# SPDX-License-Identifier: GPL-3.0-or-later
"""The line of a verb's summary on a bake's colours under lamps of other spectra."""

from collections.abc import Mapping
from typing import Any

from ..colour.illuminants import FIRST

# A lamp of each kind: a household bulb, an LED lamp and a fluorescent tube.
_OF_EACH_KIND = ("2700K", "LED-B1", "FL11")
# The warm lamp, and the dE00 beyond which a plain bake's 95th percentile gets a remedy: twice what an eye sees.
_WARM, _FAR_OFF = "2700K", 2.0


def lamps_line(errors: Mapping[str, tuple[float, float]]) -> str:
    """The line on the mean dE00 and the 95th percentile of lamps; "" without a lamp."""
    each = ", ".join(f"{lamp:.40} {mean:.1f} and {p95:.1f}" for lamp, (mean, p95) in errors.items())
    return f"under other lamps (mean dE00, 95th percentile): {each}" if errors else ""


def line_of_bake(delta_e: Mapping[str, Any], illuminant: str) -> str:
    """The line on the lamps in a bake's errors; "" if it has none. It names a remedy where daylight's bake is far off
    under a warm lamp."""
    told = delta_e.get("lamps")
    errors = (
        {lamp: told[lamp] for lamp in _OF_EACH_KIND if _are_errors(told.get(lamp))} if isinstance(told, dict) else {}
    )
    far_off = illuminant == FIRST and errors.get(_WARM, (0.0, 0.0))[1] > _FAR_OFF
    return lamps_line(errors) + "; --illuminant smooth or led holds them" * far_off


def _are_errors(value: object) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(type(each) in (int, float) for each in value)

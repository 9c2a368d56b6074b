# SPDX-License-Identifier: GPL-3.0-or-later
"""The hologram of a preset: a pattern of directions and periods that its material begins with.

The patterns are node groups of the add-on (addon/materials/holograms/patterns.py); a pattern from a picture needs a
file, so no preset has it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import Any

from ..base.failure import GratingError
from ..base.strict_json import number_in

_RANDOM = {"Period Spread": (1.0, 4.0), "Seed": (0.0, 1000.0)}
_TURN = {"Turn": (0.0, pi / 2)}
_CENTRE = {"Center X": (-1e3, 1e3), "Center Y": (-1e3, 1e3)}
# The patterns, and their inputs with their limits. Angles are in radians.
PATTERNS: dict[str, dict[str, tuple[float, float]]] = {
    "dot_matrix": {"Cells": (1.0, 1e5)} | _TURN | _RANDOM,
    "sunburst": {"Twist": (-pi / 2, pi / 2), "Sectors": (0.0, 1000.0)} | _CENTRE | _RANDOM,
    "crystal": {"Shards": (0.1, 1e5), "Randomness": (0.0, 1.0)} | _TURN | _RANDOM,
}
_KEYS = ("pattern", "inputs")


@dataclass(frozen=True)
class PresetHologram:
    """A pattern, one of PATTERNS, and values for its inputs. The other inputs keep their defaults."""

    pattern: str
    inputs: Mapping[str, float]

    def as_dict(self) -> dict[str, Any]:
        """The hologram as in a preset's file."""
        return {"pattern": self.pattern, "inputs": dict(self.inputs)}


def hologram_from(record: object, source: str) -> PresetHologram:
    """The hologram in a JSON record. Raises GratingError, with `source`, for a faulty one."""
    if not isinstance(record, Mapping) or "pattern" not in record:
        raise GratingError(source, f"hologram: cannot be {record!r:.30}", "give an object with pattern")
    for key in record:
        if key not in _KEYS:
            raise GratingError(source, f"hologram: {key:.40}: no such key", f"there are {', '.join(_KEYS)}")
    pattern, inputs = record["pattern"], record.get("inputs", {})
    if not isinstance(pattern, str) or pattern not in PATTERNS:
        raise GratingError(
            source, f"hologram: pattern: cannot be {pattern!r:.30}", f"give one of {', '.join(PATTERNS)}"
        )
    return PresetHologram(pattern, numbers_in(inputs, PATTERNS[pattern], source, part="hologram: inputs"))


def numbers_in(record: object, known: Mapping[str, tuple[float, float]], source: str, *, part: str) -> dict[str, float]:
    """The numbers in a JSON record, whose names and limits are `known`. Raises GratingError, with `source`, the part of
    the file and the name, for an unknown name or a value out of its limits."""
    if not isinstance(record, Mapping):
        raise GratingError(source, f"{part}: cannot be {record!r:.30}", "give an object of names and numbers")
    for name in record:
        if name not in known:
            raise GratingError(source, f"{part}: {name:.40}: no such input", f"there are {', '.join(known)}")
    return {name: number_in(source, f"{part}: {name}", value, limits=known[name]) for name, value in record.items()}

# SPDX-License-Identifier: GPL-3.0-or-later
"""How a grating varies over a skin: patches of further gratings, and slow turns. Saved files contain these names."""

from dataclasses import asdict, dataclass, replace
from math import degrees
from typing import Any

from ..blender import stored
from .wording import translated

NOISE, ATTRIBUTE = "NOISE", "ATTRIBUTE"
# Identifier, label and tooltip, as in Blender's enumerations.
PATTERNS = (
    (NOISE, "Noise", "In random patches that blend into each other"),
    (ATTRIBUTE, "Attribute", "By an attribute of the mesh from 0 to 1: one that you painted, or scale_random of "
     "Add > Mesh > Snake, one number per scale"),
)  # fmt: skip

# More further gratings than the interface or the command line offers.
_SHARES_MAX = 8


@dataclass(frozen=True)
class Variation:
    """A chosen variation.

    shares     share of the surface of each further grating; the first grating has the rest
    pattern    one of PATTERNS: how the gratings are distributed
    attribute  of ATTRIBUTE: its name
    softness   width of the transition between gratings, as a share of the surface
    turn       largest turn of the direction to either side, in radians
    size_m     width of the patches of NOISE and of the turns, in the object's space, in metres"""

    shares: tuple[float, ...] = ()
    pattern: str = NOISE
    attribute: str = ""
    softness: float = 0.0
    turn: float = 0.0
    size_m: float = 1.0

    @property
    def pattern_attribute(self) -> str:
        """The name of the attribute that distributes the gratings; empty for none."""
        return self.attribute if self.shares and self.pattern == ATTRIBUTE else ""

    def of_others(self, count: int) -> "Variation":
        """The variation with at most `count` further gratings; the first grating takes over the other shares."""
        return replace(self, shares=self.shares[:count])

    @property
    def summary(self) -> str:
        """A short description of the variation."""
        told = []
        if self.shares:
            told.append(" + ".join(f"{share:.0%}" for share in (1.0 - sum(self.shares), *self.shares)))
        if self.turn:
            told.append(translated("turned by {angle}", angle=f"{degrees(self.turn):.3g}°"))
        return ", ".join(told) or translated("None")

    def as_property(self) -> dict[str, Any]:
        """The variation as a value for a custom property."""
        return asdict(self) | {"shares": [float(share) for share in self.shares]}

    @classmethod
    def from_property(cls, held: stored.Record | None) -> "Variation":
        """The variation stored in a custom property; no variation if there is none."""
        if held is None:
            return cls()
        shares = stored.some_numbers(held, "shares", _SHARES_MAX)
        is_sound = all(share >= 0 for share in shares) and sum(shares) <= 1.0 + 1e-6
        return cls(
            shares=shares if is_sound else (),
            pattern=stored.choice(held.get("pattern"), (NOISE, ATTRIBUTE), NOISE),
            attribute=stored.text(held, "attribute"),
            softness=stored.number(held, "softness", low=0.0),
            turn=stored.number(held, "turn"),
            size_m=stored.number(held, "size_m", 1.0, low=1e-9),
        )

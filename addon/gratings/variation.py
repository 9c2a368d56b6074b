# SPDX-License-Identifier: GPL-3.0-or-later
"""How a grating varies over a skin: further gratings beside it, patch by patch, and a slow turn of its direction.
Saved .blend files hold these names: they must stay."""

from dataclasses import asdict, dataclass, replace
from math import degrees
from typing import Any

from ..blender import stored

NOISE, ATTRIBUTE = "NOISE", "ATTRIBUTE"
# Name, label and tooltip, as Blender's enumerations want them.
PATTERNS = (
    (NOISE, "Noise", "In patches that run into each other"),
    (ATTRIBUTE, "Attribute", "By a number from 0 to 1 that the mesh holds, such as scale_random, one for each scale of "
     "Add > Mesh > Snake, or a painted one"),
)  # fmt: skip

# More further gratings than any button or verb offers.
_SHARES_MAX = 8


@dataclass(frozen=True)
class Variation:
    """A choice.

    shares     the share of the surface that each further grating has; the first has the rest
    pattern    one of PATTERNS: by which the shares are laid out
    attribute  of ATTRIBUTE: its name
    softness   how wide the gratings run into each other, in shares of the surface
    turn       the most by which the direction turns to either side, in radians
    size_m     the width of the patches of NOISE and of those in which the direction turns, in the object's space"""

    shares: tuple[float, ...] = ()
    pattern: str = NOISE
    attribute: str = ""
    softness: float = 0.0
    turn: float = 0.0
    size_m: float = 1.0

    @property
    def pattern_attribute(self) -> str:
        """The name of the attribute by which the gratings are laid out; empty for none."""
        return self.attribute if self.shares and self.pattern == ATTRIBUTE else ""

    def of_others(self, count: int) -> "Variation":
        """The choice with this number of further gratings at most: the first has the others' shares as well."""
        return replace(self, shares=self.shares[:count])

    @property
    def summary(self) -> str:
        """The choice in a few words."""
        told = []
        if self.shares:
            told.append(" + ".join(f"{share:.0%}" for share in (1.0 - sum(self.shares), *self.shares)))
        if self.turn:
            told.append(f"turned by {degrees(self.turn):.3g}°")
        return ", ".join(told) or "None"

    def as_property(self) -> dict[str, Any]:
        """The choice as a custom property holds it."""
        return asdict(self) | {"shares": [float(share) for share in self.shares]}

    @classmethod
    def from_property(cls, held: stored.Record | None) -> "Variation":
        """The choice that a custom property holds; no variation where there is none."""
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

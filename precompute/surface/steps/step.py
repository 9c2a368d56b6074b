# SPDX-License-Identifier: GPL-3.0-or-later
"""The step: its name, its arguments as text and as values, and its function.

As text, a step is its name and its arguments, separated by colons: `plane`, `poly:2`, `crop:0:0:20:10`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...base.failure import GratingError
from ..height_map import HeightMap

_IN_NUMBERS = frozenset("+-.0123456789eE")
# The longest number in characters.
_LONGEST = 40


@dataclass(frozen=True)
class Done:
    """The result of a step.

    told   a message to the user about the step's effect, or ""
    warns  whether the message is a warning of harm to the bake"""

    height_map: HeightMap
    told: str = ""
    warns: bool = False


@dataclass(frozen=True)
class Number:
    """A numeric argument of a step, from low to high.

    name     placeholder in the help, usually the unit
    default  value of an omitted argument; None if it is required
    whole    whether it must be a whole number"""

    name: str
    low: float
    high: float
    default: float | None = None
    whole: bool = False

    def read(self, text: str) -> float | None:
        """Parse a number; None if the text is no number, or out of range."""
        if len(text) > _LONGEST or not text or not _IN_NUMBERS.issuperset(text):
            return None
        try:
            # `write` also keeps twelve digits, so a step read from its own text is the same step.
            value = float(f"{float(text):.12g}")
        except ValueError:
            return None
        return value if self.low <= value <= self.high and not (self.whole and value % 1) else None

    def write(self, value: float | str) -> str:
        """Format the number."""
        return f"{value:.12g}"

    def wanted(self) -> str:
        """Describe the valid numbers, for a message."""
        return f"{self.name}, {'a whole' if self.whole else 'a'} number from {self.low:g} to {self.high:g}"


@dataclass(frozen=True)
class Word:
    """A word argument of a step, one of a few; the first is the default."""

    words: tuple[str, ...]

    @property
    def name(self) -> str:
        """The placeholder in the help."""
        return "|".join(self.words)

    @property
    def default(self) -> str:
        """The word if none is given."""
        return self.words[0]

    def read(self, text: str) -> str | None:
        """Return the word if it is valid, else None."""
        return text if text in self.words else None

    def write(self, value: float | str) -> str:
        """Return the word."""
        return str(value)

    def wanted(self) -> str:
        """Describe the valid words, for a message."""
        return f"one of {', '.join(self.words)}"


@dataclass(frozen=True)
class Kind:
    """A kind of step.

    help       its effect, in a few words
    carry_out  its function of a height map and the arguments' values, in order"""

    name: str
    help: str
    carry_out: Callable[..., Done]
    arguments: tuple[Number | Word, ...] = ()

    @property
    def form(self) -> str:
        """The syntax, with optional parts in brackets: `dust[:K]`."""
        parts = (f":{each.name}" if each.default is None else f"[:{each.name}]" for each in self.arguments)
        return self.name + "".join(parts)

    def read(self, texts: list[str], source: str) -> Step:
        """Make the step with the arguments `texts`. Raises GratingError, naming `source`, for wrong arguments."""
        if len(texts) > len(self.arguments):
            takes = f"at most {len(self.arguments)}" if self.arguments else "none"
            raise GratingError(source, f"{self.name}: {len(texts)} arguments", f"give {takes}, as {self.form}")
        values = []
        for index, argument in enumerate(self.arguments):
            value = argument.read(texts[index]) if index < len(texts) else argument.default
            if value is None:
                raise GratingError(
                    source, f"{self.name}: no such argument", f"give {argument.wanted()}, as {self.form}"
                )
            values.append(value)
        return Step(self, tuple(values))


@dataclass(frozen=True)
class Step:
    """A step of a pipeline: its kind and its arguments' values."""

    kind: Kind
    values: tuple[float | str, ...] = ()

    @property
    def text(self) -> str:
        """The step as text, without default words, but with all numbers, since their defaults may change."""
        written = (
            argument.write(value)
            for argument, value in zip(self.kind.arguments, self.values, strict=True)
            if isinstance(argument, Number) or value != argument.default
        )
        return ":".join((self.kind.name, *written))

    def carry_out(self, height_map: HeightMap) -> Done:
        """Apply the step. Raises GratingError, naming the source, if the step does not suit the heights."""
        return self.kind.carry_out(height_map, *self.values)

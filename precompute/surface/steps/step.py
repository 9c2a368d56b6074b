# SPDX-License-Identifier: GPL-3.0-or-later
"""What a step is: its name, its arguments as text and as values, and the function that carries it out.

As text a step is its name and its arguments, parted by colons: `plane`, `poly:2`, `crop:0:0:20:10`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...base.failure import GratingError
from ..height_map import HeightMap

_IN_NUMBERS = frozenset("+-.0123456789eE")
# No number that is meant is written longer than this.
_LONGEST = 40


@dataclass(frozen=True)
class Done:
    """What a step has made of a height map.

    height_map  the new heights
    told        what it did to the surface, for the user to judge; "" where there is nothing to judge
    warns       whether that may harm the bake"""

    height_map: HeightMap
    told: str = ""
    warns: bool = False


@dataclass(frozen=True)
class Number:
    """A number that a step takes, from low to high.

    name     what stands for it in the help, with its unit
    default  its value where it is left out; None where it must be given
    whole    whether it counts something"""

    name: str
    low: float
    high: float
    default: float | None = None
    whole: bool = False

    def read(self, text: str) -> float | None:
        """The number that a text holds; None for a text that holds none, or one out of range."""
        if len(text) > _LONGEST or not text or not _IN_NUMBERS.issuperset(text):
            return None
        try:
            # Twelve digits are what is written again, so that a step read from its own text is the same step.
            value = float(f"{float(text):.12g}")
        except ValueError:
            return None
        return value if self.low <= value <= self.high and not (self.whole and value % 1) else None

    def write(self, value: float | str) -> str:
        """The number as text."""
        return f"{value:.12g}"

    def wanted(self) -> str:
        """What may be given, for a message."""
        return f"{self.name}, {'a whole' if self.whole else 'a'} number from {self.low:g} to {self.high:g}"


@dataclass(frozen=True)
class Word:
    """One of a few words that a step takes; the first of them where it is left out."""

    words: tuple[str, ...]

    @property
    def name(self) -> str:
        """What stands for it in the help."""
        return "|".join(self.words)

    @property
    def default(self) -> str:
        """The word where none is given."""
        return self.words[0]

    def read(self, text: str) -> str | None:
        """The word, or None for another."""
        return text if text in self.words else None

    def write(self, value: float | str) -> str:
        """The word as text."""
        return str(value)

    def wanted(self) -> str:
        """What may be given, for a message."""
        return f"one of {', '.join(self.words)}"


@dataclass(frozen=True)
class Kind:
    """A kind of step.

    name       what it is called by
    help       what it does, in a few words
    carry_out  the function that does it, of a height map and of the arguments' values in their order
    arguments  what it takes"""

    name: str
    help: str
    carry_out: Callable[..., Done]
    arguments: tuple[Number | Word, ...] = ()

    @property
    def form(self) -> str:
        """How it is written: `dust[:K]`, where what stands in brackets may be left out."""
        parts = (f":{each.name}" if each.default is None else f"[:{each.name}]" for each in self.arguments)
        return self.name + "".join(parts)

    def read(self, texts: list[str], source: str) -> Step:
        """The step of this kind with the arguments `texts`. Raises GratingError, naming `source`, for other ones than
        it takes."""
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
    """A step of a pipeline: its kind, and its arguments' values."""

    kind: Kind
    values: tuple[float | str, ...] = ()

    @property
    def text(self) -> str:
        """The step as text.

        Every number is written, so that the text keeps its meaning if a default changes. A word is left out where it is
        the default."""
        written = (
            argument.write(value)
            for argument, value in zip(self.kind.arguments, self.values, strict=True)
            if isinstance(argument, Number) or value != argument.default
        )
        return ":".join((self.kind.name, *written))

    def carry_out(self, height_map: HeightMap) -> Done:
        """Do it. Raises GratingError, naming the source, where the step does not fit the heights."""
        return self.kind.carry_out(height_map, *self.values)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The step: its name, its arguments as text and as values, its function, and the loss of the grating that it causes.

As text, a step is its name and its arguments, separated by colons: `plane`, `poly:2`, `crop:0:0:20:10`."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.failure import GratingError
from ..height_map import HeightMap, fill_missing, level_plane
from ..periods import Wave, amplitude_at, waves_of

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


# The least visible loss, as a share of the strongest wave's light. Losing half of a fainter wave gives a warning too.
_SEEN = 0.05
_HALF = 0.5


def told_loss(before: HeightMap, after: HeightMap, told: str = "", *, holes: float = 0.0) -> Done:
    """Return the heights `after` a step, with a warning if the step weakens the grating.

    Both maps have the same pixels. `told` is another message; `holes` is the share of the scan turned into holes."""
    level = level_plane(before)
    weakens = loss_in_words(losses_of(level, level_plane(after), waves_of(level).gratings), holes)
    if not weakens:
        return Done(after, told)
    weakens += "; leave this step out to keep the colours"
    return Done(after, f"{told}; {weakens}" if told else weakens, warns=True)


def losses_of(before: HeightMap, after: HeightMap, waves: Sequence[Wave]) -> list[tuple[Wave, float]]:
    """Measure the share of each wave's power that a step removes from levelled heights; both maps have equal pixels."""
    # Filled as for a bake.
    heights = [fill_missing(each).height_m for each in (before, after)] if waves else []
    powers = [[_power(height, before.size_m, wave) for height in heights] for wave in waves]
    return [(wave, 1 - last / first if first else 0.0) for wave, (first, last) in zip(waves, powers, strict=True)]


def loss_in_words(losses: Sequence[tuple[Wave, float]], holes: float = 0.0) -> str:
    """Describe the waves, given strongest first, with a visible loss of light; "" if there are none."""
    seen = [
        (wave, loss)
        for wave, loss in losses
        if _beyond(wave, loss, holes) >= min(_HALF, _SEEN * losses[0][0].light / wave.light)
    ]
    main = [f"the main peak of the grating ({wave.in_words()}) by {loss:.0%}" for wave, loss in seen[:1]
            if wave is losses[0][0]]  # fmt: skip
    fainter = ", ".join(f"{wave.in_words()} by {loss:.0%}" for wave, loss in seen[len(main) :])
    parts = [*main, *([f"fainter waves of the grating ({fainter})"] if fainter else [])]
    return f"weakens {' and '.join(parts)}" if parts else ""


def _beyond(wave: Wave, loss: float, holes: float) -> float:
    """Return the share of a wave's power lost beyond what holes anywhere in the scan would take.

    Holes are filled smoothly, so they take their share of the amplitude. Their former content, such as dust, adds as
    much amplitude to the peak as to the waves around it, and its removal changes the power by twice that share."""
    return 1 - (1 - loss) / (1 - holes) ** 2 - 2 / math.sqrt(wave.contrast) if holes else loss


def _power(height: np.ndarray, size_m: tuple[float, float], wave: Wave) -> float:
    """Return the power of a wave in levelled heights (rows, cols) of sides size_m (Ly, Lx), under a Hann window."""
    angle = math.radians(wave.angle_deg)
    # The row index runs along -B.
    cycles = -math.sin(angle) * size_m[0] / wave.period_m, math.cos(angle) * size_m[1] / wave.period_m
    return abs(amplitude_at(height, cycles)) ** 2


# A harmonic has twice or three times the frequency of its grating, to about a bin of the spectrum.
_HARMONICS = (3, 2)
_BINS = 1.0


def main_wave(height_map: HeightMap, step: str) -> Wave:
    """Return the brightest wave, or its fundamental if it is a harmonic. Raises GratingError if there is no grating."""
    waves = waves_of(level_plane(height_map))
    if not waves.gratings:
        raise GratingError(height_map.source, f"{step}: no grating stands out of the scan", f"leave {step} out")
    first, *others = waves.gratings
    slower = [*others]
    if waves.waviness is not None and waves.waviness.amplitude_m > first.amplitude_m:
        slower.append(waves.waviness)
    found = (wave for times in _HARMONICS for wave in slower if _is_harmonic(first, wave, times))
    return next(found, first)


def _is_harmonic(fast: Wave, slow: Wave, times: int) -> bool:
    """Whether a wave has `times` the frequency of a slower one, in the same direction."""
    bins = [wave.repeats * cmath.exp(1j * math.radians(wave.angle_deg)) for wave in (fast, slow)]
    return min(abs(bins[0] - sign * times * bins[1]) for sign in (1, -1)) <= _BINS

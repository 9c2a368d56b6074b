# SPDX-License-Identifier: GPL-3.0-or-later
"""The exception whose text is shown to the user, and a function that makes foreign text safe to print."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum
from pathlib import Path

# The longest message in characters. A path has at most 4096.
_LONGEST = 6000


class Setting(Enum):
    """A setting that a message can name. The value is its option on the command line; Blender has labels of its own."""

    SIZE_UM = "--size-um"
    HEIGHT_NM = "--height-nm"
    CHANNEL = "--channel"
    LEVEL = "--level"
    DELTA_E = "--delta-e"
    COHERENCE_UM = "--coherence-um"
    METHOD = "--method"
    MODEL = "--model"
    PATCH_UM = "--patch-um"
    SPREAD_DEG = "--spread-deg"
    MATTER = "--matter"
    NEEDS = "--needs"
    TERMS = "--terms"
    PERIOD_NM = "--period-nm"


# A text that may name settings.
Words = str | Sequence[str | Setting]


def option(setting: Setting) -> str:
    """A setting's name on the command line."""
    return setting.value


def spelled(words: Words, name: Callable[[Setting], str] = option) -> str:
    """A text with the names that `name` gives to its settings, by default those of the command line."""
    return words if isinstance(words, str) else "".join(w if isinstance(w, str) else name(w) for w in words)


class GratingError(Exception):
    """A failure that the user can do something about.

    what    the file, the object or the option that it is about; empty if the fault says it
    fault   what is wrong
    remedy  what to do about it

    >>> try:
    ...     read_height_map("gone.gwy")
    ... except GratingError as error:
    ...     print(error)
    gone.gwy: cannot be read (No such file or directory); check path and permissions"""

    def __init__(self, what: str | Path, fault: str, remedy: Words) -> None:
        super().__init__(what, fault, remedy)
        self.what, self.fault = what, fault
        self.remedy: Words = remedy if isinstance(remedy, str) else tuple(remedy)

    def __str__(self) -> str:
        return self.line()

    def line(self, what: str | None = None, name: Callable[[Setting], str] = option) -> str:
        """The failure as one printable line, "WHAT: fault; remedy". `what` is another name of what it is about, `name`
        names the settings."""
        what = str(self.what) if what is None else what
        text = "; ".join(filter(None, (self.fault, spelled(self.remedy, name))))
        text = ": ".join(filter(None, (what, text)))
        if len(text) > _LONGEST:
            text = f"{text[: _LONGEST - 1000]} [...] {text[-1000:]}"
        return printable(text)

    def within(self, whole: str | Path) -> GratingError:
        """The same failure as one of `whole`: "WHOLE: what: fault; remedy"."""
        return GratingError(whole, ": ".join(filter(None, (str(self.what), self.fault))), self.remedy)


def printable(text: object) -> str:
    r"""Return a text as one line, with unprintable characters as escapes: \n, \x1b, \u202e.

    File names and contents may hold control characters, which a terminal would obey."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in str(text))

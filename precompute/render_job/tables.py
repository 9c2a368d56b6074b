# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of a TOML file whose every key is checked: a wrong value or an unknown key is an error that names it."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, TypeVar

from ..base.failure import GratingError

T = TypeVar("T")
# The longest text, such as the name of a file, and the longest list. Blender's names have at most 255 bytes.
_TEXT_MAX, _LIST_MAX = 4096, 100_000


class Limits(NamedTuple):
    """The least and the greatest value of a number."""

    low: float
    high: float


class Table:
    """A table of a TOML file, or the whole file. At the end of its `with` block, a key that nobody asked for is an
    error, so every known key is asked for once, in the order of the messages."""

    def __init__(self, path: Path, record: Any, where: str = "") -> None:
        if not isinstance(record, dict):
            raise GratingError(path, f"{where}: is not a table", f"write it as [{where}] with keys below it")
        self._path, self._record, self._where, self._asked = path, record, where, dict[str, None]()

    def __enter__(self) -> Table:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        unknown = [key for key in self._record if key not in self._asked]
        if error is None and unknown:
            raise self.fault(f"{unknown[0]:.40}", "no such key", f"there are {', '.join(self._asked)}")

    def fault(self, key: str, fault: str, remedy: str) -> GratingError:
        """An error about a key."""
        return GratingError(self._path, f"{'.'.join(filter(None, (self._where, key)))}: {fault}", remedy)

    def within(self, work: Callable[[], T]) -> T:
        """What `work` returns. Its GratingError becomes one about this table."""
        try:
            return work()
        except GratingError as error:
            raise error.within(f"{self._path}: {self._where}") from error

    def take(self, key: str) -> Any:
        """The value of a key, unchecked; None if it is missing."""
        self._asked[key] = None
        return self._record.get(key)

    def text(self, key: str, choices: Collection[str] = ()) -> str | None:
        """A text, one of the choices if there are any; None if the key is missing."""
        value = self.take(key)
        return None if value is None else self._text(key, value, choices)

    def texts(self, key: str, choices: Collection[str] = ()) -> tuple[str, ...]:
        """A list of texts, each once; empty if the key is missing."""
        return self._each(key, lambda value: self._text(key, value, choices))

    def flag(self, key: str) -> bool | None:
        """true or false; None if the key is missing."""
        value = self.take(key)
        if value is not None and not isinstance(value, bool):
            raise self.fault(key, f"cannot be {value!r:.30}", "give true or false")
        return value

    def number(self, key: str, limits: Limits) -> float | None:
        """A number; None if the key is missing."""
        value = self.take(key)
        return None if value is None else self._number(key, value, limits)

    def numbers(self, key: str, limits: Limits) -> tuple[float, ...]:
        """A list of numbers, each once; empty if the key is missing."""
        return self._each(key, lambda value: self._number(key, value, limits))

    def integer(self, key: str, limits: Limits) -> int | None:
        """A whole number; None if the key is missing."""
        value = self.take(key)
        return None if value is None else self._integer(key, value, limits)

    def integers(self, key: str, limits: Limits) -> tuple[int, ...]:
        """A list of whole numbers, each once; empty if the key is missing."""
        return self._each(key, lambda value: self._integer(key, value, limits))

    def pairs(self, key: str) -> tuple[tuple[str, float], ...]:
        """A table of numbers by name, sorted; empty if the key is missing."""
        value = self.take(key)
        if value is None:
            return ()
        if not isinstance(value, dict):
            raise self.fault(key, f"cannot be {value!r:.30}", "give a table such as {Roughness = 0.2}")
        limits = Limits(-1e6, 1e6)
        return tuple(sorted((name, self._number(f"{key}.{name:.40}", one, limits)) for name, one in value.items()))

    def table(self, key: str) -> Table:
        """A table within this one; an empty one if the key is missing."""
        value = self.take(key)
        return Table(self._path, {} if value is None else value, key)

    def tables(self, key: str, most: int) -> list[Table]:
        """A list of at most `most` tables; empty if the key is missing."""
        value = self.take(key)
        if value is None:
            return []
        if not isinstance(value, list):
            raise self.fault(key, "is not a list of tables", f"write each as [[{key}]]")
        if len(value) > most:
            raise self.fault(key, f"{len(value)} of them", f"split the job: at most {most}")
        return [Table(self._path, one, f"{key} {number}") for number, one in enumerate(value, 1)]

    def _each(self, key: str, checked: Callable[[Any], T]) -> tuple[T, ...]:
        value = self.take(key)
        if value is None:
            return ()
        if not isinstance(value, list) or not 0 < len(value) <= _LIST_MAX:
            raise self.fault(key, f"cannot be {value!r:.30}", "give a list, such as [1, 2]")
        found = dict.fromkeys(map(checked, value))
        if len(found) < len(value):
            raise self.fault(key, "a value appears twice", "leave one out")
        return tuple(found)

    def _text(self, key: str, value: Any, choices: Collection[str]) -> str:
        if not isinstance(value, str) or not 0 < len(value) <= _TEXT_MAX or (choices and value not in choices):
            remedy = f"give one of {', '.join(choices)}" if choices else "give a text"
            raise self.fault(key, f"cannot be {value!r:.30}", remedy)
        return value

    def _number(self, key: str, value: Any, limits: Limits) -> float:
        if type(value) not in (int, float) or not limits.low <= value <= limits.high:  # NaN is in no limits
            raise self.fault(key, f"cannot be {value!r:.30}", f"give a number from {limits.low:g} to {limits.high:g}")
        return float(value)

    def _integer(self, key: str, value: Any, limits: Limits) -> int:
        if type(value) is not int or not limits.low <= value <= limits.high:
            remedy = f"give a whole number from {limits.low:.0f} to {limits.high:.0f}"
            raise self.fault(key, f"cannot be {value!r:.30}", remedy)
        return value

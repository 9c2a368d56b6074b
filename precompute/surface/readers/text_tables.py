# SPDX-License-Identifier: GPL-3.0-or-later
"""Text files of numbers, a matrix of heights from the scan's top or the points (x, y, z) of a grid; and the numbers in
texts of other formats.

Numbers as text are separated by blanks, tabs, semicolons or commas. They have decimal points or commas, and may be
quoted."""

from __future__ import annotations

import re
from typing import BinaryIO

import numpy as np

from .numbers_file import Judge, Numbers, NumbersReader
from .scan_file import KnownFault, decoded, shortened

# The longest text in bytes, and the most numbers in it. 2048 x 2048 numbers take seconds.
_TEXT_MAX, _NUMBERS_MAX = 64 << 20, 1 << 23
_SEPARATORS = (b" ", b"\n", b"\r", b"\t", b";", b",")
# A fault and its remedy.
AXES = "its first row and column are axes, no heights", "delete the first row and the first column"
_NUMBER = re.compile(r"[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?|[-+]?nan", re.IGNORECASE)


def read_text(file: BinaryIO) -> str:
    """Read a file as UTF-8 or else Latin-1. Raises ValueError if it is too long or holds zero bytes."""
    file.seek(0)
    data = file.read(_TEXT_MAX + 1)
    if len(data) > _TEXT_MAX:
        raise ValueError(f"a text of more than {_TEXT_MAX >> 20} MiB; save it as a binary file")
    if b"\0" in data:
        raise ValueError("a text with zero bytes")
    # Repeated separators count too, which also rejects a long text of blanks.
    if sum(map(data.count, _SEPARATORS)) > _NUMBERS_MAX:
        raise ValueError(f"a text of more than {_NUMBERS_MAX} numbers; save it as a binary file")
    return decoded(data)


def numbers_of(text: str) -> np.ndarray:
    """Parse all numbers of a text into a flat array. Raises ValueError for anything else."""
    return np.array(with_points(text).split(), dtype=np.float64)


def rows_of(text: str) -> np.ndarray:
    """Parse the numbers of a text as (lines, numbers per line); comments begin with #.

    Raises ValueError for a text without numbers, KnownFault for words among them and for lines of unequal length."""
    lines = [line for line in with_points(text).splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise ValueError("no numbers")
    try:
        return np.loadtxt(lines, dtype=np.float64, ndmin=2)
    except ValueError:
        for line in lines:
            if words := odd_words(line):
                raise KnownFault(*words_among_numbers(words)) from None
        counts = [len(line.split()) for line in lines]
        if set(counts[1:]) == {counts[0] + 1}:
            raise KnownFault(*AXES) from None
        odd = next((row for row, count in enumerate(counts) if count != counts[0]), 0)
        told = f"row {odd + 1} has {counts[odd]} numbers, and row 1 has {counts[0]}"
        raise KnownFault(told, "give each row the same count of numbers") from None


def odd_words(line: str) -> str:
    """Return the words of a line that are not numbers, each once; "" if there are none."""
    words = (word for word in re.split(r"[\s;,]+", line.replace('"', "")) if word and not _NUMBER.fullmatch(word))
    return " ".join(dict.fromkeys(words))


def words_among_numbers(words: str) -> tuple[str, str]:
    """Return the fault and the remedy for words in the place of a number."""
    return f"'{shortened(words)}' is not a number", "write nan for points that were not measured"


def with_points(text: str) -> str:
    """Rewrite a text to decimal points and blanks between numbers, without comment lines.

    A comma is a decimal comma if the text has no points, but has tabs, semicolons, or blanks that follow no comma."""
    values = "\n".join(line for line in text.splitlines() if not line.lstrip().startswith("#")).replace('"', "")
    if "," in values:
        head = values[: 1 << 16]
        others = head.replace(", ", ",").strip()
        between = ";" in others or "\t" in others or " " in others.replace("\n", "")
        decimal = between and "." not in head
        values = values.replace(",", "." if decimal else " ")
    return values.replace(";", " ")


def is_numbers(beginning: bytes) -> bool:
    """Whether the beginning of a file is lines of numbers, apart from lines that begin with #."""
    if not beginning or b"\0" in beginning:
        return False
    lines = decoded(beginning).replace('"', "").splitlines()
    # The last line may be cut, unless it is the only one or the file ends there.
    whole = lines[:-1] if len(lines) > 1 and not beginning.endswith((b"\n", b"\r")) and len(beginning) > 1000 else lines
    values = [line for line in whole if line.strip() and not line.lstrip().startswith("#")]
    words = [word for line in values for word in line.replace(";", " ").split()]
    return bool(words) and all(_is_number(word) for word in words)


def _is_number(word: str) -> bool:
    return all(_NUMBER.fullmatch(part) for part in word.strip(",").split(",") if part) and word.strip(",") != ""


# The largest distance of a point from the grid, as a share of a step: rounding to six digits with 2000 columns.
_OFF_GRID = 0.1
# The least share of grid points that must be present. Some may be missing at the edges of a scan that is not square.
_LEAST_COVERED = 0.25
_SAVE = "save the heights as a matrix"


def _matrix(file: BinaryIO, judge: Judge) -> Numbers:
    values = rows_of(read_text(file))  # a text has fewer numbers than a map may have
    if _is_even(values[0, 1:]) and _is_even(values[1:, 0]):
        raise KnownFault(*AXES)
    return Numbers(values)


def _is_even(numbers: np.ndarray) -> bool:
    """Whether numbers are an axis: at least three in even steps."""
    if len(numbers) < 3 or numbers[0] == numbers[1]:
        return False
    places = (numbers - numbers[0]) / (numbers[-1] - numbers[0]) * (len(numbers) - 1)
    return bool((np.abs(places - np.arange(len(numbers))) < _OFF_GRID).all())


def _points(file: BinaryIO, judge: Judge) -> Numbers:
    """Read the points as a map: x from left to right, y from the bottom up, NaN for missing points.

    Raises KnownFault if they do not lie on a grid."""
    x, y, z = rows_of(read_text(file)).T
    col, step_x = _places(x)
    row, step_y = _places(y)
    shape = row.max() + 1, col.max() + 1
    if min(shape) < 2 or len(z) < _LEAST_COVERED * shape[0] * shape[1]:
        raise KnownFault(f"{len(z)} points do not lie on a grid", _SAVE)
    judge(shape)
    values = np.full(shape, np.nan)
    values[shape[0] - 1 - row, col] = z
    return Numbers(values, step_y / step_x)


def _places(along: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the grid index of each coordinate, and the grid's step."""
    lines = np.unique(along)
    if len(lines) < 2 or not np.isfinite(lines).all():
        raise KnownFault("the points lie on a line", _SAVE)
    gaps = np.diff(lines)
    # Coordinates that differ only by rounding are the same grid line.
    step = float(np.median(gaps[gaps > _OFF_GRID * gaps.max()]))
    places = (along - lines[0]) / step
    numbers = np.rint(places)
    if np.abs(places - numbers).max() > _OFF_GRID or numbers.max() >= len(along):
        raise KnownFault("the points do not lie on a grid", _SAVE)
    return numbers.astype(np.int64), step


def _has_three_columns(beginning: bytes) -> bool:
    lines = (line.split() for line in with_points(decoded(beginning)).splitlines() if line.strip())
    whole = list(lines)
    # The last line may be cut.
    return len(whole) > 3 and all(len(line) == 3 for line in whole[:-1])


def _begins_as_points(beginning: bytes) -> bool:
    return is_numbers(beginning) and _has_three_columns(beginning)


XYZ = NumbersReader("XYZ points", (".xyz", ".txt"), _begins_as_points, _points)
MATRIX = NumbersReader("text matrix", (".txt", ".asc", ".csv", ".dat"), is_numbers, _matrix)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Parser of numbers as text, separated by blanks, tabs, semicolons or commas, with decimal points or commas, quoted
or not."""

from __future__ import annotations

import re
from typing import BinaryIO

import numpy as np

from .channels import shortened
from .reader import KnownFault

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


def decoded(data: bytes) -> str:
    """Decode bytes as UTF-8 or else Latin-1."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


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
    """Return the words of a line that are no numbers, each once; "" if there are none."""
    words = (word for word in re.split(r"[\s;,]+", line.replace('"', "")) if word and not _NUMBER.fullmatch(word))
    return " ".join(dict.fromkeys(words))


def words_among_numbers(words: str) -> tuple[str, str]:
    """Return the fault and the remedy for words in the place of a number."""
    return f"'{shortened(words)}' stands in the place of a number", "write nan for points that were not measured"


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

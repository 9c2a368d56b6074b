# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra of lamps: reads a file of wavelengths and powers, and writes the text under which a bake keeps it.

The text is "380:0.2 385:1 ...": wavelengths in nanometres to seven digits, and powers to five, of which the greatest is
1. It holds the points from 380 to 780 nm and the neighbour on each side, so it gives the same bake as the file."""

import itertools
import re
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..base.failure import GratingError
from ..base.files import read_limited

# The greatest size of a file in bytes, and the greatest number of points that a text holds: a spectrometer has about
# a thousand from 380 to 780 nm.
LARGEST_BYTES = 1 << 20
MOST_POINTS = 2000
# The wavelengths that are seen, in nanometres, and those that a file may name: others are given in other units.
_SEEN_NM = (380, 780)
_NM = (10, 1e5)
# A text has at most two neighbours more, and each point at most 24 characters.
_LONGEST = 24 * (MOST_POINTS + 2)
_POINT = re.compile(r"[0-9.]{1,9}:[0-9.]{1,12}(e-[0-9]{2,3})?")
_REMEDY = "give lines of a wavelength in nanometres and a power, such as 555, 0.8"


@lru_cache(maxsize=64)
def is_spectrum_text(text: str) -> bool:
    """Whether a text is one that read_spectrum returns."""
    if len(text) > _LONGEST or ":" not in text or not all(map(_POINT.fullmatch, text.split(" "))):
        return False
    try:
        nm, power = points_of(text)
        return bool((np.diff(nm) > 0).all()) and _text(nm, power, "") == text
    except (GratingError, ValueError):
        return False


def points_of(text: str) -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths (n,) in nanometres and powers (n,) of a text. Raises ValueError if it is none."""
    nm, power = np.array([[float(part) for part in point.split(":")] for point in text.split(" ")]).T
    return nm, power


def read_spectrum(path: Path) -> str:
    """The text of a file's spectrum: two columns, separated by commas, semicolons or spaces, with # before comments and
    at most one line of titles.

    Raises GratingError if the file cannot be read or is no spectrum of a lamp."""
    rows = [row for row in map(_fields, enumerate(_lines(path), 1)) if row[1]]
    if rows and not any(map(_is_number, rows[0][1])):
        del rows[0]
    for number, fields in rows:
        if len(fields) != 2:
            raise GratingError(path, f"line {number} has {len(fields)} columns", _REMEDY)
        for field in fields:
            if not _is_number(field):
                raise GratingError(path, f"line {number}: {field:.20} is no number", _REMEDY)
    if len(rows) < 2:
        raise GratingError(path, f"has {len(rows)} points", "give at least two wavelengths with their powers")
    nm, power = np.array([[float(field) for field in fields] for _, fields in rows]).T
    for wrong, fault, remedy in (
        (~np.isfinite(nm) | ~np.isfinite(power), "not a finite number", "give finite numbers"),
        ((nm < _NM[0]) | (nm > _NM[1]), "not a wavelength in nanometres", "give wavelengths in nanometres, as 555"),
        (power < 0, "a negative power", "subtract the dark spectrum, and set what is below zero to 0"),
        (np.diff(nm, prepend=-np.inf) <= 0, "the wavelengths do not ascend", "sort the lines, each wavelength once"),
    ):
        if wrong.any():
            raise GratingError(path, f"line {rows[int(np.argmax(wrong))][0]}: {fault}", remedy)
    return _text(nm, power, path)


def _lines(path: Path) -> list[str]:
    remedy = "give a text file of wavelengths and powers"
    content = read_limited(path, LARGEST_BYTES, remedy)
    if len(content) > LARGEST_BYTES:
        raise GratingError(path, f"is larger than {LARGEST_BYTES >> 20} MiB", "keep the lines from 380 to 780 nm")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise GratingError(path, "is no text", remedy) from error
    if "\0" in text:
        raise GratingError(path, "is no text", remedy)
    return text.splitlines()


def _fields(line: tuple[int, str]) -> tuple[int, list[str]]:
    """A line's number and its columns."""
    number, text = line
    plain = text.partition("#")[0].strip()
    return number, re.split(r"\s*[,;]\s*|\s+", plain) if plain else []


def _is_number(field: str) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return True


def _text(nm: np.ndarray, power: np.ndarray, path: Path | str) -> str:
    """The text of a spectrum. Raises GratingError for one without light from 380 to 780 nm."""
    low, high = _SEEN_NM
    first = max(int(np.searchsorted(nm, low, "right")) - 1, 0)
    nm, power = (each[first : int(np.searchsorted(nm, high)) + 1] for each in (nm, power))
    if len(nm) < 2 or nm[0] >= high or nm[-1] <= low:
        raise GratingError(path, f"has no light from {low} to {high} nm", "give the lamp's visible spectrum")
    if len(nm) > MOST_POINTS + 2:
        raise GratingError(
            path, f"has {len(nm)} points from {low} to {high} nm", f"give at most {MOST_POINTS}, such as one per nm"
        )
    seen = np.interp([low, high], nm, power, left=0, right=0).max()
    if not max(seen, power[(nm >= low) & (nm <= high)].max(initial=0)) > 0:
        raise GratingError(path, f"has no light from {low} to {high} nm", "give the lamp's visible spectrum")
    points = [(f"{x:.7g}", f"{y:.5g}") for x, y in zip(nm, power / power.max(), strict=True)]
    if any(a == b for (a, _), (b, _) in itertools.pairwise(points)):
        raise GratingError(path, "has wavelengths closer than 0.0001 nm", "give each wavelength once")
    return " ".join(map(":".join, points))

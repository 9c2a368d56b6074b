# SPDX-License-Identifier: GPL-3.0-or-later
"""The width of a scan as the name of its file says it: 10 um for "skin_10um.png"."""

import re
from pathlib import Path

_TO_UM = {"nm": 1e-3, "um": 1.0, "mm": 1e3}
_UNITS = r"(?P<unit>nm|[u\u00b5\u03bc]m|mm|microns?|micromet(?:er|re)s?|nanomet(?:er|re)s?)"
# Comma and three digits may be a thousand or a decimal fraction, so such a number is not read.
_NUMBER = r"\d+(?:\.\d+|,\d{1,2}(?!\d)|,\d{4,})?"
# A letter or digit directly before the number makes it a part of a word, such as X100um, unless the word is a width.
_WIDTH = re.compile(
    rf"(?<![^\W_])(?:width|size|scan)?(?<!\d[.,])(?P<width>{_NUMBER})\s?"
    rf"(?:{_UNITS.replace('unit', 'other')}?(?:x|\u00d7| x | \u00d7 ){_NUMBER}\s?)?{_UNITS}(?![^\W_])",
    re.IGNORECASE,
)
# Words directly before or after a length that is no width of a scan.
_OTHERS = {
    "period", "pitch", "spacing", "lines", "grating", "groove", "step", "pixel", "pixels", "px", "per", "resolution",
    "height", "high", "depth", "deep", "tall", "thick", "thickness", "z", "rms", "ra", "range", "lambda", "wavelength",
    "laser", "light", "led", "filter", "radius", "tip", "bar", "scalebar", "film", "layer", "coating", "offset",
}  # fmt: skip
_WORD = re.compile(r"[^\W\d_]+")
# The widths of scans in micrometres.
_LIMITS_UM = (1e-3, 1e6)


def named_width_um(path: str) -> float | None:
    """The width in micrometres that a file's name says; None if it says none, or several that differ.

    Of "10x5um" it is the first. Nanometres count only if nothing is in micrometres or millimetres, because they are
    often a height."""
    name = Path(path).stem
    found = [each for each in _WIDTH.finditer(name) if not _is_other(name, each)]
    coarse = {_um(each) for each in found if _unit(each) != "nm"}
    widths = coarse or {_um(each) for each in found}
    if len(widths) != 1:
        return None
    (width,) = widths
    return width if _LIMITS_UM[0] <= width <= _LIMITS_UM[1] else None


def _is_other(name: str, found: re.Match[str]) -> bool:
    """Whether the word before or after a length says that it is another quantity."""
    before, after = _WORD.findall(name[: found.start()]), _WORD.match(name[found.end() :].lstrip(" _-./()"))
    words = {before[-1].lower()} if before and not re.search(r"\d[^\d]*$", name[: found.start()]) else set()
    return bool((words | ({after[0].lower()} if after else set())) & _OTHERS)


def _unit(found: re.Match[str]) -> str:
    unit = found["unit"].lower()
    return "nm" if unit.startswith("n") else "mm" if unit == "mm" else "um"


def _um(found: re.Match[str]) -> float:
    return round(float(found["width"].replace(",", ".")) * _TO_UM[_unit(found)], 9)

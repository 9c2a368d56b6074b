# SPDX-License-Identifier: GPL-3.0-or-later
"""Units as instrument files spell them."""

from __future__ import annotations

_PREFIXES = {"": 1.0, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12, "f": 1e-15, "c": 1e-2, "k": 1e3}
# The micro sign, the Greek letter, the sign in the DOS code page 850, and what NanoScope writes.
_MICRO = str.maketrans({"\u00b5": "u", "\u03bc": "u", "\u00e6": "u", "~": "u"})
_ANGSTROM = ("\u00c5", "\u212b", "Ang", "Angstrom")
_METRES = ("m", "meter", "metre")


def in_base_units(unit: str) -> tuple[float, str]:
    """Return a unit's size and its base unit: (1e-9, "m") for "nm", (1e-3, "V") for "mV", (1, "deg") for "deg"."""
    unit = unit.strip()
    if unit in _ANGSTROM:
        return 1e-10, "m"
    if unit in _METRES:
        return 1.0, "m"
    plain = unit.translate(_MICRO)
    if len(plain) == 2 and plain[0] in _PREFIXES and plain[1] in ("m", "V", "A", "N", "W", "s"):
        return _PREFIXES[plain[0]], plain[1]
    return 1.0, unit


def in_metres(text: str) -> float:
    """Convert a length with its unit to metres: "12,34 \u00b5m" is 1.234e-5. Raises ValueError if it is no length."""
    number, _, unit = text.strip().partition(" ")
    size, base = in_base_units(unit)
    if base != "m":
        raise ValueError(f"'{text.strip()}' is no length")
    return float(number.replace(",", ".")) * size

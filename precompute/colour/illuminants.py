# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectra of lights, each named by its canonical text:

    D65, E           the two that a bake could have first; D65 is the default
    A, C, D50, FL11, LED-B1, HP1, ...      illuminants of the CIE (CIE 15:2018)
    2700K            a black body
    D5500            daylight of a colour temperature, by the CIE's formula
    532nm            a laser's line
    380:0.2 385:1    the spectrum of a file: wavelengths in nanometres, and powers of which the greatest is 1
    D65+smooth       D65, and channels for black bodies and daylight (channels.py)
    D65+led          the same, and for LEDs
    D65+led+FL11     the same, and the colours under FL11

A text of several parts is for a scene with several lamps. Its white, and the first three channels of its bake, are
D65's. cie_illuminants_5nm.csv holds the tables. `canonical` also takes the names of LAMPS, and capital or small
letters; it adds a missing "D65+".

The text of a file's spectrum has wavelengths to seven digits and powers to five. It holds the points from 380 to 780 nm
and the neighbour on each side, so it gives the same bake as the file."""

import difflib
import itertools
import re
from functools import cache, lru_cache
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
                raise GratingError(path, f"line {number}: {field:.20} is not a number", _REMEDY)
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
        raise GratingError(path, "is not a text file", remedy) from error
    if "\0" in text:
        raise GratingError(path, "is not a text file", remedy)
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


# The illuminants of the first bakes, whose weights stay as they were (observer.spectral_weights).
ILLUMINANTS = ("D65", "E")
# The limits of a laser's line in nanometres, and of a black body and of daylight in kelvins.
LINES_NM = (400, 700)
BLACK_BODY_K = (1000, 25000)
DAYLIGHT_K = (4000, 25000)
_DAYLIGHTS = {"D50": 5000, "D55": 5500, "D75": 7500}
# Lamps by their common names: the illuminant, and what it is.
LAMPS = {
    "sun": ("D55", "sunlight with skylight (CIE 15)"),
    "overcast": ("D65", "average daylight (CIE 15)"),
    "candle": ("1850K", "black body of a candle's colour temperature"),
    "tungsten": ("2700K", "black body of a household bulb's colour temperature"),
    "halogen": ("3000K", "black body of a halogen lamp's colour temperature"),
    "flash": ("D5500", "daylight of 5500 K, to which photographers' flashes are balanced"),
    "warm-led": ("LED-B1", "blue LED with phosphor, 2733 K (CIE 15:2018)"),
    "cool-led": ("LED-B5", "blue LED with phosphor, 6598 K (CIE 15:2018)"),
    "tube": ("FL11", "fluorescent lamp with three narrow bands, 4000 K (CIE 15)"),
    "sodium": ("HP1", "standard high pressure sodium lamp, 1959 K (CIE 15)"),
    "red-laser": ("650nm", "laser diode of a pointer or of a DVD drive"),
    "green-laser": ("532nm", "frequency-doubled Nd:YAG laser of a pointer"),
    "blue-laser": ("450nm", "gallium nitride laser diode of a projector"),
}
# Second radiation constant in nm K (SI, exact to its digits), and that of the CIE's formula of A.
_C2, _C2_OF_A, _A_K = 1.438776877e7, 1.435e7, 2848
# A temperature of the scale on which the CIE named D50, D55 and D75, on today's.
_TODAY = 1.4388 / 1.4380
# Illuminants with a number in their names: the pattern, in small letters, the canonical text and the limits.
_BY_NUMBER = (
    ("([0-9]+)nm", "{}nm", LINES_NM),
    ("([0-9]+)k", "{}K", BLACK_BODY_K),
    ("d([0-9]{4,})", "D{}", DAYLIGHT_K),
)
# The sets of further channels, and the number of each set's channels: multiples of 3, which make whole colours.
CHANNEL_SETS = {"smooth": 3, "led": 6}
# What joins the parts of a text, its first part, and the greatest number of lamps with their own colours.
JOINT, FIRST = "+", "D65"
OWN_MAX = 4
_JOINT_EXAMPLE = f"{FIRST}+led+FL11"
_EXAMPLES = "2700K, D5500, LED-B1, FL11, 589nm, or a file of wavelengths in nm and powers"


@cache
def _table() -> dict[str, np.ndarray]:
    """The columns (81,) of cie_illuminants_5nm.csv by name; "nm" has the wavelengths."""
    path = Path(__file__).with_name("cie_illuminants_5nm.csv")
    names = path.read_text(encoding="ascii").splitlines()[2].split(",")[1:]
    return dict(zip(["nm", *names], np.loadtxt(path, delimiter=",").T, strict=True))


def named() -> tuple[str, ...]:
    """The names of the CIE's illuminants."""
    return (*ILLUMINANTS, "A", *_DAYLIGHTS, *(name for name in _table() if name not in ("nm", "S0", "S1", "S2")))


def names_with(typed: str) -> list[str]:
    """The names and examples of single lights that contain a typed text."""
    every = (*LAMPS, "2700K", "D5500", "532nm", *named())
    return [name for name in every if typed.lower() in name.lower()]


def canonical(text: str) -> str:
    """The canonical text of an illuminant, of one of LAMPS, or of several parts.

    Raises GratingError for a text that names none."""
    if is_spectrum_text(text):
        return text
    if JOINT in text or _is_set(text):
        parts = text.split(JOINT)
        if not all(map(str.strip, parts)):
            raise GratingError(f"{text:.40}", "has an empty part", f"give {_JOINT_EXAMPLE}")
        return _joined(text, [_part(each) for each in parts])
    return _one(text)


def _is_set(text: str) -> bool:
    return text.strip().lower() in CHANNEL_SETS


def _part(text: str) -> str:
    if _is_set(text):
        return text.strip().lower()
    return text if is_spectrum_text(text) else _one(text)


def _joined(text: str, parts: list[str]) -> str:
    """The canonical text of parts. Raises GratingError, with the typed text, for parts that no bake can have."""
    sets = [each for each in parts if each in CHANNEL_SETS]
    own = [each for each in parts if each not in CHANNEL_SETS and each != FIRST]
    if len(set(parts)) < len(parts):
        raise GratingError(f"{text:.40}", "names a part twice", f"give each once, as in {_JOINT_EXAMPLE}")
    if len(sets) > 1:
        raise GratingError(f"{text:.40}", f"names {' and '.join(sets)}", "give one of them: led holds all of smooth")
    if len(own) > OWN_MAX:
        raise GratingError(f"{text:.40}", f"has {len(own)} lamps with their own colours", f"give at most {OWN_MAX}")
    return JOINT.join([FIRST, *sets, *own])


def _one(text: str) -> str:
    plain = text.strip().lower()
    if plain in LAMPS:
        return LAMPS[plain][0]
    for pattern, written, limits in _BY_NUMBER:
        if found := re.fullmatch(pattern, plain):
            if len(found[1]) > 5 or not limits[0] <= int(found[1]) <= limits[1]:
                low, high = (written.format(limit) for limit in limits)
                raise GratingError(f"{text:.40}", "is out of range", f"give {low} to {high}")
            return written.format(int(found[1]))
    known = {name.lower(): name for name in named()}
    if plain in known:
        return known[plain]
    close = difflib.get_close_matches(plain[:40], [*known, *LAMPS, *CHANNEL_SETS], n=3, cutoff=0.65)
    remedy = f"did you mean {' or '.join(known.get(name, name) for name in close)}?" if close else f"give {_EXAMPLES}"
    raise GratingError(f"{text:.40}", "is not a known illuminant", remedy)


def illuminant_of(text: str) -> str:
    """The canonical text of an illuminant, of one of LAMPS, of a file: a text with a dot or a folder in it, or of
    several parts.

    Raises GratingError for a text that names none, and as read_spectrum does."""
    parts = [text] if _is_file(text) else text.split(JOINT)
    return canonical(JOINT.join(map(_without_file, parts)))


def _without_file(text: str) -> str:
    """The text of a file's spectrum, if a text names a file, or else the text itself."""
    return read_spectrum(Path(text.strip())) if re.search(r"[./\\]", text) and not is_spectrum_text(text) else text


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except (OSError, ValueError):  # a name that no file can have
        return False


def lamp_of(text: str) -> str:
    """The canonical text of one lamp: illuminant_of without several parts. Raises GratingError for them too."""
    found = illuminant_of(text)
    if len(parts_of(found)) > 1:
        raise GratingError("", f"{text:.40} is not a single lamp", "give one, such as 2700K")
    return found


def parts_of(illuminant: str) -> list[str]:
    """The parts of a canonical text."""
    return illuminant.split(JOINT)


def first_of(illuminant: str) -> str:
    """The illuminant whose XYZ are the first three channels of a bake under a canonical text."""
    return parts_of(illuminant)[0]


def is_illuminant(value: object) -> bool:
    """Whether a value, for example of a header, is an illuminant's canonical text."""
    if not isinstance(value, str):
        return False
    try:
        return canonical(value) == value
    except GratingError:
        return False


def line_of(illuminant: str) -> float | None:
    """The wavelength in metres of a laser's line in whole nanometres, such as "532nm"; None for other illuminants, and
    for several parts."""
    found = re.fullmatch("([0-9]{3})nm", illuminant)
    return int(found[1]) * 1e-9 if found and LINES_NM[0] <= int(found[1]) <= LINES_NM[1] else None


def has_bands(illuminant: str) -> bool:
    """Whether an illuminant may have narrow bands, unlike daylight, black bodies and a single line; or a part of it,
    where lines count too."""
    if JOINT in illuminant:
        return any(line_of(part) or has_bands(part) for part in parts_of(illuminant) if part != "smooth")
    return illuminant not in (*ILLUMINANTS, "A", "C") and not re.fullmatch("D[0-9]+|[0-9]+K|[0-9]+nm", illuminant)


@cache
def spectrum(illuminant: str) -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths (n,) in nanometres, and powers (n,) of any scale; between them the power is linear.

    Not of ILLUMINANTS (observer.py), nor of a laser's line, which has no width."""
    if ":" in illuminant:
        return points_of(illuminant)
    nm = np.arange(380.0, 781.0)
    if illuminant == "A":
        return nm, _planck(nm, _A_K, _C2_OF_A)
    if illuminant.endswith("K"):
        return nm, _planck(nm, int(illuminant[:-1]), _C2)
    if illuminant in _DAYLIGHTS:
        return _table()["nm"], _daylight(_DAYLIGHTS[illuminant] * _TODAY)
    if re.fullmatch("D[0-9]{4,}", illuminant):
        return _table()["nm"], _daylight(int(illuminant[1:]))
    return _table()["nm"], _table()[illuminant]


def _planck(nm: np.ndarray, kelvins: float, c2: float) -> np.ndarray:
    """The spectral radiance (n,) of a black body by Planck's law, 1 at 560 nm."""
    return (560 / nm) ** 5 * np.expm1(c2 / (560 * kelvins)) / np.expm1(c2 / (nm * kelvins))


def _daylight(kelvins: float) -> np.ndarray:
    """The power (81,) of daylight (CIE 15:2018, 4.1.2), with M1 and M2 rounded to three decimals as the CIE does."""
    t = 1e3 / kelvins
    if kelvins <= 7000:
        x = 0.244063 + 0.09911 * t + 2.9678 * t**2 - 4.6070 * t**3
    else:
        x = 0.237040 + 0.24748 * t + 1.9018 * t**2 - 2.0064 * t**3
    y = -3 * x**2 + 2.870 * x - 0.275
    m = 0.0241 + 0.2562 * x - 0.7341 * y
    first = round((-1.3515 - 1.7703 * x + 5.9114 * y) / m, 3)
    second = round((0.0300 - 31.4424 * x + 30.0717 * y) / m, 3)
    table = _table()
    return table["S0"] + first * table["S1"] + second * table["S2"]

# SPDX-License-Identifier: GPL-3.0-or-later
"""What a surface is made of, the text that names it, and its reflectance.

A matter is named by one of

    dielectric                        the material's own index of refraction, set in the scene
    mirror                            reflects all light at every angle
    gold                              a metal: aluminium, silver, gold, copper, chromium, nickel or titanium
    1.56                              a refractive index; 1.7+0.02i has an extinction coefficient
    1.46/200nm, aluminium             layers from the outside inwards, then the substrate under them
    6x(1.68/80nm, 1.56/90nm), 1.56    layers that repeat
    plate 1.585, aluminium            any of these but dielectric, under a clear plate of an index

A layer is INDEX/THICKNESS. The index is a number, a metal or `air`; the thickness is in nm or um. A name may stand
before an index: `chitin 1.56/120nm`. It is for the reader and has no effect. The substrate is an index without a
thickness: `chitin 1.56/120nm, air`. A repeat holds no other repeat. Capital letters and spaces have no effect.

For sums over many directions, the reflectance is tabulated as curves. It is that of the half angle, whose cosine is
|wi + wr| / 2 = sqrt(u^2 + v^2 + w^2) / 2. So it is a function of the wavelength and of a table's own variables. Under
a plate they are those of the directions inside."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..base.failure import GratingError
from ..optics.brdf import NO_RATIO, RATIO_IOR, ratio_ior_of
from ..optics.plate import NO_PLATE, PLATE_IOR_MAX
from .films import METALS, metal_index, stack_reflectance

# Two matters without an index: the material's own index of refraction, set in the scene, and a perfect mirror.
DIELECTRIC, MIRROR = "dielectric", "mirror"
AIR = "air"
# The word for a plate in a text.
PLATE = "plate"

# The wavelength at which a metal has the index of its ratio form: (1,) in metres.
_RATIO_M = np.array([550e-9])

# A complex index n + ik, or the name of a metal.
Index = complex | str


@dataclass(frozen=True)
class Layer:
    """A layer of a stack: its index and its thickness in nanometres."""

    index: Index
    thickness_nm: float

    def __str__(self) -> str:
        return f"{_index_text(self.index)}/{_number_text(self.thickness_nm)}nm"


@dataclass(frozen=True)
class Repeat:
    """Layers, the outermost first, that follow each other `count` times."""

    layers: tuple[Layer, ...]
    count: int = 1

    def __str__(self) -> str:
        once = ", ".join(map(str, self.layers))
        return once if self.count == 1 else f"{self.count}x({once})"


@dataclass(frozen=True)
class Matter:
    """What a surface is made of.

    substrate  the index under the layers; DIELECTRIC or MIRROR for these matters, which have no layers
    repeats    the layers from the outside inwards
    plate_ior  the index of a transparent plate over the relief (optics/plate.py); 1 without one
    text       the text as the user gave it, with names of layers. Two matters are equal if only this text differs

    str(matter) is the text without names, spaces and units that vary; `parse` reads it back as an equal
    matter."""

    substrate: Index
    repeats: tuple[Repeat, ...] = ()
    plate_ior: float = NO_PLATE
    text: str = field(default="", compare=False)

    def __str__(self) -> str:
        plate = [f"{PLATE} {_number_text(self.plate_ior)}"] if self.has_plate else []
        return ", ".join([*plate, *map(str, self.repeats), _index_text(self.substrate)])

    @property
    def baked(self) -> bool:
        """Whether the reflectance is this matter's. A dielectric's follows the index of refraction in the scene."""
        return self.substrate != DIELECTRIC

    @property
    def opaque(self) -> bool:
        """Whether nothing is seen through it, as on a metal."""
        return isinstance(self.substrate, str) and self.substrate != DIELECTRIC

    @property
    def ratio_ior(self) -> float:
        """The index of the ratio form (optics/brdf.py), from the substrate's index at 550 nm relative to the plate. A
        mirror has RATIO_IOR, a dielectric NO_RATIO."""
        if self.substrate == MIRROR:
            return RATIO_IOR
        if not self.baked:
            return NO_RATIO
        return ratio_ior_of(complex(_values(self.substrate, _RATIO_M)[0]) / self.plate_ior)

    @property
    def has_plate(self) -> bool:
        """Whether a plate is over the relief."""
        return self.plate_ior != NO_PLATE

    @property
    def layers(self) -> tuple[Layer, ...]:
        """Every layer, the outermost first."""
        return tuple(layer for repeat in self.repeats for layer in repeat.layers * repeat.count)

    def reflectance(self, wavelengths_m: np.ndarray, cosines: np.ndarray) -> np.ndarray:
        """The power reflectance (n, m) for unpolarised light, from 0 to 1, and 1 at cosine 0.

        wavelengths_m (n,) are in metres, in air; cosines (m,) are of the angle of incidence, inside the plate if there
        is one. Raises ValueError if the matter
        is DIELECTRIC, or has a metal and a wavelength is outside the metal's table, which covers 380 to 780 nm."""
        if not self.baked:
            raise ValueError("a dielectric reflects by its index of refraction in the scene: use fresnel_reflectance")
        wavelengths_m, cosines = np.asarray(wavelengths_m, dtype=float), np.asarray(cosines, dtype=float)
        if self.substrate == MIRROR:
            return np.ones((len(wavelengths_m), len(cosines)))
        layers = self.layers
        stack = [layer.index for layer in layers] + [self.substrate]
        known = {index: _values(index, wavelengths_m) / self.plate_ior for index in set(stack)}
        # Only the indices and the wavelength relative to the medium before the stack matter.
        return stack_reflectance(
            wavelengths_m / self.plate_ior, cosines, np.array([known[index] for index in stack]),
            thicknesses_m=[layer.thickness_nm * 1e-9 for layer in layers],
        )  # fmt: skip


# Reflects all light. For the spectrum of a dielectric, whose reflectance is not in its table.
MIRRORING = Matter(MIRROR)


def _values(index: Index, wavelengths_m: np.ndarray) -> np.ndarray:
    """The complex index (n,) at wavelengths (n,)."""
    return metal_index(index, wavelengths_m) if isinstance(index, str) else np.full(len(wavelengths_m), index)


def _index_text(index: Index) -> str:
    if isinstance(index, str):
        return index
    if index == 1:
        return AIR
    k = f"+{_number_text(index.imag)}i" if index.imag else ""
    return _number_text(index.real) + k


def _number_text(value: float) -> str:
    """The shortest text that float() reads back as the value."""
    return repr(float(value)).removesuffix(".0")


# The greatest length of a text, and the greatest number of layers, with their repeats.
LONGEST = 2000
MOST_LAYERS = 200
THICKEST_NM = 10_000
# The least and greatest n and k of an index that is a number. Metals have those of their tables.
N_RANGE = (0.01, 10)
K_MAX = 10

_ALONE = (DIELECTRIC, MIRROR)
_OTHER_SPELLINGS = {"aluminum": "aluminium"}
_NM_OF_UNIT = {"nm": 1, "um": 1000, "µm": 1000, "μm": 1000}
_NUMBER = r"(?:\d+(?:\.\d*)?|\.\d+)(?:e[+-]?\d+)?"
_INDEX = re.compile(rf"([+-]?{_NUMBER})(?:([+-]{_NUMBER})i)?", re.ASCII)
_THICKNESS = re.compile(rf"([+-]?{_NUMBER}) ?([^\W\d]\w*)?")
# A repeat or a text without brackets, up to its comma.
_PART = re.compile(r" ?(?:(\d+) ?x ?\(([^()]*)\)|([^(),]*)) ?(,|$)", re.ASCII)
# The greatest length of a wrong text that an error quotes.
_QUOTED = 60

_EXAMPLES = "such as 1.46/200nm, aluminium"
_PLATES = f"give an index above 1 and at most {PLATE_IOR_MAX:g}, such as plate 1.585"
_KNOWN = f"give {', '.join(_ALONE)}, {', '.join(METALS)}, an index such as 1.56, or layers {_EXAMPLES}"
_REPEATS = "write repeats as 6x(1.68/80nm, 1.56/90nm)"


def parse(text: str) -> Matter:
    """The matter that a text names, in the syntax at the top of this file.

    Raises GratingError if the text is wrong or beyond the limits, in time proportional to its length."""
    if len(text) > LONGEST:
        raise _error(text, f"is longer than {LONGEST} characters", _REPEATS)
    plain = re.sub(r" ?\+ ?", "+", " ".join(text.lower().split()))
    if not plain:
        raise GratingError("", "is empty", _KNOWN)
    if plain in _ALONE:
        return Matter(plain, text=text)
    *above, (count, substrate) = _parts(plain)
    plate_ior = NO_PLATE
    if above and above[0][1].split(" ")[0] == PLATE and not above[0][0]:
        plate_ior = _plate(above.pop(0)[1])
        if substrate == MIRROR and not above:
            return Matter(MIRROR, plate_ior=plate_ior, text=text)
    if count or "/" in substrate or substrate.split(" ")[0] in ("", PLATE):
        raise _error(plain, "has no substrate", f"end with an index, a metal or {AIR}, {_EXAMPLES}")
    matter = Matter(_index(substrate), _repeats(above), plate_ior, text)
    if not above and matter.substrate in (1, plate_ior):
        raise _error(plain, "reflects nothing", f"put a layer before it, such as chitin 1.56/120nm, {AIR}")
    # Names are left out, but spaces are added.
    if len(str(matter)) > LONGEST:
        raise _error(plain, f"is longer than {LONGEST} characters", _REPEATS)
    return matter


def _parts(text: str) -> list[tuple[int, str]]:
    """A stack's parts at its outer commas: a repeat as its count and the text inside, other texts with count 0."""
    parts, position, comma = [], 0, ","
    while comma:
        found = _PART.match(text, position)
        if not found:
            raise _error(text[position:], "has brackets that do not match", _REPEATS)
        count, inside, plain, comma = found.groups()
        if count and not 1 <= int(count) <= MOST_LAYERS:
            raise _error(found[0].strip(" ,"), f"repeats {count:.10} times", f"repeat 1 to {MOST_LAYERS} times")
        parts.append((int(count), inside) if count else (0, plain.strip()))
        position = found.end()
    return parts


def _repeats(parts: list[tuple[int, str]]) -> tuple[Repeat, ...]:
    """The layers of the parts. Neighbours without a count, or with the count 1, become one Repeat of count 1."""
    repeats: list[Repeat] = []
    total = 0
    for count, text in parts:
        layers = tuple(_layer(each.strip()) for each in text.split(","))
        count = max(count, 1)
        total += count * len(layers)
        if total > MOST_LAYERS:
            raise _error(text, f"makes more than {MOST_LAYERS} layers", "repeat fewer layers, or fewer times")
        if repeats and repeats[-1].count == count == 1:
            layers = repeats.pop().layers + layers
        repeats.append(Repeat(layers, count))
    return tuple(repeats)


def _plate(text: str) -> float:
    """The index of a part such as `plate 1.585`."""
    found = _INDEX.fullmatch(text.removeprefix(PLATE).strip())
    if not found or found[2] or not NO_PLATE < float(found[1]) <= PLATE_IOR_MAX:
        raise _error(text, "is not a plate", _PLATES)
    return float(found[1])


def _layer(text: str) -> Layer:
    left, slash, right = text.partition("/")
    if not slash or not left:
        fault = ("has no index" if slash else "has no thickness") if text else "has an empty layer"
        raise _error(text, fault, f"write layers as INDEX/THICKNESS, {_EXAMPLES}")
    found = _THICKNESS.fullmatch(right.strip())
    if not found:
        raise _error(text, "has no thickness that is a number", "write the thickness as 200nm or 0.2um")
    value, unit = found.groups()
    if unit not in _NM_OF_UNIT:
        fault = f"has the unknown unit {_quoted(unit)}" if unit else "has a thickness without a unit"
        raise _error(text, fault, "give nm or um, such as 200nm")
    thickness_nm = float(value) * _NM_OF_UNIT[unit]
    if not 0 < thickness_nm <= THICKEST_NM:
        raise _error(text, f"is {_quoted(value)}{unit} thick", f"give more than 0 and at most {THICKEST_NM:g}nm")
    return Layer(_index(left.strip()), thickness_nm)


def _index(text: str) -> Index:
    """The index of a text such as 1.56, 1.7+0.02i, gold, air or `chitin 1.56`."""
    name, _, last = text.rpartition(" ")
    last = _OTHER_SPELLINGS.get(last, last)
    known = last in METALS or last == AIR
    found = _INDEX.fullmatch(last)
    if last in _ALONE:
        raise _error(text, "must stand alone, not in a stack", f"give an index, a metal or {AIR} in a stack")
    if not found and not known:
        raise _error(text, "is not a known matter", _KNOWN)
    if name and (not name[0].isalpha() or name in (*METALS, *_ALONE, AIR)):
        raise _error(text, "names two matters", "put a comma between layers, and a thickness after each but the last")
    if not found:
        return 1 + 0j if last == AIR else last
    n, k = float(found[1]), float(found[2] or 0)
    if not N_RANGE[0] <= n <= N_RANGE[1]:
        raise _error(text, f"has the index {_quoted(found[1])}", f"give an index from {N_RANGE[0]:g} to {N_RANGE[1]:g}")
    if not 0 <= k <= K_MAX:
        remedy = f"give a number from 0 to {K_MAX:g} before i; light is absorbed at 1.7+0.02i"
        raise _error(text, f"has the extinction coefficient {_quoted(found[2].lstrip('+'))}", remedy)
    return complex(n, k)


def _quoted(text: str) -> str:
    return text if len(text) <= _QUOTED else f"{text[: _QUOTED - 3]}..."


def _error(text: str, fault: str, remedy: str) -> GratingError:
    return GratingError(_quoted(text), fault, remedy)


# Number of cosines that a curve is computed for, and that it is read at. Even the fringes of a layer of 10 um, 100
# along a curve, have 20 computed cosines each.
_COMPUTED, _READ = 2049, 16385


def reflectance_at(
    matter: Matter, wavelengths_m: np.ndarray, places: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> Callable[[int], np.ndarray | float]:
    """Return a function of k: the reflectance (...,) float32 at the k-th of wavelengths_m (n,) in metres, at the half
    angles of places (u, v, w), which are broadcast together.

    It is 1 for a dielectric, whose reflectance is not in the table, and then nothing is computed."""
    if not matter.baked:
        return lambda k: 1.0
    computed, read = np.linspace(0, 1, _COMPUTED), np.linspace(0, 1, _READ)
    curves = matter.reflectance(wavelengths_m, computed)
    curves = np.stack([np.interp(read, computed, curve) for curve in curves]).astype(np.float32)
    index = np.rint(half_angle_cosines(*places) * (_READ - 1)).astype(np.uint16)
    return lambda k: curves[k][index]


def half_angle_cosines(u: np.ndarray, v: np.ndarray, w: np.ndarray | float) -> np.ndarray:
    """The cosines (...,) of the half angle at (u, v, w) = wi + wr; 1 beyond the pairs of directions."""
    return np.minimum(np.sqrt(u**2 + v**2 + w**2) / 2, 1)

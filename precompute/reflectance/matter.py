# SPDX-License-Identifier: GPL-3.0-or-later
"""What a surface is made of: a metal, an index of refraction, or layers on a substrate, perhaps under a plate.
matter_text.py reads it."""

from dataclasses import dataclass, field

import numpy as np

from ..optics.brdf import NO_RATIO, RATIO_IOR, ratio_ior_of
from ..optics.plate import NO_PLATE
from .films import stack_reflectance
from .metals import metal_index

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

    str(matter) is the text without names, spaces and units that vary; matter_text.parse reads it back as an equal
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

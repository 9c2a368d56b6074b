# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts spectra to XYZ: the CIE 1931 2 degree observer under an illuminant (docs/theory.md, Colour).

A flat mirror has the colour of the illuminant's white, scaled to Y = 1. cie_1931_d65_1nm.csv holds the tables of the
observer and of D65, and names their sources in its header.

An illuminant may also be a laser's line, named by its wavelength: "532nm". Nobody sees a line's colour as white, so
white is then D65's, and a flat mirror has the line's own colour, scaled to Y = 1.
"""

import re
from functools import cache
from pathlib import Path

import numpy as np

WAVELENGTH_MIN_M = 380e-9
WAVELENGTH_MAX_M = 780e-9
# The greatest s = w / lambda: light and view along the normal, at the shortest wavelength.
S_MAX = 2 / WAVELENGTH_MIN_M
# The illuminants with a continuous spectrum, and the least and greatest wavelength of a laser's line in nanometres.
ILLUMINANTS = ("D65", "E")
LINES_NM = (400, 700)


@cache
def _cie_table() -> np.ndarray:
    """Load the table (401, 5): wavelength in nanometres, the observer's x, y and z, and D65's power."""
    return np.loadtxt(Path(__file__).with_name("cie_1931_d65_1nm.csv"), delimiter=",")


def is_illuminant(name: object) -> bool:
    """Whether a name is one of ILLUMINANTS or of a laser's line."""
    return isinstance(name, str) and (name in ILLUMINANTS or line_of(name) is not None)


def line_of(illuminant: str) -> float | None:
    """The wavelength in metres of a laser's line in whole nanometres, such as "532nm"; None for other illuminants."""
    found = re.fullmatch("([0-9]{3})nm", illuminant)
    return int(found[1]) * 1e-9 if found and LINES_NM[0] <= int(found[1]) <= LINES_NM[1] else None


def seen_wavelengths(wavelengths_m: np.ndarray, illuminant: str) -> np.ndarray:
    """The wavelengths that spectral_weights needs: the given ones, or the line's own under a laser's line."""
    line = line_of(illuminant)
    return wavelengths_m if line is None else np.array([line])


def observer(wavelengths_m: np.ndarray, illuminant: str = "D65") -> np.ndarray:
    """Colour matching functions times the power (n, 3) of one of ILLUMINANTS, at wavelengths (n,) in metres.

    Zero outside 380 to 780 nm, and scaled so that the Y column integrates to 1 over wavelength in metres."""
    table = _cie_table()
    power = table[:, 4] if illuminant == "D65" else np.ones(len(table))
    weighted = table[:, 1:4] * power[:, None]
    weighted = weighted / (_trapezoid_weights(table[:, 0] * 1e-9) @ weighted[:, 1])
    nm = np.asarray(wavelengths_m) * 1e9
    return np.stack([np.interp(nm, table[:, 0], w, left=0, right=0) for w in weighted.T], axis=-1)


def spectral_weights(wavelengths_m: np.ndarray, illuminant: str = "D65") -> np.ndarray:
    """Weights (n, 3) whose products with a spectrum, summed over n, are its XYZ by the trapezoid rule.

    The spectrum is sampled at ascending wavelengths (n,) in metres. Each channel is scaled so that a constant spectrum
    of 1 gives a mirror's colour exactly, at any step. Raises ValueError if the wavelengths under a laser's line are
    other than the line's own (seen_wavelengths)."""
    line = line_of(illuminant)
    if line is not None:
        if list(wavelengths_m) != [line]:
            raise ValueError(f"{len(wavelengths_m)} wavelengths under {illuminant}: give seen_wavelengths of them")
        return mirror_xyz(illuminant)[None]
    weights = observer(wavelengths_m, illuminant) * _trapezoid_weights(wavelengths_m)[:, None]
    return weights * (white_xyz(illuminant) / weights.sum(axis=0))


@cache
def _white(illuminant: str) -> tuple[float, ...]:
    nm = _cie_table()[:, 0] * 1e-9
    return tuple(_trapezoid_weights(nm) @ observer(nm, illuminant))


def white_xyz(illuminant: str = "D65") -> np.ndarray:
    """The XYZ (3,) of white, scaled to Y = 1: the illuminant's, or D65's under a laser's line."""
    return np.array(_white("D65" if line_of(illuminant) else illuminant))


def mirror_xyz(illuminant: str = "D65") -> np.ndarray:
    """The XYZ (3,) of the illuminant as a perfect mirror shows it, scaled to Y = 1."""
    line = line_of(illuminant)
    if line is None:
        return white_xyz(illuminant)
    (xyz,) = observer(np.array([line]), "E")
    return xyz / xyz[1]


def _trapezoid_weights(x: np.ndarray) -> np.ndarray:
    """The trapezoid rule's weights (n,) for ascending points (n,); 1 for a single point."""
    x = np.asarray(x, dtype=float)
    if len(x) == 1:
        return np.ones(1)
    steps = np.diff(x)
    return 0.5 * (np.concatenate([[0], steps]) + np.concatenate([steps, [0]]))


def wavelengths(step_m: float = 1e-9) -> np.ndarray:
    """Wavelengths (n,) in metres from 380 to 780 nm, both included, in equal steps of at most `step_m`."""
    count = int(np.ceil((WAVELENGTH_MAX_M - WAVELENGTH_MIN_M) / step_m - 1e-6))
    return np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, count + 1)

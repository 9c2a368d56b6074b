# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts spectra to XYZ: the CIE 1931 2 degree observer under an illuminant (docs/theory.md, Colour).

A flat mirror has the colour of the illuminant's white, scaled to Y = 1. cie_1931_d65_1nm.csv holds the tables of the
observer and of D65, and names their sources in its header.

Nobody sees a laser's line as white, nor a lamp as coloured as a green LED. White is then D65's, and a flat mirror has
the light's own colour, scaled to Y = 1. illuminants.py names the illuminants. Of an illuminant of several parts, all
of this is the first part's; channels.py has the others."""

from functools import cache
from pathlib import Path

import numpy as np

from .illuminants import ILLUMINANTS, first_of, line_of, spectrum

WAVELENGTH_MIN_M = 380e-9
WAVELENGTH_MAX_M = 780e-9
# The greatest s = w / lambda: light and view along the normal, at the shortest wavelength.
S_MAX = 2 / WAVELENGTH_MIN_M
# Linear Rec.709 from XYZ (IEC 61966-2-1), and its least component of a light with Y = 1 that may be white. A candle has
# -0.01, a black body of 1000 K -0.09, an amber LED -0.12.
_REC_709 = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
_LEAST_OF_WHITE = -0.1
# The places in (0, 1), and the weights, of Gauss's rule of three points.
_GAUSS = np.array([0.5 - 0.15**0.5, 0.5, 0.5 + 0.15**0.5]), np.array([5, 8, 5]) / 18


@cache
def _cie_table() -> np.ndarray:
    """Load the table (401, 5): wavelength in nanometres, the observer's x, y and z, and D65's power."""
    return np.loadtxt(Path(__file__).with_name("cie_1931_d65_1nm.csv"), delimiter=",")


def seen_wavelengths(wavelengths_m: np.ndarray, illuminant: str) -> np.ndarray:
    """The wavelengths that spectral_weights needs: the given ones, or the line's own under a laser's line."""
    line = line_of(first_of(illuminant))
    return wavelengths_m if line is None else np.array([line])


def observer(wavelengths_m: np.ndarray, illuminant: str = "D65") -> np.ndarray:
    """Colour matching functions times the power (n, 3) of an illuminant other than a line, at wavelengths (n,) in
    metres.

    Zero outside 380 to 780 nm, and scaled so that the Y column integrates to 1 over wavelength in metres."""
    table, illuminant = _cie_table(), first_of(illuminant)
    nm = np.asarray(wavelengths_m) * 1e9
    if illuminant not in ILLUMINANTS:
        return _products(nm, illuminant) / _luminance(illuminant) * 1e9
    power = table[:, 4] if illuminant == "D65" else np.ones(len(table))
    weighted = table[:, 1:4] * power[:, None]
    weighted = weighted / (_trapezoid_weights(table[:, 0] * 1e-9) @ weighted[:, 1])
    return np.stack([np.interp(nm, table[:, 0], w, left=0, right=0) for w in weighted.T], axis=-1)


def spectral_weights(wavelengths_m: np.ndarray, illuminant: str = "D65") -> np.ndarray:
    """Weights (n, 3) whose products with a spectrum, summed over n, are its XYZ.

    The spectrum is sampled at ascending wavelengths (n,) in metres, in steps that change slowly. Under D65 and E the
    weights are those of the trapezoid rule, and each channel is scaled so that a constant spectrum of 1 gives a
    mirror's colour exactly, at any step. Under other illuminants, which may have lines between two wavelengths, they
    are the integral of the illuminant times the spectrum's cubic interpolation. Raises ValueError if the wavelengths
    under a laser's line are other than the line's own (seen_wavelengths)."""
    illuminant = first_of(illuminant)
    line = line_of(illuminant)
    if line is not None:
        if list(wavelengths_m) != [line]:
            raise ValueError(f"{len(wavelengths_m)} wavelengths under {illuminant}: give seen_wavelengths of them")
        return mirror_xyz(illuminant)[None]
    if illuminant not in ILLUMINANTS:
        nm = np.asarray(wavelengths_m) * 1e9
        return interpolated_weights(nm, *_pieces(illuminant, nm)) / _luminance(illuminant)
    weights = observer(wavelengths_m, illuminant) * _trapezoid_weights(wavelengths_m)[:, None]
    return weights * (white_xyz(illuminant) / weights.sum(axis=0))


def _products(nm: np.ndarray, illuminant: str) -> np.ndarray:
    """Colour matching functions times an illuminant's power (n, 3), each linear between its table's wavelengths."""
    table = _cie_table()
    power = np.interp(nm, *spectrum(illuminant), left=0, right=0)
    matching = np.stack([np.interp(nm, table[:, 0], each, left=0, right=0) for each in table[:, 1:4].T], axis=-1)
    return matching * power[:, None]


def _pieces(illuminant: str, further_nm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths (n,) in nanometres, and _products there times their weights (n, 3) in an integral from 380 to 780 nm.

    The rule is exact for a product with a polynomial of degree 3 between any two wavelengths of the observer's table,
    of the illuminant's and of `further_nm`."""
    table = _cie_table()[:, 0]
    nm, widths = integration_rule(np.concatenate([table, spectrum(illuminant)[0], further_nm]))
    return nm, _products(nm, illuminant) * widths[:, None]


def integration_rule(edges_nm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths (m,) in nanometres and their weights (m,) in an integral from 380 to 780 nm, exact for polynomials of
    degree 5 between any two neighbours of edges (n,) in any order."""
    low, high = _cie_table()[[0, -1], 0]
    edges = np.unique(np.concatenate([[low, high], edges_nm[(edges_nm > low) & (edges_nm < high)]]))
    steps = np.diff(edges)[:, None]
    return (edges[:-1, None] + steps * _GAUSS[0]).ravel(), (steps * _GAUSS[1]).ravel()


def interpolated_weights(wavelengths_nm: np.ndarray, nm: np.ndarray, products: np.ndarray) -> np.ndarray:
    """Weights (n, channels) of a spectrum's values at ascending wavelengths (n,): sums over its cubic convolution (Keys
    1981) at `nm` (m,) times `products` (m, channels)."""
    count = len(wavelengths_nm)
    place = np.interp(nm, wavelengths_nm, np.arange(count))
    below = np.minimum(place.astype(int), max(count - 2, 0))
    t = place - below
    shares = ((t * (2 - t) - 1) * t, (3 * t - 5) * t**2 + 2, ((4 - 3 * t) * t + 1) * t, (t - 1) * t**2)
    weights = np.zeros((count, products.shape[1]))
    for k, share in enumerate(shares):
        np.add.at(weights, np.clip(below + k - 1, 0, count - 1), 0.5 * share[:, None] * products)
    return weights


@cache
def _luminance(illuminant: str) -> float:
    """The integral of the observer's y times an illuminant's power over nanometres."""
    return float(_pieces(illuminant, np.empty(0))[1][:, 1].sum())


@cache
def _mirror(illuminant: str) -> tuple[float, ...]:
    if illuminant in ILLUMINANTS:
        nm = _cie_table()[:, 0] * 1e-9
        return tuple(_trapezoid_weights(nm) @ observer(nm, illuminant))
    return tuple(_pieces(illuminant, np.empty(0))[1].sum(axis=0) / _luminance(illuminant))


def is_white(illuminant: str) -> bool:
    """Whether an illuminant may count as white: a lamp that is no laser's line, and not as coloured as an LED of one
    colour."""
    illuminant = first_of(illuminant)
    return line_of(illuminant) is None and (_REC_709 @ _mirror(illuminant)).min() > _LEAST_OF_WHITE


def white_xyz(illuminant: str = "D65") -> np.ndarray:
    """The XYZ (3,) of white, scaled to Y = 1: the illuminant's if it is_white, or else D65's."""
    return np.array(_mirror(first_of(illuminant) if is_white(illuminant) else "D65"))


def mirror_xyz(illuminant: str = "D65") -> np.ndarray:
    """The XYZ (3,) of the illuminant as a perfect mirror shows it, scaled to Y = 1."""
    illuminant = first_of(illuminant)
    line = line_of(illuminant)
    if line is None:
        return np.array(_mirror(illuminant))
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


_STEPS = 4001


def wavelength_quantiles(count: int, illuminant: str = "D65") -> np.ndarray:
    """Wavelengths (count,) in metres, each for an equal share of the observer's X + Y + Z.

    Samples at these wavelengths have the weight `drawn_weight`. A laser's line gives its own wavelength each time."""
    line = line_of(illuminant)
    if line is not None:
        return np.full(count, line)
    wavelengths = np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, _STEPS)
    density = observer(wavelengths, illuminant).sum(axis=1)
    share = np.concatenate([[0], np.cumsum(density[1:] + density[:-1])])
    return np.interp((np.arange(count) + 0.5) / count, share / share[-1], wavelengths)


def drawn_weight(illuminant: str = "D65") -> float:
    """The integral of the observer's X + Y + Z over all wavelengths."""
    return float(mirror_xyz(illuminant).sum())

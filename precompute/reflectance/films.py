# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflectance of a stack of thin films on a substrate, and the refractive indices of metals.

A stack is a product of characteristic matrices (Born and Wolf 1.6.2 and 14.4). E and H are the tangential fields of one
polarisation at an interface. The normal component of the wave vector is k0 q, with q^2 = n^2 - 1 + cos^2 ti. The
admittance eta is q for light polarised perpendicular to the plane of incidence (s), and n^2 / q for light polarised
parallel to it (p). At the substrate H = eta E. From the lower to the upper face of a layer of thickness t the fields
change to

    E' = (1 + a) E - a / eta H,   H' = (1 + a) H - a eta E,   a = (exp(2 i k0 q t) - 1) / 2

This is the characteristic matrix times exp(i k0 q t), a factor that does not change the reflectance. No entry grows
with the thickness, so absorbing and evanescent layers of any thickness are stable. For p the code swaps E and H, which
replaces eta by q / n^2. Then a / q is the only quotient, and it has the limit i k0 t at q = 0, the critical angle.

metals.csv holds the published values and names their sources in its header: McPeak et al. 2015 for aluminium, silver,
gold and copper, Johnson and Christy 1974 for chromium, nickel and titanium. The complex refractive indices n + ik are
interpolated linearly in wavelength between the published values, which are 5 to 10 nm apart in the first four tables
and 15 to 65 nm apart in the others."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np

# Elements of an array in one step. Arrays of this size stay in the processor's cache.
_AT_ONCE = 4096
# The fields are scaled back to 1 after this many layers. A layer multiplies a field by less than 1e5 (k0 t times n^2,
# at most 170 times 200 for 10 micrometres), so no field reaches 1e80 in between.
_LAYERS_TO_SCALE = 16

# E and H of one polarisation, or the three entries of a layer's matrix: complex arrays (r, m).
_Fields = tuple[np.ndarray, np.ndarray]
_Matrix = tuple[np.ndarray, np.ndarray, np.ndarray]


def stack_reflectance(
    wavelengths_m: np.ndarray, cosines: np.ndarray, indices: np.ndarray, *, thicknesses_m: Sequence[float]
) -> np.ndarray:
    """The power reflectance (n, m) of a stack in air for unpolarised light, from 0 to 1.

    wavelengths_m  wavelengths (n,) in metres, above 0
    cosines        cosines (m,) of the angle of incidence, from 0 to 1; at 0 the reflectance is 1
    indices        complex indices n + ik (l + 1, n) with n > 0 and k >= 0: the l layers', the outermost first, and
                   the substrate's
    thicknesses_m  thicknesses (l,) of the layers in metres"""
    wavelengths_m, cosines = np.asarray(wavelengths_m, dtype=float), np.asarray(cosines, dtype=float)
    squares = np.asarray(indices, dtype=complex)[:, :, None] ** 2
    result = np.empty((len(wavelengths_m), len(cosines)))
    step = max(1, _AT_ONCE // max(1, len(cosines)))
    for start in range(0, len(wavelengths_m), step):
        rows = slice(start, start + step)
        k0 = 2 * np.pi / wavelengths_m[rows, None]
        result[rows] = _reflectance(k0, cosines, squares[:, rows], thicknesses_m=thicknesses_m)
    return np.minimum(result, 1)  # rounding can exceed 1


def _reflectance(
    k0: np.ndarray, cosines: np.ndarray, squares: np.ndarray, *, thicknesses_m: Sequence[float]
) -> np.ndarray:
    """The reflectance (r, m) at wave numbers (r, 1), cosines (m,) and squared indices (l + 1, r, 1)."""
    q = np.sqrt(squares[-1] - 1 + cosines**2)
    s, p = (np.ones_like(q), q), (np.ones_like(q), q / squares[-1])
    # The equal layers of a periodic stack share their matrices.
    known: dict[tuple[bytes, float], tuple[_Matrix, _Matrix]] = {}
    for i in reversed(range(len(thicknesses_m))):
        key = squares[i].tobytes(), thicknesses_m[i]
        if key not in known:
            known[key] = _matrices(k0 * thicknesses_m[i], squares[i], cosines)
        s, p = _through(known[key][0], s), _through(known[key][1], p)
        if i % _LAYERS_TO_SCALE == 0:
            s, p = _scaled(s), _scaled(p)
    return (_power(s, cosines) + _power(p, cosines)) / 2


def _matrices(phase: np.ndarray, square: np.ndarray, cosines: np.ndarray) -> tuple[_Matrix, _Matrix]:
    """A layer's matrices for s and p, each as 1 + a, a / eta, a eta (for p 1 / eta takes the place of eta).

    phase (r, 1) is k0 t, square (r, 1) the squared index, cosines (m,) those of the angle of incidence."""
    if np.all(square == square[0]):
        square = square[:1]  # without dispersion one root serves all wavelengths
    q = np.sqrt(square - 1 + cosines**2)
    # (exp(2 i x) - 1) / 2 in real numbers, at two thirds of the time of a complex exponential.
    sine, cosine, loss = np.sin(phase * q.real), np.cos(phase * q.real), np.expm1(-2 * phase * q.imag)
    a = loss / 2 - (loss + 1) * sine * sine + 1j * ((loss + 1) * sine * cosine)
    limit = np.array(np.broadcast_to(1j * phase, a.shape))
    a_over_q, a_q = np.divide(a, q, out=limit, where=q != 0), a * q
    return (1 + a, a_over_q, a_q), (1 + a, a_over_q * square, a_q / square)


def _through(matrix: _Matrix, fields: _Fields) -> _Fields:
    """The fields at a layer's upper face, from the fields at its lower face."""
    diagonal, upper, lower = matrix
    return diagonal * fields[0] - upper * fields[1], diagonal * fields[1] - lower * fields[0]


def _scaled(fields: _Fields) -> _Fields:
    """The fields divided by the sum of their magnitudes. Their ratio stays."""
    scale = 1 / (np.abs(fields[0]) + np.abs(fields[1]))
    return fields[0] * scale, fields[1] * scale


def _power(fields: _Fields, cosines: np.ndarray) -> np.ndarray:
    """The reflectance (r, m) of one polarisation from the fields at the surface; 1 where nothing enters."""
    e, h = cosines * fields[0], fields[1]
    sum2 = (e.real + h.real) ** 2 + (e.imag + h.imag) ** 2
    return np.divide((e.real - h.real) ** 2 + (e.imag - h.imag) ** 2, sum2, out=np.ones_like(sum2), where=sum2 > 0)


METALS = ("aluminium", "silver", "gold", "copper", "chromium", "nickel", "titanium")


@cache
def _tables() -> dict[str, np.ndarray]:
    """Each metal's table (m, 3): wavelength in nanometres, ascending; n; k."""
    lines = Path(__file__).with_name("metals.csv").read_text(encoding="ascii").splitlines()
    rows = [line.split(",") for line in lines if not line.startswith("#")]
    return {metal: np.array([row[1:] for row in rows if row[0] == metal], dtype=float) for metal in METALS}


def metal_index(metal: str, wavelengths_m: np.ndarray) -> np.ndarray:
    """The complex refractive index n + ik (n,) of one of METALS at wavelengths (n,) in metres.

    Raises ValueError if a wavelength is outside the metal's table. Every table covers 380 to 780 nm."""
    table = _tables()[metal]
    nm = np.asarray(wavelengths_m, dtype=float) * 1e9
    if not np.all((nm >= table[0, 0]) & (nm <= table[-1, 0])):
        raise ValueError(f"{metal}: give wavelengths from {table[0, 0]:g} to {table[-1, 0]:g} nm")
    return np.interp(nm, table[:, 0], table[:, 1]) + 1j * np.interp(nm, table[:, 0], table[:, 2])

# SPDX-License-Identifier: GPL-3.0-or-later
"""Factors that turn a relief's spectrum into the efficiencies of its orders, for real and complex indices.

The efficiency of order m is a factor times |c_m(w)|^2, the relief's own spectrum at w = cos(ti) + cos(tr):

    Stam            R(half angle) (1 + wi.wr)^2 / (cos(ti) cos(tr) w^2)   (Stam 1999)
    O = 1           R(half angle)
    Harvey-Shack    R(half angle) w^2 / (4 cos(ti) cos(tr))               (Krywonos 2006)
    small slope     4 cos(ti) cos(tr) Q / w^2                             (Voronovich 1994)

All take unit vectors wi (3,) to the light and wr (3,) along the order, and the index of refraction n + ik. The add-on
has the same formulas for real indices (precompute/optics).
"""

from collections.abc import Callable

import numpy as np

from precompute.reflectance.matter import Matter

Factor = Callable[[np.ndarray, np.ndarray, complex], float]


def reflectance(cosine: float, index: complex) -> float:
    """The power reflectance of a flat surface for unpolarised light, by the code that bakes have."""
    one_wavelength = np.ones(1)  # of any length: the index is given, and there are no layers
    return float(Matter(complex(index)).reflectance(one_wavelength, np.array([cosine]))[0, 0])


def small_slope_reflectance(wi: np.ndarray, wr: np.ndarray, index: complex) -> float:
    """Q of docs/theory.md (BRDF) with a complex permittivity: each amplitude counts by its squared modulus."""
    permittivity = complex(index) ** 2
    cos_i, cos_r = wi[2], wr[2]
    in_i, in_r = np.sqrt(permittivity - 1 + cos_i**2), np.sqrt(permittivity - 1 + cos_r**2)
    along = wi[0] * wr[0] + wi[1] * wr[1]
    sines = max((1 - cos_i**2) * (1 - cos_r**2), 1e-12)
    cos2 = min(along**2 / sines, 1.0)  # of the azimuth from wi to wr
    te_i, te_r = (cos_i + in_i) ** 2, (cos_r + in_r) ** 2
    tm_i, tm_r = (permittivity * cos_i + in_i) ** 2, (permittivity * cos_r + in_r) ** 2
    powers = (
        cos2 / abs(te_i * te_r),
        (1 - cos2) * abs(in_i**2 / (tm_i * te_r)),
        (1 - cos2) * abs(in_r**2 / (te_i * tm_r)),
        abs(in_i * in_r * along + permittivity * sines) ** 2 / abs(sines * tm_i * tm_r),
    )
    return abs(permittivity - 1) ** 2 / 2 * float(sum(powers))


def _half(wi: np.ndarray, wr: np.ndarray, index: complex) -> float:
    return reflectance(np.sqrt((1 + wi @ wr) / 2), index)


FACTORS: dict[str, Factor] = {
    "Stam": lambda wi, wr, n: _half(wi, wr, n) * (1 + wi @ wr) ** 2 / (wi[2] * wr[2] * (wi[2] + wr[2]) ** 2),
    "O = 1": _half,
    "Harvey-Shack": lambda wi, wr, n: _half(wi, wr, n) * (wi[2] + wr[2]) ** 2 / (4 * wi[2] * wr[2]),
    "small slope": lambda wi, wr, n: 4 * wi[2] * wr[2] * small_slope_reflectance(wi, wr, n) / (wi[2] + wr[2]) ** 2,
}

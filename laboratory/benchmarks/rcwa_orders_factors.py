# SPDX-License-Identifier: GPL-3.0-or-later
"""Factors that turn a relief's spectrum into the efficiencies of its orders, for real and complex indices.

The efficiency of order m is a factor times |c_m(w)|^2, the relief's own spectrum at w = cos(ti) + cos(tr):

    Stam            R(half angle) (1 + wi.wr)^2 / (cos(ti) cos(tr) w^2)   (Stam 1999)
    O = 1           R(half angle)
    Harvey-Shack    R(half angle) w^2 / (4 cos(ti) cos(tr))               (Krywonos 2006)
    small slope     4 cos(ti) cos(tr) Q / w^2                             (Voronovich 1994)
    ratio form      R(half angle) times small slope over Fresnel's reflectance, both at the substrate's ratio_ior

All take unit vectors wi (3,) to the light and wr (3,) along the order, the index of refraction n + ik, and the films on
it (index and thickness in wavelengths, the outermost first). The add-on has the same formulas for real indices without
films (precompute/optics), and the ratio form for metals and films. With films Q is known in the plane of incidence
only.
"""

from collections.abc import Callable, Sequence

import numpy as np

from precompute.optics.brdf import ratio_ior_of, scattering_factor
from precompute.reflectance.films import stack_reflectance

from .rcwa import Films

Factor = Callable[[np.ndarray, np.ndarray, complex, Films], float]


def reflectance(cosine: float, index: complex, films: Films = ()) -> float:
    """The power reflectance of a flat surface for unpolarised light, by the code that bakes have."""
    indices = np.array([[film] for film, _ in films] + [[index]])
    thicknesses = [thickness for _, thickness in films]
    return float(stack_reflectance(np.ones(1), np.array([cosine]), indices, thicknesses_m=thicknesses)[0, 0])


def obliquity(wi: np.ndarray, wr: np.ndarray) -> float:
    """Stam's O of docs/theory.md (BRDF)."""
    return (1 + wi @ wr) ** 2 / (wi[2] * wr[2] * (wi[2] + wr[2]) ** 2)


def small_slope_reflectance(wi: np.ndarray, wr: np.ndarray, index: complex, films: Films = ()) -> float:
    """Q of docs/theory.md (BRDF) with a complex permittivity: each amplitude counts by its squared modulus."""
    if films:
        return _small_slope_films(wi, wr, index, films)
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


def _small_slope_films(wi: np.ndarray, wr: np.ndarray, index: complex, films: Films) -> float:
    """Q of films that follow the relief: the first order in the heights, of all faces together.

    A face that rises by h changes the permittivity in a sheet. The sheet radiates into the order as strongly as the
    order's own wave, sent backwards, lights the sheet (reciprocity). So each face adds the product of the fields of wi
    and wr there. E along the face and D across it are continuous, so the steps of e and of 1 / e multiply these."""
    permittivities = np.array([1, *(film for film, _ in films), index], dtype=complex) ** 2
    thicknesses = [thickness for _, thickness in films]
    step, inverse_step = np.diff(permittivities), np.diff(1 / permittivities)
    te_i, te_r = (_fields(cosine, permittivities, thicknesses, te=True)[0] for cosine in (wi[2], wr[2]))
    (h_i, e_i), (h_r, e_r) = (_fields(cosine, permittivities, thicknesses, te=False) for cosine in (wi[2], wr[2]))
    te = np.sum(step * te_i * te_r)
    tm = np.sum(step * e_i * e_r - inverse_step * wi[0] * wr[0] * h_i * h_r)
    return float((abs(te) ** 2 + abs(tm) ** 2) / (32 * wi[2] ** 2 * wr[2] ** 2))


def _fields(
    cosine: float, permittivities: np.ndarray, thicknesses: Sequence[float], *, te: bool
) -> tuple[np.ndarray, np.ndarray]:
    """The fields along the grooves and across them (faces,) at each face of flat films, the outermost first.

    The incident wave has the amplitude 1. The equations are those of docs/theory.md (Films)."""
    q = np.sqrt(permittivities - 1 + cosine**2)
    admittances = q if te else q / permittivities
    fields = [np.array([1, admittances[-1]])]
    for number in reversed(range(len(thicknesses))):
        turn, admittance = 2 * np.pi * q[number + 1] * thicknesses[number], admittances[number + 1]
        mix = -1j * np.sin(turn) * np.array([[0, 1 / admittance], [admittance, 0]])
        fields.append((np.cos(turn) * np.eye(2) + mix) @ fields[-1])
    incident = (fields[-1][0] + fields[-1][1] / cosine) / 2
    along, across = np.array(fields[::-1]).T / incident
    return along, across


def _half(wi: np.ndarray, wr: np.ndarray, index: complex, films: Films = ()) -> float:
    return reflectance(np.sqrt((1 + wi @ wr) / 2), index, films)


def _stam(wi: np.ndarray, wr: np.ndarray, index: complex, films: Films = ()) -> float:
    return _half(wi, wr, index, films) * obliquity(wi, wr)


def _harvey_shack(wi: np.ndarray, wr: np.ndarray, index: complex, films: Films = ()) -> float:
    return _half(wi, wr, index, films) * (wi[2] + wr[2]) ** 2 / (4 * wi[2] * wr[2])


def _small_slope(wi: np.ndarray, wr: np.ndarray, index: complex, films: Films = ()) -> float:
    return 4 * wi[2] * wr[2] * small_slope_reflectance(wi, wr, index, films) / (wi[2] + wr[2]) ** 2


def _ratio(wi: np.ndarray, wr: np.ndarray, index: complex, films: Films = ()) -> float:
    factor = float(scattering_factor(wi, wr, ratio_ior=ratio_ior_of(index))) / (wi[2] * (wi[2] + wr[2]) ** 2)
    return _half(wi, wr, index, films) * factor


# What the materials of metals and films have, before the division by a bake's largest albedo.
RATIO = "ratio form"
FACTORS: dict[str, Factor] = {
    "Stam": _stam,
    "O = 1": _half,
    "Harvey-Shack": _harvey_shack,
    "small slope": _small_slope,
    RATIO: _ratio,
}

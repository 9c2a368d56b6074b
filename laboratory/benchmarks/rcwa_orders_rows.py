# SPDX-License-Identifier: GPL-3.0-or-later
"""The orders of many gratings: by Maxwell's equations, and by factors that turn a relief's spectrum into the
efficiencies of its orders.

The gratings are in keratin, in the plane of incidence and out of it, and in metals and under films in the plane.
rcwa_layers.py solves Maxwell's equations in the plane, Inkstone out of it (rcwa.py). Lengths are in wavelengths.

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

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product

import numpy as np

from precompute.optics.brdf import ratio_ior_of, scattering_factor
from precompute.reflectance.films import metal_index, stack_reflectance
from precompute.reflectance.matter import Index, parse

from ..study.efficiency import PROFILES, profile
from . import rcwa, rcwa_layers
from .rcwa import EXTRA_ORDERS, Films, Grating

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


PERIODS = (1.1, 1.5, 2.5, 4.5, 8.5)
DEPTHS = (0.05, 0.1, 0.2, 0.25, 0.4, 0.5)
SHALLOW, DEEP = DEPTHS[:3], 0.4
ANGLES_DEG = (0.0, 20.0, 40.0, 60.0, 65.0, 70.0, 75.0, 85.0)
# The angles of the sums, of light out of the plane of incidence, and of light on metal.
SUM_ANGLES_DEG = (0.0, 20.0, 40.0, 60.0, 75.0, 85.0)
AZIMUTHS_DEG = (45.0, 90.0)
METALS = {"aluminium": 0.96 + 6.69j, "gold": 0.42 + 2.35j, "chromium": 3.18 + 3.33j}
FILMS = {
    "film on aluminium": "1.46/120nm, aluminium",
    "film on a dielectric": "2.3/120nm, 1.56",
    "12 layers": "6x(1.68/80nm, 1.56/90nm), 1.56",
}
# The wavelengths in nanometres at which films are compared: their reflectance depends on it.
WAVELENGTHS_NM = (450.0, 550.0, 650.0)
_SAMPLES = 4096
# RCWA needs more orders in a metal: at a wall the field of TM light is nearly singular.
_METAL_EXTRA = 20
# A smaller ratio means that the relief has no such order in scalar theory, as the even orders of a binary grating.
_NOTHING = 1e-9


@dataclass(frozen=True)
class Row:
    """One order: the fraction of the incident light by RCWA, and by each factor."""

    case: Grating
    order: int
    larger_angle_deg: float
    rigorous: float
    scalar: dict[str, float]


@dataclass(frozen=True)
class Total:
    """All orders of a case together: fractions of the incident light, and the reflectance of a flat surface."""

    case: Grating
    flat: float
    rigorous: float
    scalar: dict[str, float]


def rigorous_orders(case: Grating, most: int, **accuracy: int) -> np.ndarray:
    """The power of the reflected orders -most to most over the incident power, mean of TE and TM."""
    solver = rcwa if case.azimuth_deg else rcwa_layers
    powers = solver.reflected(case, **accuracy)[:, :-1].mean(axis=0)
    middle = len(powers) // 2
    return powers[middle - most : middle + most + 1]


def directions(case: Grating, order: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Unit vectors to the light and along an order, away from the surface; None for an order that does not leave it."""
    theta, azimuth = np.radians([case.theta_deg, case.azimuth_deg])
    along = np.sin(theta) * np.array([np.cos(azimuth), np.sin(azimuth)])  # of the incident ray
    x, y = along[0] + order / case.period, along[1]
    height2 = 1 - x * x - y * y
    if height2 < 1e-4:
        return None
    return np.array([-along[0], -along[1], np.cos(theta)]), np.array([x, y, np.sqrt(height2)])


def spectrum(case: Grating, order: int, w: float) -> float:
    """|c_m(w)|^2: the efficiency of an order for a surface that reflects everything, by the discrete Fourier series."""
    height = profile(case.kind, case.depth, _SAMPLES, duty=case.duty)
    x = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    return float(np.abs(np.mean(np.exp(-2j * np.pi * (w * height + order * x)))) ** 2)


def extra_orders(case: Grating) -> int:
    """The number of orders that RCWA keeps beyond the orders that propagate in the matter."""
    return _METAL_EXTRA if complex(case.index).imag else EXTRA_ORDERS


def scalar_orders(case: Grating) -> Iterator[tuple[int, float, dict[str, float]]]:
    """Each order that leaves the surface, the larger of its two angles in degrees, and its light by each factor."""
    most = int(2 * case.period) + 1
    for order in range(-most, most + 1):
        if (ways := directions(case, order)) is None:
            continue
        wi, wr = ways
        power = spectrum(case, order, wi[2] + wr[2])
        light = {name: factor(wi, wr, case.index, case.films) * power for name, factor in FACTORS.items()}
        yield order, round(float(np.degrees(np.arccos(min(wi[2], wr[2])))), 6), light


def holds_reflectance(case: Grating) -> bool:
    """Whether a bake of the case holds its reflectance: metals and films."""
    return bool(complex(case.index).imag or case.films)


def flat_reflectance(case: Grating) -> float:
    """The reflectance of a flat surface under the case's light."""
    return reflectance(np.cos(np.radians(case.theta_deg)), case.index, case.films)


def measure(case: Grating) -> tuple[list[Row], Total]:
    """The orders of a case that leave the surface, and their sum."""
    most = int(2 * case.period) + 1
    rigorous = rigorous_orders(case, most, extra=extra_orders(case))
    rows = []
    for order, larger, light in scalar_orders(case):
        rows.append(Row(case, order, larger, float(rigorous[order + most]), light))
    sums = {name: sum(row.scalar[name] for row in rows) for name in rows[0].scalar}
    return rows, Total(case, flat_reflectance(case), float(rigorous.sum()), sums)


def cases(*, quick: bool = False) -> list[Grating]:
    """All cases: keratin in the plane of incidence and out of it, then each metal in the plane."""
    periods, depths, angles = (PERIODS[:1], DEPTHS[::3], ANGLES_DEG[::3]) if quick else (PERIODS, DEPTHS, ANGLES_DEG)
    fewer = (60.0,) if quick else SUM_ANGLES_DEG
    found = [Grating(*each) for each in product(PROFILES, periods, depths, angles)]
    depths_out_of_plane = depths[:1] if quick else (*SHALLOW, DEEP)
    conical = [Grating(*each) for each in product(PROFILES, periods[:4], depths_out_of_plane, fewer) if each[-1]]
    found += [replace(case, azimuth_deg=azimuth) for case in conical for azimuth in AZIMUTHS_DEG]
    shallow = [Grating(*each) for each in product(PROFILES, periods[:4], depths[:1] if quick else SHALLOW, fewer)]
    found += [replace(case, index=index) for index in METALS.values() for case in shallow]
    under = [each for name in FILMS for each in films_of(name)[: 1 if quick else None]]
    return found + [replace(case, index=index, films=films) for index, films in under for case in shallow]


@cache
def films_of(name: str) -> list[tuple[complex, Films]]:
    """The substrate's index and the films of one of FILMS, at each of WAVELENGTHS_NM."""
    matter, found = parse(FILMS[name]), []
    for nm in WAVELENGTHS_NM:
        films = tuple((_index_at(layer.index, nm), layer.thickness_nm / nm) for layer in matter.layers)
        found.append((_index_at(matter.substrate, nm), films))
    return found


def _index_at(index: Index, wavelength_nm: float) -> complex:
    return complex(metal_index(index, np.array([wavelength_nm * 1e-9]))[0] if isinstance(index, str) else index)


def is_of(case: Grating, name: str) -> bool:
    """Whether a case is of one of METALS or FILMS."""
    if name in METALS:
        return not case.films and case.index == METALS[name]
    return (case.index, case.films) in films_of(name)


def steep() -> list[Grating]:
    """Gratings beyond the limits of every form, to see how much light the forms make there."""
    return [Grating(*each) for each in product(PROFILES, (0.55, 0.8), (0.5, 0.7), SUM_ANGLES_DEG)]


def off_by(rows: Iterable[Row], name: str) -> np.ndarray:
    """The factor (n,), at least 1, by which each row's order is off; infinite for an order that scalar theory lacks."""
    ratio = np.array([row.scalar[name] / row.rigorous for row in rows])
    with np.errstate(divide="ignore"):
        return np.where(ratio > _NOTHING, np.maximum(ratio, 1 / ratio), np.inf)

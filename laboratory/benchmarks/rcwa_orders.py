# SPDX-License-Identifier: GPL-3.0-or-later
"""How far each order's efficiency is from Maxwell's equations, by four factors of the spectrum.

    ./dev bench rcwa_orders [--quick] [--output DIR] [--json FILE|-]

The efficiency of order m is a factor times |c_m(w)|^2, the relief's own spectrum at w = cos(ti) + cos(tr):

    Stam            R(half angle) (1 + wi.wr)^2 / (cos(ti) cos(tr) w^2)   (Stam 1999)
    O = 1           R(half angle)
    Harvey-Shack    R(half angle) w^2 / (4 cos(ti) cos(tr))               (Krywonos 2006)
    small slope     4 cos(ti) cos(tr) Q / w^2                             (Voronovich 1994)

Inkstone solves Maxwell's equations for gratings in the plane of incidence and out of it (rcwa.py). Lengths are in
wavelengths. Orders of less than LEAST of the light are left out: RCWA's own error is about that large.
"""

import importlib.util
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from precompute.cli.parser import OneLineParser
from precompute.optics.brdf import half_angle_cosine, scattering_factor
from precompute.optics.fresnel import fresnel_reflectance

from ..study.efficiency import PROFILES, profile
from . import report
from .rcwa import Grating, reflected

PERIODS = (1.1, 1.5, 2.5, 4.5)
DEPTHS = (0.05, 0.1, 0.2, 0.25, 0.4)
ANGLES_DEG = (0.0, 20.0, 40.0, 60.0, 75.0)
AZIMUTHS_DEG = (0.0, 45.0, 90.0)
RANGES_DEG = ((0, 30), (30, 60), (60, 75), (75, 90))
LEAST = 1e-4
_SHALLOW = 0.2
_SAMPLES = 4096
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


FACTORS: dict[str, Callable[[np.ndarray, np.ndarray, float], np.ndarray]] = {
    "Stam": lambda wi, wr, n: scattering_factor(wi, wr, n, stam=True) / (wi[2] * (wi[2] + wr[2]) ** 2),
    "O = 1": lambda wi, wr, n: _reflectance(wi, wr, n),
    "Harvey-Shack": lambda wi, wr, n: _reflectance(wi, wr, n) * (wi[2] + wr[2]) ** 2 / (4 * wi[2] * wr[2]),
    "small slope": lambda wi, wr, n: scattering_factor(wi, wr, n) / (wi[2] * (wi[2] + wr[2]) ** 2),
}


def _reflectance(wi: np.ndarray, wr: np.ndarray, index: float) -> np.ndarray:
    return fresnel_reflectance(half_angle_cosine(wi, wr), index)


def rigorous_orders(case: Grating, most: int, **accuracy: int) -> np.ndarray:
    """The power of the reflected orders -most to most over the incident power, mean of TE and TM."""
    powers = reflected(case, **accuracy)[:, :-1].mean(axis=0)
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
    height = profile(case.kind, case.depth, _SAMPLES)
    x = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    return float(np.abs(np.mean(np.exp(-2j * np.pi * (w * height + order * x)))) ** 2)


def rows_of(case: Grating, **accuracy: int) -> Iterator[Row]:
    """The orders of a case that leave the surface and hold at least LEAST of the light."""
    most = int(2 * case.period) + 1
    rigorous = rigorous_orders(case, most, **accuracy)
    for order in range(-most, most + 1):
        if (ways := directions(case, order)) is None or rigorous[order + most] < LEAST:
            continue
        wi, wr = ways
        power = spectrum(case, order, wi[2] + wr[2])
        scalar = {name: float(factor(wi, wr, case.index)) * power for name, factor in FACTORS.items()}
        larger = float(np.degrees(np.arccos(min(wi[2], wr[2]))))
        yield Row(case, order, larger, float(rigorous[order + most]), scalar)


def cases(*, quick: bool = False) -> list[Grating]:
    """All cases: every profile in the plane of incidence, and sinusoids out of it."""
    periods, depths = (PERIODS[1:3], DEPTHS[:3:2]) if quick else (PERIODS, DEPTHS)
    found = [Grating(*each) for each in product(PROFILES, periods, depths, ANGLES_DEG)]
    conical = [Grating(*each) for each in product(PROFILES[:1], periods, depths, ANGLES_DEG[1:])]
    return found + [replace(case, azimuth_deg=azimuth) for case in conical for azimuth in AZIMUTHS_DEG[1:]]


def off_by(rows: Iterable[Row], name: str) -> np.ndarray:
    """The factor, at least 1, by which each row's order is off; infinite for an order that scalar theory lacks."""
    ratio = np.array([row.scalar[name] / row.rigorous for row in rows])
    with np.errstate(divide="ignore"):
        return np.where(ratio > _NOTHING, np.maximum(ratio, 1 / ratio), np.inf)


def table(rows: list[Row]) -> str:
    """Median (90th percentile) by the range of the larger angle, for groups of orders."""
    groups = {
        "first orders, depth to 0.2, in the plane": lambda row: (
            abs(row.order) == 1 and row.case.depth <= _SHALLOW and row.case.azimuth_deg == 0
        ),
        "first orders, depth to 0.2, out of the plane": lambda row: (
            abs(row.order) == 1 and row.case.depth <= _SHALLOW and row.case.azimuth_deg > 0
        ),
        "other orders but the mirror image, depth to 0.2": lambda row: (
            abs(row.order) > 1 and row.case.depth <= _SHALLOW
        ),
        "mirror image, depth to 0.2": lambda row: row.order == 0 and row.case.depth <= _SHALLOW,
        "first orders, depth 0.4": lambda row: abs(row.order) == 1 and row.case.depth == DEPTHS[-1],
    }
    lines = [f"{'degrees':<9}" + "".join(f"{name:>22}" for name in FACTORS)]
    for title, belongs in groups.items():
        lines += ["", title]
        for low, high in RANGES_DEG:
            chosen = [row for row in rows if belongs(row) and low <= row.larger_angle_deg < high]
            if not chosen:
                continue
            cells = []
            for name in FACTORS:
                off = off_by(chosen, name)
                cells.append(f"{np.median(off):14.2f} ({np.quantile(off, 0.9, method='higher'):5.2f})")
            lines.append(f"{low:>2} - {high:<4}" + "".join(f"{cell:>22}" for cell in cells) + f"{len(chosen):>6}")
    return "\n".join(lines)


def main(argv: list[str] | None = None) -> None:
    """Print the table; write rcwa_orders.txt."""
    parser = OneLineParser(prog="./dev bench rcwa_orders", description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("dist", "benchmarks"), metavar="DIR")
    parser.add_argument("--quick", action="store_true", help="two periods and two depths")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    if importlib.util.find_spec("inkstone") is None:
        sys.exit("error: inkstone is not here; remedy: ./dev bench rcwa_orders, in the environment py311-bpy45")
    arguments.output.mkdir(parents=True, exist_ok=True)
    rows = [row for case in cases(quick=arguments.quick) for row in rows_of(case)]
    text = table(rows)
    report.say(text, arguments.json)
    (arguments.output / "rcwa_orders.txt").write_text(text + "\n")
    report.write({"rows": [asdict(row) for row in rows]}, arguments.json)


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: GPL-3.0-or-later
"""Where scalar theory holds: its efficiencies compared with rigorous coupled-wave analysis (RCWA) on keratin.

    ./dev bench rcwa [--json FILE|-]

Inkstone solves Maxwell's equations (Fourier modal method; 1D gratings, TE and TM separately). Of the packages tried it
alone conserved energy to 1e-10 everywhere: grcwa 0.1.2 reflected 285 times the incident light from a binary grating of
10.3 wavelengths, and meent 0.13.2 lost up to 1.6 % of the light on a blaze. Lengths are in wavelengths.

The result is the largest |difference| of an order, over the propagating orders among -3 to 3. An order of RCWA is the
mean of TE and TM, divided by the mean of the total reflected power. laboratory/study/efficiency.py computes the scalar
orders, with O = 1. For RCWA a ramp and a sinusoid are staircases of PARTS equal steps per period, sampled at the same
places as in efficiency.py.
"""

import importlib.util
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from precompute.cli.parser import OneLineParser

from ..study.efficiency import PROFILES, efficiencies, profile
from . import report

PERIODS = (1.1, 1.5, 2.5, 3.5, 5.5, 10.5, 20.5)
DEPTHS = (0.02, 0.05, 0.1, 0.25, 0.5)
ANGLES_DEG = (0.0, 40.0, 60.0)
TOLERANCES = (0.01, 0.02, 0.05)
KERATIN = 1.56
PARTS = 32
# The number of orders that RCWA keeps beyond the orders that propagate in the keratin.
EXTRA_ORDERS = 10
_COMPARED = 3

# The index of each film and its vertical thickness, the outermost first.
Films = tuple[tuple[complex, float], ...]


@dataclass(frozen=True)
class Grating:
    """A grating along x, in keratin by default, under light at theta_deg from the normal and at azimuth_deg from x.

    Lengths are in wavelengths. Only rcwa_layers.py solves for films, whose faces are the relief shifted up, and for
    ridges of another duty than a half of the period."""

    kind: str
    period: float
    depth: float
    theta_deg: float = 0.0
    azimuth_deg: float = 0.0
    index: complex = KERATIN
    films: Films = ()
    duty: float = 0.5


@dataclass(frozen=True)
class Row:
    """The largest difference of an order as a share of the reflected power, and this power over a flat surface's."""

    grating: Grating
    difference: float
    reflectance: float


def steps(kind: str, parts: int) -> list[tuple[float, float, float]]:
    """(thickness, width, centre) of each layer from the top; thickness in depths, the others in periods."""
    height = np.round(profile(kind, 1.0, parts), 12)
    levels = np.unique(height)[::-1]
    x = (np.arange(parts) + 0.5) / parts
    found = []
    for top, bottom in zip(levels, levels[1:], strict=False):
        solid = height > bottom
        turn = np.angle(np.sum(np.exp(2j * np.pi * x[solid]))) / (2 * np.pi)
        found.append((float(top - bottom), float(solid.mean()), float(turn)))
    return found


def reflected(grating: Grating, parts: int = PARTS, extra: int = EXTRA_ORDERS) -> np.ndarray:
    """Powers (2, orders + 1) of TE and TM over the incident power: reflected orders -n to n, then transmission."""
    from inkstone import Inkstone

    most = int(np.ceil(abs(grating.index) * grating.period)) + extra
    solver = Inkstone()
    solver.lattice, solver.num_g, solver.frequency = grating.period, 2 * most + 1, 1.0
    solver.AddMaterial("matter", complex(grating.index) ** 2)
    solver.AddLayer("above", 0, "vacuum")
    for number, (thickness, width, centre) in enumerate(steps(grating.kind, parts)):
        name = f"step {number}"
        solver.AddLayer(name, thickness * grating.depth, "vacuum")
        across = (width * grating.period, centre * grating.period)
        # Inkstone's correction of the Gibbs phenomenon smooths the walls; convergence is then only 1 / orders.
        solver.AddPattern1D(name, "matter", *across, name, if_gibbs_correction=False)
        _factorise(solver.layers[name])
    solver.AddLayer("below", 0, "matter")
    powers = []
    for te in (1.0, 0.0):
        solver.SetExcitation(grating.theta_deg, grating.azimuth_deg, te, 1 - te)
        incident, _ = solver.GetPowerFlux("above")
        _, back = solver.GetPowerFluxByOrder("above", list(range(-most, most + 1)))
        powers.append(np.append(-np.ravel(back), solver.GetPowerFlux("below")[0]) / incident)
    return np.array(powers)


def _factorise(layer: Any) -> None:
    """Make a layer of Inkstone converge for TM light: give E across and along the walls their matrices of Li (1996).

    For E along the walls Inkstone takes the Fourier series of 1 / e instead of the inverse of the series of e. A first
    order of a binary grating in aluminium then still changes by 17 % in TM light from 10 to 30 extra orders."""
    construct = layer._cons_ep_mu_cm_3d

    def constructed() -> None:
        construct()
        layer.epxxcm, layer.eizzcm = np.linalg.inv(layer.eixxcm), np.linalg.inv(layer.epzzcm)

    layer._cons_ep_mu_cm_3d = constructed


def fresnel(theta_deg: float, index: complex = KERATIN) -> np.ndarray:
    """Power reflectances (TE, TM) of a flat surface (Born and Wolf 1.5.2)."""
    cosine = np.cos(np.radians(theta_deg))
    inside = np.sqrt(index**2 - 1 + cosine**2 + 0j)
    te = (cosine - inside) / (cosine + inside)
    tm = (index**2 * cosine - inside) / (index**2 * cosine + inside)
    return np.abs([te, tm]) ** 2


def fractions(powers: np.ndarray) -> dict[int, float]:
    """Orders -3 to 3 of `reflected` as fractions of the total reflected power, mean of TE and TM."""
    mean = powers[:, :-1].mean(axis=0)
    most = len(mean) // 2
    return {order: float(mean[order + most] / mean.sum()) for order in range(-_COMPARED, _COMPARED + 1)}


def compare(grating: Grating, **accuracy: int) -> Row:
    """Scalar theory against RCWA; `accuracy` holds `parts` and `extra` of `reflected`."""
    powers = reflected(grating, **accuracy)
    rigorous = fractions(powers)
    scalar = efficiencies(
        grating.kind, period_m=grating.period * 1e-6, depth_m=grating.depth * 1e-6, wavelength_m=1e-6,
        theta_i=np.radians(grating.theta_deg), orders=_COMPARED,
    )  # fmt: skip
    difference = max(abs(rigorous[one.order] - one.computed) for one in scalar)
    return Row(grating, difference, float(powers[:, :-1].sum() / fresnel(grating.theta_deg).sum()))


def table() -> list[Row]:
    """A row for each angle, profile, period and depth."""
    return [
        compare(Grating(kind, period, depth, theta))
        for theta in ANGLES_DEG
        for kind in PROFILES
        for period in PERIODS
        for depth in DEPTHS
    ]


def smallest_period(rows: Iterable[Row], tolerance: float) -> float | None:
    """The smallest period from which on every difference is within the tolerance; None if no period qualifies."""
    worst: dict[float, float] = {}
    for row in rows:
        worst[row.grating.period] = max(worst.get(row.grating.period, 0.0), row.difference)
    smallest = None
    for period in sorted(worst, reverse=True):
        if worst[period] > tolerance:
            break
        smallest = period
    return smallest


def convergence() -> list[tuple[Grating, float, float]]:
    """The change of an order's fraction with twice the parts, and with four times the extra orders."""
    found = []
    for kind in PROFILES:
        for period, depth, theta in ((1.5, 0.5, 40.0), (10.5, 0.1, 0.0), (10.5, 0.25, 60.0)):
            grating = Grating(kind, period, depth, theta)
            usual = fractions(reflected(grating))
            finer = [reflected(grating, parts=2 * PARTS), reflected(grating, extra=4 * EXTRA_ORDERS)]
            changes = [max(abs(fractions(one)[order] - usual[order]) for order in usual) for one in finer]
            found.append((grating, *changes))
    return found


def as_text(rows: list[Row], checked: list[tuple[Grating, float, float]]) -> str:
    """The printed tables."""
    return "\n\n".join([*map(_differences, [rows] * len(ANGLES_DEG), ANGLES_DEG), _finer(checked), boundary(rows)])


def _differences(rows: list[Row], theta_deg: float) -> str:
    lines = [
        "largest difference of an order, % of the reflected power (reflected power over a flat surface's)",
        f"{f'light at {theta_deg:g} degrees':<22}" + "".join(f"{f'depth {depth:g}':>15}" for depth in DEPTHS),
    ]
    for kind in PROFILES:
        for period in PERIODS:
            cells = [
                f"{100 * row.difference:8.2f} ({row.reflectance:4.2f})"
                for row in rows
                if (row.grating.kind, row.grating.period, row.grating.theta_deg) == (kind, period, theta_deg)
            ]
            lines.append(f"{kind:<12}{f'period {period:g}':>10}" + "".join(cells))
    return "\n".join(lines)


def _finer(checked: list[tuple[Grating, float, float]]) -> str:
    lines = ["what finer RCWA changes of an order, % of the reflected power"]
    for grating, parts, orders in checked:
        name = f"{grating.kind:<12}{f'period {grating.period:g}':>11}, depth {grating.depth:g}"
        lines.append(
            f"{name}, {grating.theta_deg:g} degrees: {100 * parts:.3f} with {2 * PARTS} parts, "
            f"{100 * orders:.3f} with {4 * EXTRA_ORDERS} extra orders"
        )
    return "\n".join(lines)


def boundary(rows: list[Row]) -> str:
    """A sentence for each depth and angle: the period above which scalar theory holds for every profile."""
    sentences = []
    for depth in DEPTHS:
        for theta in ANGLES_DEG:
            chosen = [row for row in rows if (row.grating.depth, row.grating.theta_deg) == (depth, theta)]
            known = []
            for tolerance in TOLERANCES:
                period = smallest_period(chosen, tolerance)
                known.append(f"{tolerance:.0%} " + (f"from period {period:g}" if period else "at none"))
            sentences.append(f"depth {depth:g}, light at {theta:g} degrees: within " + ", ".join(known))
    return "\n".join(sentences)


def main(argv: list[str] | None = None) -> None:
    """Print the tables and the boundary."""
    parser = OneLineParser(prog="./dev bench rcwa", description=__doc__.splitlines()[0])
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    if importlib.util.find_spec("inkstone") is None:
        sys.exit("error: inkstone is not here; remedy: ./dev bench rcwa, in the environment py311-bpy45")
    rows, checked = table(), convergence()
    report.say(as_text(rows, checked), arguments.json)
    finer = [{"grating": asdict(grating), "parts": parts, "orders": orders} for grating, parts, orders in checked]
    report.write({"rows": [asdict(row) for row in rows], "finer": finer}, arguments.json)

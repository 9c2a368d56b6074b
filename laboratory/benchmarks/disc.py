# SPDX-License-Identifier: GPL-3.0-or-later
"""The orders of discs in air and under their plate, by Maxwell's equations and by a bake's formula.

    ./dev bench disc [--json FILE|-]

A disc is taken as a continuous groove in aluminium, with the pitch, width and depth of its sample. A plate of
polycarbonate is in front of it, or none. An order is its power over the incident power. Inside a plate the groove acts
like one that is n times as large in air, in a matter of the relative index (precompute/optics/plate.py); the front face
lets T of the light through on the way in and on the way out. rcwa_layers.py solves Maxwell's equations. The bake's
formula is the ratio form (precompute/optics/brdf.py).
"""

from dataclasses import asdict, dataclass

import numpy as np

from precompute.cli.parser import OneLineParser
from precompute.optics.brdf import fresnel_reflectance
from precompute.optics.plate import NO_PLATE
from precompute.reflectance.films import metal_index

from . import report
from .rcwa import Grating
from .rcwa_orders_factors import RATIO
from .rcwa_orders_rows import rigorous_orders, scalar_orders

POLYCARBONATE = 1.585
# Pitch, width and depth in nanometres, of the samples (precompute/surface/samples/discs.py).
DISCS = {"CD": (1600.0, 500.0, 110.0), "DVD": (740.0, 320.0, 105.0)}
WAVELENGTHS_NM = (450.0, 550.0, 650.0)
ANGLES_DEG = (0.0, 30.0, 60.0)
# A metal's walls need more orders, and a width of 10 / 32 of the pitch needs as many columns.
_EXTRA, _PARTS = 20, 160


@dataclass(frozen=True)
class Row:
    """An order of a disc, as shares of the incident light."""

    disc: str
    plate_ior: float
    wavelength_nm: float
    theta_deg: float
    order: int
    rigorous: float
    ours: float


def rows_of(disc: str, plate_ior: float, wavelength_nm: float, theta_deg: float) -> list[Row]:
    """The orders -1, 0 and 1 that leave the disc."""
    pitch, width, depth = (size / wavelength_nm * plate_ior for size in DISCS[disc])
    inside = np.degrees(np.arcsin(np.sin(np.radians(theta_deg)) / plate_ior))
    index = complex(metal_index("aluminium", np.array([wavelength_nm * 1e-9]))[0]) / plate_ior
    case = Grating("binary", pitch, depth, float(inside), index=index, duty=width / pitch)
    rigorous = rigorous_orders(case, 1, extra=_EXTRA, parts=_PARTS)
    found = []
    for order, _, light in scalar_orders(case):
        sine = plate_ior * (np.sin(np.radians(inside)) + order / pitch)
        if abs(order) > 1 or abs(sine) >= 1:
            continue
        cosines = np.cos(np.radians(theta_deg)), np.sqrt(1 - sine**2)
        passed = float(np.prod([1 - fresnel_reflectance(np.array(cosine), plate_ior) for cosine in cosines]))
        true, ours = passed * float(rigorous[order + 1]), passed * light[RATIO]
        found.append(Row(disc, plate_ior, wavelength_nm, theta_deg, order, true, ours))
    return found


def main(argv: list[str] | None = None) -> None:
    """Print a table of the orders."""
    parser = OneLineParser(prog="./dev bench disc", description=__doc__.splitlines()[0])
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    rows = [
        row for disc in DISCS for plate_ior in (NO_PLATE, POLYCARBONATE)
        for wavelength_nm in WAVELENGTHS_NM for theta_deg in ANGLES_DEG
        for row in rows_of(disc, plate_ior, wavelength_nm, theta_deg)
    ]  # fmt: skip
    report.say("| disc | plate | nm | light at | order | Maxwell | ours | ours / Maxwell |", arguments.json)
    report.say("|---|---|---|---|---|---|---|---|", arguments.json)
    for row in rows:
        plate = f"{row.plate_ior:g}" if row.plate_ior != NO_PLATE else "none"
        report.say(
            f"| {row.disc} | {plate} | {row.wavelength_nm:.0f} | {row.theta_deg:.0f} | {row.order:+d} | "
            f"{row.rigorous:.4f} | {row.ours:.4f} | {row.ours / row.rigorous:.2f} |",
            arguments.json,
        )
    for disc in DISCS:
        true, *found = (
            {(r.wavelength_nm, r.theta_deg, r.order): getattr(r, side) for r in rows
             if r.disc == disc and r.plate_ior == plate_ior and r.order}
            for side, plate_ior in (("rigorous", POLYCARBONATE), ("ours", POLYCARBONATE), ("ours", NO_PLATE))
        )  # fmt: skip
        for name, ours in zip(("under the plate", "without it"), found, strict=True):
            off = [np.exp(abs(np.log(ours[key] / true[key]))) for key in true if key in ours]
            report.say(
                f"{disc}: first orders {name} are off by {np.median(off):.2f} (median), at most {max(off):.2f}, from "
                "Maxwell's equations under the plate",
                arguments.json,
            )
    report.write({"rows": [asdict(row) for row in rows]}, arguments.json)


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: GPL-3.0-or-later
"""The `efficiency` verb: a grating's orders against their closed forms, and the light that a dielectric reflects."""

import argparse

import numpy as np

from precompute.cli.arguments import add_json, count, number
from precompute.cli.printing import emit
from precompute.optics.brdf import IOR_MAX, KERATIN_IOR

from ..study import efficiency

# Samples of a period for each order of the sum. The error of a jump is then at most (pi / 16)^2 / 3 = 1.3 % of the
# faintest order.
_SAMPLES_TO_AN_ORDER = 16


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `efficiency`."""
    parser.add_argument("profile", choices=efficiency.PROFILES)
    parser.add_argument("--period-um", type=number(1e-3, 1e6), required=True, metavar="UM")
    parser.add_argument("--depth-nm", type=number(0, 1e6), required=True, metavar="NM", help="from trough to crest")
    parser.add_argument("--wavelength-nm", type=number(1, 1e6), required=True, metavar="NM")
    parser.add_argument(
        "--theta-i", type=number(-89.99, 89.99), default=0.0, metavar="DEG", help="angle of the light; default 0"
    )
    parser.add_argument(
        "--orders", type=count(0, efficiency.ORDERS_MAX), default=3, metavar="M", help="orders -M to M; default 3"
    )
    parser.add_argument(
        "--samples", type=count(efficiency.SAMPLES_MIN, efficiency.SAMPLES_MAX), default=2048, metavar="N",
        help="samples of a period, an even number; default 2048",
    )  # fmt: skip
    parser.add_argument(
        "--ior", type=number(1, IOR_MAX), default=KERATIN_IOR, metavar="N",
        help=f"index of refraction of the surface, for the reflected light; default {KERATIN_IOR:g}, keratin",
    )  # fmt: skip
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    theta_i = np.radians(arguments.theta_i)
    period_m, wavelength_m = arguments.period_um * 1e-6, arguments.wavelength_nm * 1e-9

    def orders_to(most: int, samples: int) -> tuple[list[efficiency.Order], list[float]]:
        """The orders -most to most, and the fraction of the incident light in each."""
        found = efficiency.efficiencies(
            arguments.profile, period_m=period_m, depth_m=arguments.depth_nm * 1e-9, wavelength_m=wavelength_m,
            theta_i=theta_i, orders=most, samples=samples,
        )  # fmt: skip
        return found, efficiency.reflected(found, theta_i, arguments.ior).tolist()

    found, reflected = orders_to(arguments.orders, arguments.samples)
    most = efficiency.largest_order(period_m, wavelength_m, theta_i)
    total, told = None, f"unknown: more than {efficiency.ORDERS_MAX} orders on a side"
    if most <= efficiency.ORDERS_MAX:
        total = sum(orders_to(most, max(arguments.samples, _SAMPLES_TO_AN_ORDER * (most + 1)))[1])
        told = f"{total:.9f}"
    lines = [
        f"{o.order:+3d}  computed {o.computed:.9f}  analytic {o.analytic:.9f}  error {o.error:.1e}"
        f"  reflected {light:.9f}"
        for o, light in zip(found, reflected, strict=True)
    ]
    lines.append(f"reflected in all orders: {told}")
    orders = [o.as_dict() | {"reflected": light} for o, light in zip(found, reflected, strict=True)]
    emit({"orders": orders, "reflected_total": total}, arguments.json, lambda: lines)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The `efficiency` verb: a grating's orders against their closed forms."""

import argparse

import numpy as np

from precompute.cli.arguments import add_json
from precompute.cli.option_types import count, number
from precompute.cli.printing import emit

from ..study import efficiency


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
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    found = efficiency.efficiencies(
        arguments.profile, period_m=arguments.period_um * 1e-6, depth_m=arguments.depth_nm * 1e-9,
        wavelength_m=arguments.wavelength_nm * 1e-9, theta_i=np.radians(arguments.theta_i), orders=arguments.orders,
        samples=arguments.samples,
    )  # fmt: skip
    lines = [f"{o.order:+3d}  computed {o.computed:.9f}  analytic {o.analytic:.9f}  error {o.error:.1e}" for o in found]
    emit({"orders": [o.as_dict() for o in found]}, arguments.json, lambda: lines)

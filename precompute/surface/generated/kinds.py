# SPDX-License-Identifier: GPL-3.0-or-later
"""Kinds of gratings, their parameters, and each parameter's unit, limits and default."""

from __future__ import annotations

from dataclasses import dataclass

from ..steps.step import Number

# The period is written in one of three units. Each gives the period in micrometres as SCALE * value ** POWER.
PERIOD_UNITS: dict[str, tuple[Number, float, int]] = {
    "period_um": (Number("period_um", 0.2, 20), 1.0, 1),
    "period_nm": (Number("period_nm", 200, 20_000), 1e-3, 1),
    "lines_per_mm": (Number("lines_per_mm", 50, 5000), 1e3, -1),
}
# All parameters, in the order in which a grating's text has them. A finer period shows no colours. A coarser one needs
# more pixels than a bake can have. Scalar diffraction does not hold for deeper lines.
PARAMETERS: dict[str, Number] = {
    each.name: each
    for each in (
        PERIOD_UNITS["period_um"][0],
        Number("depth_nm", 1, 5000),
        Number("angle_deg", 1, 45),
        Number("duty", 0.05, 0.95),
        Number("bit_nm", 20, 1000),
        Number("roundness", 0, 1),
        Number("modulation_nm", 0, 5000),
        Number("wave_um", 0.4, 50),
        Number("period_disorder", 0, 0.5),
        Number("depth_disorder", 0, 1),
        Number("direction_disorder_deg", 0, 45),
        Number("seed", 0, 2**31 - 1, whole=True),
    )
}


@dataclass(frozen=True)
class Kind:
    """A kind of grating.

    title     its name as people write it
    help      its shape, in a few words
    defaults  the parameters that the kind has, with their defaults"""

    title: str
    help: str
    defaults: dict[str, float]


def _kind(title: str, help: str, disorders: tuple[str, ...] = (), **defaults: float) -> Kind:
    return Kind(title, help, {**defaults, **{name: 0.0 for name in disorders if name not in defaults}, "seed": 0.0})


_OF_SITES = ("period_disorder", "depth_disorder")
_OF_LINES = (*_OF_SITES, "direction_disorder_deg")

KINDS: dict[str, Kind] = {
    "sinusoidal": _kind("Sinusoidal", "Lines with the profile of a sine", _OF_LINES, period_um=2.5, depth_nm=200),
    "binary": _kind("Binary", "Flat ridges with steep sides", _OF_LINES, period_um=2.5, depth_nm=140, duty=0.5),
    "blazed": _kind(
        "Blazed", "Slanted facets that send most light to one side", _OF_LINES, period_um=2.5, depth_nm=246.23
    ),
    "echelle": _kind(
        "Echelle", "Coarse facets with a right angle, for high orders", _OF_LINES, period_um=6, angle_deg=10
    ),
    "crossed": _kind("Crossed", "Square posts in a square lattice", _OF_SITES, period_um=2, depth_nm=140, duty=0.5),
    "hexagonal": _kind(
        "Hexagonal", "Round bumps in a hexagonal lattice; the period is the distance between its rows", _OF_SITES,
        period_um=1.5, depth_nm=200,
    ),
    "brushed": _kind(
        "Brushed", "Random scratches, as on brushed metal", period_um=1.5, depth_nm=150, period_disorder=0.25,
        direction_disorder_deg=4,
    ),
    "pits": _kind("Pits", "Pits of a disc in tracks", period_um=1.6, depth_nm=110, duty=0.3125, bit_nm=277.5),
    "groove": _kind(
        "Groove", "Grooves of a record that swing sideways with the sound", _OF_SITES, period_um=5, depth_nm=300,
        duty=0.6, roundness=0, modulation_nm=300, wave_um=4,
    ),
}  # fmt: skip

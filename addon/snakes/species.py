# SPDX-License-Identifier: GPL-3.0-or-later
"""The body proportions of snake species."""

from typing import NamedTuple


class Species(NamedTuple):
    """A snake species. Lengths are in largest half widths of the body, heights of a scale in scale lengths.

    slenderness    length of the animal
    rows           rows of scales over back and sides: 3 more than a multiple of 4, so that the last rows on both sides
                   begin and end with the belly's plates
    scale_length   from one scale to the next of its row
    head_length    from the snout to the first scales of the body
    jaw, neck      half widths
    head_height    half height of the head
    dome, keel     height of a scale's middle above its rim, and of the ridge along it
    lift           height of a scale's tail edge above its head edge; it ends half of this above the next scale
    turn_deg       largest random tilt of a scale, along and across the body each"""

    slenderness: float
    rows: int
    scale_length: float
    head_length: float
    jaw: float
    neck: float
    head_height: float
    dome: float
    keel: float
    lift: float
    turn_deg: float


SPECIES = {
    # 15 rows over a stout, glassy body; a flat, wedge-shaped head hardly wider than the neck.
    "XENOPELTIS": Species(80, 15, 0.50, 2.9, 0.80, 0.80, 0.50, 0.0, 0.0, 0.06, 1.2),
    # 23 rows, keeled on the back; a head distinct from a thin neck.
    "ELAPHE": Species(92, 23, 0.40, 3.2, 0.82, 0.60, 0.52, 0.0, 0.03, 0.06, 1.8),
}

# SPDX-License-Identifier: GPL-3.0-or-later
"""How exact a bake is, in three steps for an artist."""

from typing import NamedTuple, Protocol


class Quality(NamedTuple):
    """A step: its name, its label, its tooltip, the colour error and the coherence length in micrometres (0:
    automatic)."""

    name: str
    label: str
    tooltip: str
    delta_e: float
    coherence_um: float


QUALITIES = (
    # The draft's settings are those of the drafts that the extension ships (precompute/presets/drafts.py).
    Quality("DRAFT", "Draft", "Bakes fast, soft colours, little memory: colour error 3 under small lamps", 3.0, 10.0),
    Quality("GOOD", "Good", "For most pictures: colour error 1 under small lamps. The eye hardly sees it", 1.0, 0.0),
    Quality("EXACT", "Exact", "For close-ups: colour error 0.3 under small lamps. Slow, takes more memory", 0.3, 0.0),
)  # fmt: skip


class Fields(Protocol):
    """The part of a grating that says how exact its bake is."""

    delta_e: float
    coherence_um: float


def quality_of(grating: Fields) -> str:
    """The name of a grating's step; empty if its settings are those of none."""
    # Blender stores the fields in single precision.
    given = tuple(float(f"{value:.6g}") for value in (grating.delta_e, grating.coherence_um))
    return next((each.name for each in QUALITIES if (each.delta_e, each.coherence_um) == given), "")


def take_quality(grating: Fields, name: str) -> None:
    """Set a grating's fields to those of a step."""
    quality = next(each for each in QUALITIES if each.name == name)
    grating.delta_e, grating.coherence_um = quality.delta_e, quality.coherence_um

# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding a step to a grating's levelling."""

from ...precompute.surface.steps.pipeline import first_step
from ..gratings.grating import Grating
from .previewing_levelling import scan_of


def add_step(grating: Grating, name: str) -> None:
    """Add a step of the kind `name` after the active step, with arguments that suit the scan, and make it the active
    one. Raises GratingError if the scan cannot be read, or if a calibration step finds no grating in it."""
    step = first_step(name, scan_of(grating))
    at = min(grating.active_step + 1, len(grating.steps))
    grating.steps.add().text = step.text
    grating.steps.move(len(grating.steps) - 1, at)
    grating.active_step = at

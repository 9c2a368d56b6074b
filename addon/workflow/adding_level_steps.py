# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding a step to those that level a grating's scan."""

from ...precompute.surface.steps.first import first_step
from ..gratings.grating import Grating
from .previewing_levelling import scan_of


def add_step(grating: Grating, name: str) -> None:
    """Add a step of the kind `name` after the active one, with arguments that suit the scan, and make it the active
    one. Raises GratingError where the scan cannot be read, and where it has no grating to calibrate by."""
    step = first_step(name, scan_of(grating))
    at = min(grating.active_step + 1, len(grating.steps))
    grating.steps.add().text = step.text
    grating.steps.move(len(grating.steps) - 1, at)
    grating.active_step = at

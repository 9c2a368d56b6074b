# SPDX-License-Identifier: GPL-3.0-or-later
"""Which parts of the panel are open. It belongs to Blender's session, not to a file, and undo leaves it alone."""

import bpy

from .facts import LATER, LIGHT, LOOK, NOW, QUALITY, STATES, SURFACE

# The property of the window manager that holds the folds.
FOLDS = "natural_gratings_folds"
DETAILS, FINDINGS = "details", "findings"


def fold_of(step: str, state: str) -> str:
    """The name of the property that tells whether a step is open. A step has one for each of its states, so that it
    opens when its turn comes and folds when it is done, and stays as the artist leaves it in between."""
    return f"{step.lower()}_{state}"


class Folds(bpy.types.PropertyGroup):
    """The parts of the panel that are open."""

    __annotations__ = {
        **{
            fold_of(step, state): bpy.props.BoolProperty(name=step, default=state == NOW)  # type: ignore[func-returns-value]  # the stubs say it returns None
            for step in (SURFACE, LOOK, LIGHT)
            for state in STATES
        },
        fold_of(QUALITY, LATER): bpy.props.BoolProperty(name=QUALITY),  # type: ignore[func-returns-value]  # as above
        DETAILS: bpy.props.BoolProperty(name="Details"),  # type: ignore[func-returns-value]  # as above
        FINDINGS: bpy.props.BoolProperty(name="Findings"),  # type: ignore[func-returns-value]  # as above
    }


def folds(context: bpy.types.Context) -> Folds:
    """The folds of this session."""
    found: Folds = getattr(context.window_manager, FOLDS)
    return found

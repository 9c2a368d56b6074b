# SPDX-License-Identifier: GPL-3.0-or-later
"""Which parts of the panel are open. It belongs to Blender's session, not to a file, and undo leaves it alone."""

import bpy

from .next_step import LIGHT, LOOK, NOW, QUALITY, SURFACE

# The property of the window manager that holds the folds.
FOLDS = "natural_gratings_folds"
PRESETS, DETAILS, FINDINGS = "presets", "details", "findings"

# The parts that are open, and the steps whose turn has come in this session.
_open: set[str] = set()
_had_turn: set[str] = set()


def fold_of(step: str, state: str) -> str:
    """The name of the property that tells whether a step is open. It opens when its turn comes for the first time, and
    then stays as the artist leaves it: a part that folded under the pointer would move all others."""
    if state == NOW and step not in _had_turn:
        _had_turn.add(step)
        _open.add(step.lower())
    return step.lower()


def forget_folds() -> None:
    """Fold everything, as in a new session."""
    _open.clear()
    _had_turn.clear()


def _fold(name: str) -> object:
    """The property of a part. A panel may not write properties while it is drawn, so the value is kept beside it."""

    def set_open(_: bpy.types.PropertyGroup, is_open: bool) -> None:
        (_open.add if is_open else _open.discard)(name)

    return bpy.props.BoolProperty(name=name.capitalize(), get=lambda _: name in _open, set=set_open)  # type: ignore[func-returns-value]  # the stubs say it returns None


class Folds(bpy.types.PropertyGroup):
    """The parts of the panel that are open."""

    __annotations__ = {
        name: _fold(name) for name in (*map(str.lower, (SURFACE, LOOK, LIGHT, QUALITY)), PRESETS, DETAILS, FINDINGS)
    }


def folds(context: bpy.types.Context) -> Folds:
    """The folds of this session."""
    found: Folds = getattr(context.window_manager, FOLDS)
    return found

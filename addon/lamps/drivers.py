# SPDX-License-Identifier: GPL-3.0-or-later
"""Driven custom properties of the scene or an object (lamp_drivers.py says which). Unchanged drivers are kept: a
write re-evaluates the scene."""

import re
from collections.abc import Sequence
from typing import NamedTuple

import bpy

from ..blender import stored

# What holds a value that a driver reads: a data-block, or the view layer being evaluated.
VIEW_LAYER = "view layer"
Holder = bpy.types.ID | str
_ID_TYPES = {bpy.types.Object: "OBJECT", bpy.types.Collection: "COLLECTION", bpy.types.Scene: "SCENE"}


class Variable(NamedTuple):
    """A value that a driver reads: name in expressions, holder, path there, and fallback if the path is missing."""

    name: str
    holder: Holder
    path: str
    otherwise: float = 0.0


class Drivers:
    """The drivers of custom properties of a scene, or of a holder in the scene."""

    def __init__(self, scene: bpy.types.Scene, holder: bpy.types.Object | None = None):
        self.scene, self.holder = scene, holder or scene
        curves = self.holder.animation_data.drivers if self.holder.animation_data else ()
        # A curve with keyframes, which Blender 5.2 creates, snaps a driver's value to a keyframe within 1e-4.
        self._present = {(c.data_path, c.array_index): c.driver for c in curves if not c.keyframe_points}

    def drive(self, name: str, expressions: Sequence[str], variables: Sequence[Variable]) -> bool:
        """Drive each number of a property by an expression, creating the property if needed. Return whether anything
        changed.

        A driver gets only the variables that its expression uses. Blender evaluates simple expressions without Python
        only up to 255 characters, so blanks around operators are removed."""
        wanted = [re.sub(r" ?([-+*/,<>]) ?", r"\1", expression) for expression in expressions]
        used = [_used(expression, variables) for expression in wanted]
        path = f'["{name}"]'
        present = [self._present.get((path, index)) for index in range(len(wanted))]
        if stored.has_floats(self.holder, name, len(wanted)) and all(map(_is_as_wanted, present, wanted, used)):
            return False
        self.holder[name] = [0.0] * len(wanted)
        self.holder.driver_remove(path)
        for index, expression in enumerate(wanted):
            curve = self.holder.driver_add(path, index)
            assert isinstance(curve, bpy.types.FCurve)  # given an index, it returns one curve
            curve.keyframe_points.clear()
            driver = curve.driver
            driver.type = "SCRIPTED"
            for variable in used[index]:
                _add(driver, variable)
            driver.expression = expression
        return True

    def remove(self, name: str) -> bool:
        """Remove a property and its drivers. Return whether it existed."""
        if name not in self.holder:
            return False
        self.holder.driver_remove(f'["{name}"]')
        del self.holder[name]
        return True


def _used(expression: str, variables: Sequence[Variable]) -> list[Variable]:
    words = set(re.findall(r"[a-z_]+[0-9]*", expression))
    return [variable for variable in variables if variable.name in words]


def _is_as_wanted(driver: bpy.types.Driver | None, expression: str, variables: list[Variable]) -> bool:
    if driver is None or (driver.type, driver.expression) != ("SCRIPTED", expression):
        return False
    return len(driver.variables) == len(variables) and all(map(_reads, driver.variables, variables))


def _reads(made: bpy.types.DriverVariable, wanted: Variable) -> bool:
    target = made.targets[0]
    if made.name != wanted.name or target.data_path != wanted.path:
        return False
    if wanted.holder == VIEW_LAYER:
        return made.type == "CONTEXT_PROP"
    return made.type == "SINGLE_PROP" and target.id == wanted.holder


def _add(driver: bpy.types.Driver, wanted: Variable) -> None:
    made = driver.variables.new()
    made.name = wanted.name
    if isinstance(wanted.holder, str):  # the view layer
        made.type = "CONTEXT_PROP"
        target = made.targets[0]
        target.context_property = "ACTIVE_VIEW_LAYER"
    else:
        target = made.targets[0]
        target.id_type = _ID_TYPES[type(wanted.holder)]  # type: ignore[assignment]  # the stubs list the names
        target.id = wanted.holder
    target.data_path = wanted.path
    target.use_fallback_value, target.fallback_value = True, wanted.otherwise

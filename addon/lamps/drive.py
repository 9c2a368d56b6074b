# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of the scene, or of an object in it, that drivers write. What is driven already as wanted is not touched:
each write would make Blender evaluate the scene again."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ..blender import stored

# What holds a value that a driver reads: a data-block, or the view layer that is being evaluated.
VIEW_LAYER = "view layer"
Holder = bpy.types.ID | str
_ID_TYPES = {bpy.types.Object: "OBJECT", bpy.types.Collection: "COLLECTION", bpy.types.Scene: "SCENE"}


@dataclass(frozen=True)
class Variable:
    """A value that a driver reads: its name in expressions, what holds it, its path there, and the value in its place
    where there is no such path."""

    name: str
    holder: Holder
    path: str
    otherwise: float = 0.0


class Drivers:
    """The drivers of a scene's own properties, or of those of a holder in the scene."""

    def __init__(self, scene: bpy.types.Scene, holder: bpy.types.Object | None = None):
        self.scene, self.holder = scene, holder or scene
        curves = self.holder.animation_data.drivers if self.holder.animation_data else ()
        # A curve with keys, as Blender 5.2 makes it, rounds a driver's value to a key that is nearer than 1e-4.
        self._present = {(c.data_path, c.array_index): c.driver for c in curves if not c.keyframe_points}

    def drive(self, name: str, expressions: Sequence[str], variables: Sequence[Variable]) -> bool:
        """Drive the numbers of a property, which is made if need be, by an expression each; whether anything changed.

        A driver gets only the variables that its expression uses. Blender evaluates simple expressions only up to 255
        characters, so blanks around operators are left out."""
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
            assert isinstance(curve, bpy.types.FCurve)  # with an index it is one
            curve.keyframe_points.clear()
            driver = curve.driver
            driver.type = "SCRIPTED"
            for variable in used[index]:
                _add(driver, variable)
            driver.expression = expression
        return True

    def remove(self, name: str) -> bool:
        """Remove a property and its drivers; whether it was there."""
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
    if isinstance(wanted.holder, str):  # VIEW_LAYER
        made.type = "CONTEXT_PROP"
        target = made.targets[0]
        target.context_property = "ACTIVE_VIEW_LAYER"
    else:
        target = made.targets[0]
        target.id_type = _ID_TYPES[type(wanted.holder)]  # type: ignore[assignment]  # the stubs list the names
        target.id = wanted.holder
    target.data_path = wanted.path
    target.use_fallback_value, target.fallback_value = True, wanted.otherwise

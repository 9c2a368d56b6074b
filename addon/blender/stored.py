# SPDX-License-Identifier: GPL-3.0-or-later
"""Validated reading of custom properties: a .blend file may hold any value under our names.

Each function returns the value if its type, length and range are right, else the default. None of them raises."""

import math
from collections.abc import Collection, Mapping
from typing import Any

import bpy
from idprop.types import IDPropertyArray, IDPropertyGroup

# Record: a property that holds others. Holder: a data-block, a view layer or a Record.
Record = IDPropertyGroup | Mapping[str, Any]
Holder = bpy.types.bpy_struct | Record
# The type codes of the arrays that Blender stores for lists of floats and of booleans.
_FLOATS, _FLAGS = "fd", "bi"


def number(holder: Holder, name: str, default: float = 0.0, *, low: float = -math.inf, high: float = math.inf) -> float:
    """A finite number from `low` to `high`."""
    value = holder.get(name)
    if isinstance(value, int | float) and math.isfinite(value) and low <= value <= high:
        return value
    return default


def count(holder: Holder, name: str, most: int) -> int:
    """An integer from 0 to `most`; 0 by default."""
    value = number(holder, name, low=0, high=most)
    return value if isinstance(value, int) else 0


def flag(holder: Holder, name: str, default: bool = False) -> bool:
    """A boolean. Earlier versions of Blender store it as 0 or 1."""
    value = holder.get(name)
    return bool(value) if isinstance(value, int) and value in (0, 1) else default


def flags(holder: Holder, name: str, most: int) -> list[bool]:
    """A list of at most `most` booleans; empty by default."""
    value: Any = holder.get(name)
    is_list = _is_array(value) and value.typecode in _FLAGS and len(value) <= most
    return [bool(each) for each in value] if is_list and all(each in (0, 1) for each in value) else []


def has_floats(holder: Holder, name: str, length: int) -> bool:
    """Whether a property is a list of `length` floats, finite or not."""
    value: Any = holder.get(name)
    if isinstance(value, list | tuple):  # not yet converted by Blender
        return len(value) == length and all(isinstance(each, float) for each in value)
    is_array = _is_array(value) and len(value) == length
    return is_array and (length == 0 or value.typecode in _FLOATS)


def numbers(holder: Holder, name: str, length: int) -> tuple[float, ...] | None:
    """A tuple of `length` finite floats; None by default."""
    value: Any = holder.get(name)
    found = tuple(value) if has_floats(holder, name, length) else (math.nan,)
    return found if all(map(math.isfinite, found)) else None


def some_numbers(holder: Holder, name: str, most: int) -> tuple[float, ...]:
    """A tuple of at most `most` finite floats; empty by default."""
    value: Any = holder.get(name)
    length = len(value) if _is_array(value) or isinstance(value, list | tuple) else 0
    return (numbers(holder, name, length) or ()) if length <= most else ()


def text(holder: Holder, name: str, default: str = "") -> str:
    """A text; `default` for any other type."""
    value = holder.get(name)
    return value if isinstance(value, str) else default


def choice(value: object, allowed: Collection[str], default: str) -> str:
    """The value if it is allowed, else the default. Unknown numbers of Blender's enumeration properties read as ""."""
    return value if isinstance(value, str) and value in allowed else default


def record(holder: Holder, name: str) -> Record | None:
    """A property that holds other properties; None by default."""
    value = holder.get(name)
    return value if isinstance(value, IDPropertyGroup | dict) else None


def block(holder: Holder, name: str, kind: type[bpy.types.ID]) -> Any:
    """A data-block of the given type; None by default, or if it was deleted."""
    value = holder.get(name)
    return value if isinstance(value, kind) else None


def _is_array(value: Any) -> bool:
    return isinstance(value, IDPropertyArray)

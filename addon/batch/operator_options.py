# SPDX-License-Identifier: GPL-3.0-or-later
"""A verb's options as an operator's properties declare them: their ranges, choices, defaults and help.

On the command line an enumeration's item is a word such as minimum-stretch, and an angle is in degrees."""

import argparse
import math
from typing import Any

import bpy

from ...precompute.cli.arguments import count, name_argument, number


def add_properties(parser: argparse.ArgumentParser, operator: type[bpy.types.Operator], *names: str) -> None:
    """Add an option for each of these properties of an operator, with the property's name."""
    for name in names:
        add_property(parser, operator, name)


def add_property(
    parser: argparse.ArgumentParser, operator: type[bpy.types.Operator], name: str, *, flag: str = "", **more: Any
) -> None:
    """Add an option for a property of an operator. `flag` is the option if it differs from the property's name;
    without dashes it is a positional argument of this name. `more` are further arguments of argparse."""
    declared = _properties(operator)[name]
    flag = flag or f"--{name.replace('_', '-')}"
    is_option = flag.startswith("-")
    text = declared.description
    if not text[1].isupper():  # not "UV map"
        text = text[0].lower() + text[1:]
    if declared.type == "ENUM":
        words = {_word(item.identifier): item.description for item in declared.enum_items}
        text = f"{text}: {'; '.join(f'{word}: {told}' for word, told in words.items())}"
        more["choices"] = list(words)
    elif declared.type == "STRING":
        more |= {"type": name_argument, "metavar": "FILE" if declared.subtype == "FILE_PATH" else "NAME"}
    else:
        low, high = _as_typed(declared, declared.hard_min), _as_typed(declared, declared.hard_max)
        more["type"] = count(low, high) if declared.type == "INT" else number(low, high)
        more["metavar"] = "DEGREES" if declared.subtype == "ANGLE" else "N" if declared.type == "INT" else "X"
    if is_option and declared.type != "STRING":
        default = _as_typed(declared, declared.default)
        text += f"; default {default:g}" if declared.type == "FLOAT" else f"; default {default}"
    more |= {"dest": name} if is_option else {"metavar": name.upper()}
    parser.add_argument(flag, help=text.replace("%", "%%"), **more)


def values(arguments: argparse.Namespace, operator: type[bpy.types.Operator]) -> dict[str, Any]:
    """The values of an operator's properties that the command line has options for, as the operator holds them. An
    option that is not given is None in `arguments`, and has the property's default here."""
    found = {}
    for name, declared in _properties(operator).items():
        if hasattr(arguments, name):
            given = getattr(arguments, name)
            found[name] = _as_held(declared, _as_typed(declared, declared.default) if given is None else given)
    return found


def _properties(operator: type[bpy.types.Operator]) -> Any:
    """What Blender knows of a registered operator's properties, by name."""
    category, name = operator.bl_idname.split(".")
    return getattr(getattr(bpy.ops, category), name).get_rna_type().properties


def _word(identifier: str) -> str:
    return identifier.lower().replace("_", "-")


def _as_typed(declared: Any, value: Any) -> Any:
    """A property's value as the command line takes it."""
    if declared.type == "ENUM":
        return _word(value)
    if declared.type != "FLOAT":
        return value
    # Blender holds single precision; seven digits restore the number that the class declares.
    return float(f"{math.degrees(value) if declared.subtype == 'ANGLE' else value:.7g}")


def _as_held(declared: Any, value: Any) -> Any:
    """What the command line takes as a property's value."""
    if declared.type == "ENUM":
        return value.upper().replace("-", "_")
    return math.radians(value) if declared.type == "FLOAT" and declared.subtype == "ANGLE" else value

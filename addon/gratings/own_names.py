# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of a grating's material and node group. They follow the grating's name until an artist renames them."""

from typing import Any

import bpy

from ..blender import stored

# Custom property of a material or node group made for a grating: its name then. Copies and renamed ones differ from it.
_OWN = "ng_own"
_PREFIX = "Diffraction "


def note_own(made: bpy.types.ID) -> None:
    """Mark a material or node group as made for a grating. It may outlive the grating."""
    made[_OWN] = made.name


def is_own(made: bpy.types.ID) -> bool:
    """Whether it was made for a grating and still has the name given then."""
    return stored.text(made, _OWN) == made.name


def was_own(made: bpy.types.ID) -> bool:
    """Whether it was made for a grating, or copied from one that was."""
    return _OWN in made


def name_in(made: bpy.types.ID) -> str:
    """The name of the grating in the name of a material or node group, without Blender's number for copies."""
    name = made.name.removeprefix(_PREFIX)
    stem, _, number = name.rpartition(".")
    return stem if stem and number.isdecimal() else name


def own_name(grating: bpy.types.PropertyGroup) -> str:
    """The name of a grating's material and node group."""
    return f"{_PREFIX}{grating.name}"


def follow_name(grating: Any) -> None:
    """Rename the grating's material and node group after it, unless an artist renamed them or they are linked."""
    for made in (grating.group, grating.material):
        if made is not None and made.library is None and made.override_library is None and is_own(made):
            _rename(made, own_name(grating))


def _rename(made: bpy.types.ID, name: str) -> None:
    """Rename it, unless it already has the name, with or without Blender's number for duplicates."""
    stem, _, number = made.name.rpartition(".")
    if made.name != name and not (stem == name and number.isdecimal()):
        made.name = name
        note_own(made)

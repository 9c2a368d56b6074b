# SPDX-License-Identifier: GPL-3.0-or-later
"""The names of a grating's material and node group, which follow the grating's own until an artist gives another."""

from typing import Any

import bpy

from ..blender import stored

# A custom property of a material or node group that was made for a grating, also in saved files. It holds the name that
# was given then, so that a copy, or one that an artist renamed, has none of its own.
_OWN = "ng_own"
_PREFIX = "Diffraction "


def note_own(made: bpy.types.ID) -> None:
    """Note that a material or node group is made for a grating, which may be removed before it."""
    made[_OWN] = made.name


def is_own(made: bpy.types.ID) -> bool:
    """Whether it was made for a grating and still has the name that it was given."""
    return stored.text(made, _OWN) == made.name


def was_own(made: bpy.types.ID) -> bool:
    """Whether it, or what it is a copy of, was made for a grating."""
    return _OWN in made


def name_in(made: bpy.types.ID) -> str:
    """The name of the grating that a material or node group has, without the number by which Blender tells copies
    apart."""
    name = made.name.removeprefix(_PREFIX)
    stem, _, number = name.rpartition(".")
    return stem if stem and number.isdecimal() else name


def own_name(grating: bpy.types.PropertyGroup) -> str:
    """The name of a grating's material and node group."""
    return f"{_PREFIX}{grating.name}"


def follow_name(grating: Any) -> None:
    """Give the grating's material and node group its name, unless an artist or another file named them."""
    group, material = grating.group, grating.material
    if None not in (group, material) and _OWN not in group and is_own(material) and group.name == material.name:
        note_own(group)  # earlier versions noted materials alone
    for made in (group, material):
        if made is not None and made.library is None and made.override_library is None and is_own(made):
            _rename(made, own_name(grating))


def _rename(made: bpy.types.ID, name: str) -> None:
    """Rename it. One that already has the name, or the name with the number by which Blender tells two apart, stays."""
    stem, _, number = made.name.rpartition(".")
    if made.name != name and not (stem == name and number.isdecimal()):
        made.name = name
        note_own(made)

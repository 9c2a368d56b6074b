# SPDX-License-Identifier: GPL-3.0-or-later
"""The materials that gratings' own materials have replaced on an object. Blender does not list them among the object's
custom properties."""

import bpy
from bpy.props import IntProperty, PointerProperty

# The name of the object's property.
REPLACED = "natural_gratings_replaced"
# A library override keeps its own records.
_OVERRIDABLE = {"LIBRARY_OVERRIDABLE"}
# The slot of a record that is free, because a library override cannot remove records.
FREE = -1


class ReplacedMaterial(bpy.types.PropertyGroup):
    """A slot's former material; none if the slot was empty, or if the material was deleted."""

    slot: IntProperty(default=FREE, override=_OVERRIDABLE)
    material: PointerProperty(type=bpy.types.Material, override=_OVERRIDABLE)


def replaced_field() -> object:
    """The property of an object."""
    return bpy.props.CollectionProperty(type=ReplacedMaterial, override={"LIBRARY_OVERRIDABLE", "USE_INSERTION"})  # type: ignore[func-returns-value]  # the stubs say it returns None


def replaced_on(thing: bpy.types.Object) -> "bpy.types.bpy_prop_collection_idprop[ReplacedMaterial]":
    """The former materials of an object's slots."""
    found: bpy.types.bpy_prop_collection_idprop[ReplacedMaterial] = getattr(thing, REPLACED)
    return found

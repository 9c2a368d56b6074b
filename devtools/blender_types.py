# SPDX-License-Identifier: GPL-3.0-or-later
"""A mypy plugin that corrects Blender's stubs to match Blender's documentation.

In the stubs every pointer may be None, even `context.scene`, and `Object.data` may be any of fourteen types. Code that
tested for each would be unreadable. When such a property is read, the plugin removes None, and turns a union of many
types into Any. Return values of functions, such as `bpy.data.objects.get`, stay as in the stubs.

The stubs have every subclass of a node or of a lamp, but `tree.nodes` and `bpy.data.lights` return the base class. The
plugin accepts attributes of subclasses on a base class. It also adds what the stubs lack: `"name" in block`, the
elements of a vector, and this add-on's property of scenes."""

from collections.abc import Callable

from mypy.nodes import ARG_POS, Argument, Var
from mypy.plugin import AttributeContext, ClassDefContext, Plugin
from mypy.plugins.common import add_attribute_to_class, add_method_to_class
from mypy.typeops import make_simplified_union
from mypy.types import AnyType, NoneType, Type, TypeOfAny, UnionType, get_proper_type

# Unions of more types than this become Any.
_KINDS_MAX = 3
# Properties with too narrow a type in the stubs: arrays typed as a number, a node tree as any data-block, the render
# engine as one fixed name.
_OF_ANY_KIND = (".id_data", ".pixels", ".image_pixels_float", ".RenderSettings.engine")
# Base classes that Blender returns where code expects a certain subclass.
_BASES = {
    f"bpy.types.{name}"
    for name in (
        "ActionStrip",
        "Attribute",
        "Light",
        "Modifier",
        "Node",
        "NodeSocket",
        "NodeTreeInterfaceItem",
    )
}
_SEQUENCES = {f"mathutils.{name}" for name in ("Color", "Euler", "Matrix", "Quaternion", "Vector")}


class BlenderTypes(Plugin):
    """The plugin."""

    def get_attribute_hook(self, fullname: str) -> Callable[[AttributeContext], Type] | None:
        """mypy calls this for each attribute that is read or written."""
        if not fullname.startswith("bpy.types."):
            return None
        return _of_any_kind if fullname.endswith(_OF_ANY_KIND) else _present

    def get_customize_class_mro_hook(self, fullname: str) -> Callable[[ClassDefContext], None] | None:
        """mypy calls this for each class."""
        if fullname in _BASES:
            return _with_any_attribute
        if fullname in _SEQUENCES:
            return _with_elements
        return {"bpy.types.bpy_struct": _with_membership, "bpy.types.Scene": _with_own_property}.get(fullname)


def _with_any_attribute(context: ClassDefContext) -> None:
    anything = AnyType(TypeOfAny.special_form)
    name, value = _argument(context, "name"), Argument(Var("value", anything), anything, None, ARG_POS)
    add_method_to_class(context.api, context.cls, "__getattr__", [name], anything)
    add_method_to_class(context.api, context.cls, "__setattr__", [name, value], NoneType())


def _with_elements(context: ClassDefContext) -> None:
    elements = context.api.named_type("typing.Iterator", [AnyType(TypeOfAny.special_form)])
    add_method_to_class(context.api, context.cls, "__iter__", [], elements)


def _with_membership(context: ClassDefContext) -> None:
    truth = context.api.named_type("builtins.bool")
    add_method_to_class(context.api, context.cls, "__contains__", [_argument(context, "name")], truth)


def _with_own_property(context: ClassDefContext) -> None:
    add_attribute_to_class(context.api, context.cls, "natural_gratings", AnyType(TypeOfAny.special_form))


def _argument(context: ClassDefContext, name: str) -> Argument:
    text = context.api.named_type("builtins.str")
    return Argument(Var(name, text), text, None, ARG_POS)


def _of_any_kind(_: AttributeContext) -> Type:
    return AnyType(TypeOfAny.special_form)


def _present(context: AttributeContext) -> Type:
    found = get_proper_type(context.default_attr_type)
    if context.is_lvalue or not isinstance(found, UnionType):
        return found
    kinds = [each for each in found.relevant_items() if not isinstance(get_proper_type(each), NoneType)]
    if len(kinds) > _KINDS_MAX:
        return AnyType(TypeOfAny.special_form)
    return make_simplified_union(kinds)


def plugin(_: str) -> type[Plugin]:
    """The entry point of the plugin for mypy."""
    return BlenderTypes

# SPDX-License-Identifier: GPL-3.0-or-later
"""A stand-in for Blender's layout that records what a panel draws."""

from types import SimpleNamespace


class Layout:
    """A layout, including all its rows, columns and sub-panels. `folded`: sub-panels that are closed by default are not
    drawn, as Blender has it."""

    operator_context, active, scale_y = "INVOKE_REGION_WIN", True, 1.0

    def __init__(self, folded=True):
        self.folded = folded
        # How each button's operator is called.
        self.contexts = {}
        self.labels, self.icons, self.props, self.operators, self.lists, self.pictures = [], [], [], [], [], 0

    def label(self, text="", icon="NONE", **_):
        self.labels.append(text)
        self.icons.append(icon)

    def prop(self, data, name, **_):
        getattr(data, name)
        self.props.append(name)

    def operator(self, name, **_):
        self.operators.append(name)
        self.contexts[name] = self.operator_context
        return SimpleNamespace()

    def operator_menu_enum(self, name, _property, **_):
        self.operators.append(name)

    def template_list(self, name, *_, **__):
        self.lists.append(name)

    def template_icon(self, icon_value, scale):
        self.pictures += 1

    def template_icon_view(self, data, name, **_):
        getattr(data, name)
        self.pictures += 1

    def menu(self, *_, **__):
        pass

    def progress(self, **_):
        pass

    def separator(self):
        pass

    def row(self, align=False):
        return self

    def split(self, factor=0.5):
        return self

    def column(self, align=False):
        return self

    def box(self):
        return self

    def panel(self, _name, default_closed=False):
        return self, None if default_closed and self.folded else self

    def panel_prop(self, data, name):
        return self, self if getattr(data, name) or not self.folded else None

    def noted(self, icon):
        """The labels with an icon, each with its continuation lines, as one text."""
        kept, lines = False, []
        for text, each in zip(self.labels, self.icons, strict=True):
            kept = each == icon or (kept and each == "BLANK1")
            if kept:
                lines.append(text)
        return " ".join(lines)


def listed_properties(thing):
    """The names that Blender lists in a data-block's panel Custom Properties."""
    return [name for name in set(thing.keys()) if name not in thing.bl_rna.properties]


def context_of(width=300):
    """What panels read from Blender's context, with a region of a given width."""
    import bpy

    return SimpleNamespace(
        region=SimpleNamespace(width=width), preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1)),
        scene=bpy.context.scene, view_layer=bpy.context.view_layer, window_manager=bpy.context.window_manager,
        active_object=bpy.context.active_object, selected_objects=bpy.context.selected_objects, space_data=None,
        evaluated_depsgraph_get=bpy.context.evaluated_depsgraph_get,
    )  # fmt: skip

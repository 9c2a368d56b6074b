# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds a preset: a ready-made surface with its matter and the look of its material."""

import bpy
from bpy.props import BoolProperty, EnumProperty

from ...precompute.base.failure import GratingError
from .reports import report_added, report_failure, report_lines

# Blender keeps no reference to the texts of a dynamic enumeration, so they are kept here. Read at the first use.
_items: list[tuple[str, str, str]] = []


def presets(operator, context):
    """The presets, each with its title and, as its tooltip, its relief and its matter."""
    if not _items:
        from ...precompute.presets.presets import preset_names

        _items.extend(_item(name) for name in preset_names())
    return _items


def _item(name: str) -> tuple[str, str, str]:
    """An entry of the enumeration. The tooltip of a faulty file is the fault."""
    from ...precompute.presets.presets import read_preset

    try:
        preset = read_preset(name)
    except GratingError as error:
        return name, name, str(error)
    return name, preset.title, f"{preset.request.scans[0].source}; matter: {preset.request.matter}"


class AddPreset(bpy.types.Operator):
    """Add a ready-made surface to the scene's gratings, with its matter and the look of its material. It needs no scan,
    and shows at once at draft quality"""

    bl_idname = "grating.add_preset"
    bl_label = "Add Preset"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(name="Preset", description="Ready-made surface to add", items=presets, options={"SKIP_SAVE"})

    assign: BoolProperty(
        name="Assign", description="Also put it on the selected meshes", default=False, options={"SKIP_SAVE"}
    )

    def execute(self, context):
        from ..workflow.adding_presets import import_preset, put_preset

        if self.assign:
            try:
                return report_lines(self, put_preset(context.scene, self.preset, context.selected_objects))
            except GratingError as error:
                return report_failure(self, error)
        return report_added(self, lambda: [import_preset(context.scene, self.preset)])

# SPDX-License-Identifier: GPL-3.0-or-later
"""Object > Natural Gratings in the 3D view: the work's buttons as a menu, for the keyboard and for Menu Search (F3)."""

import bpy

from ..blender.guard import guarded, guarded_draw
from ..operators.add_things import AddSticker
from ..operators.assign import AddDiffraction, AssignToSelected, MendMaterials, RemoveDiffraction
from ..operators.bake import BakeGrating, BakeNeeds
from ..operators.direction import ChooseDirection, CombGrating, ShowDirection, Unwrap
from ..operators.import_files import ImportHeightMap
from ..operators.light import AddDiffractionLamp, AddLightRig, ChooseLights, CountLamp
from ..operators.vary import AddHologram, PaintInput, UnpaintInput, VaryGrating
from ..operators.why_black import WhyBlack
from .installation import OpenManual
from .panel import SampleMenu

# The groups of the menu, in the order of the panel's steps. A pair is an operator with the property that it asks for in
# a submenu.
_GROUPS = (
    (ImportHeightMap, BakeGrating, BakeNeeds),
    (AssignToSelected, AddDiffraction, RemoveDiffraction, AddSticker, MendMaterials),
    (VaryGrating, (AddHologram, "pattern"), PaintInput, (UnpaintInput, "input")),
    (ChooseDirection, (CombGrating, "source"), Unwrap, ShowDirection),
    ((AddLightRig, "kind"), (ChooseLights, "lights"), CountLamp, AddDiffractionLamp),
    (WhyBlack, OpenManual),
)
# Operators that ask for more in a dialog or a file browser.
_ASKING = (ImportHeightMap, VaryGrating, PaintInput, ChooseDirection)


class ObjectMenu(bpy.types.Menu):
    """Give objects natural gratings, and light them"""

    bl_idname = "GRATING_MT_object"
    bl_label = "Natural Gratings"

    @guarded_draw
    def draw(self, context):
        layout = self.layout
        layout.operator_context = "INVOKE_REGION_WIN"
        layout.menu(SampleMenu.bl_idname)
        for number, group in enumerate(_GROUPS):
            if number:
                layout.separator()
            for entry in group:
                if isinstance(entry, tuple):
                    operator, name = entry
                    text = "Lit by" if operator == ChooseLights else operator.bl_label  # as in the panel
                    layout.operator_menu_enum(operator.bl_idname, name, text=text)
                else:
                    text = f"{entry.bl_label}..." if entry in _ASKING else entry.bl_label
                    layout.operator(entry.bl_idname, text=text)


@guarded
def menu_entry(menu: bpy.types.Menu, _: bpy.types.Context) -> None:
    """Draw the entry in the 3D view's menu Object."""
    menu.layout.separator()
    menu.layout.menu(ObjectMenu.bl_idname)

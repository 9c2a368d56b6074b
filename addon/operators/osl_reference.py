# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a material that evaluates one of the thesis's methods, or the bake, in every pixel."""

from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty

from ..gratings.grating import active_grating
from .shared import Acts

_DIRECT = "DIRECT"
_METHODS = (
    ("FLSS", "FLSS", "Every wavelength, with a Taylor series of the relief (thesis Algorithm 3)"),
    ("CHEBYSHEV", "Chebyshev", "Every wavelength, with a Chebyshev series: for reliefs too deep for a Taylor series"),
    ("NMM", "NMM", "Only the wavelengths that the grating equation selects (thesis 4.3)"),
    ("PQ", "PQ", "The scan repeated as tiles (thesis Algorithm 5)"),
    (_DIRECT, "Direct", "The add-on's own table, read by a shader. The fastest method. Bake the grating first"),
)


class NewOslReference(Acts, bpy.types.Operator):
    """Make a slow material for comparisons, whose shader evaluates a method of the thesis, or the bake, in every
    pixel"""

    bl_idname = "grating.osl_reference"
    bl_label = "New OSL Reference Material"
    bl_options = {"REGISTER", "UNDO"}

    method: EnumProperty(name="Method", description="What the shader evaluates", items=_METHODS, default="FLSS")
    filepath: StringProperty(
        name="File",
        description="Existing file of Fourier transforms, or for Direct a bake. Empty: make it from the active grating",
        subtype="FILE_PATH",
    )

    @classmethod
    def poll(cls, context):
        from ..materials.osl.script import missing_for_osl

        missing = missing_for_osl(context.scene)
        if missing:
            cls.poll_message_set(missing[0].upper() + missing[1:])
        return not missing

    def invoke(self, context, event):
        return context.window_manager.invoke_props_dialog(self)

    def act(self, context):
        from ..workflow.making_osl_references import reference_from_bake, reference_from_images, write_images

        scene = context.scene
        file = Path(bpy.path.abspath(self.filepath)) if self.filepath else None
        if self.method == _DIRECT:
            material = reference_from_bake(scene, file or active_grating(scene).baked_file())
        else:
            material = reference_from_images(scene, file or write_images(active_grating(scene), self.method.lower()))
        return [f"{material.name}: assign it to a mesh"]

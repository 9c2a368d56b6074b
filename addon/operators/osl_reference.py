# SPDX-License-Identifier: GPL-3.0-or-later
"""Make a material that evaluates one of the thesis's algorithms, or the bake, in every pixel, in Open Shading
Language."""

from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty

from ...precompute.base.failure import GratingError
from ..actions.osl_reference import DIRECT, make_reference, write_images
from ..materials.osl.script import missing_for_osl
from ..scene.gratings import active_grating

_METHODS = (
    ("FLSS", "FLSS", "Every wavelength, Taylor terms of the relief (thesis Algorithm 3)"),
    ("CHEBYSHEV", "Chebyshev", "Every wavelength, Chebyshev terms: for reliefs too deep for Taylor's"),
    ("NMM", "NMM", "Only the wavelengths that the grating equation selects (thesis 4.3)"),
    ("PQ", "PQ", "The scan repeated side by side (thesis Algorithm 5)"),
    (DIRECT, "Direct", "The add-on's own table, as a shader: the quickest. Bake the grating first"),
)


class NewOslReference(bpy.types.Operator):
    """Make a material whose shader evaluates one of the thesis's algorithms, or the bake, in every pixel: slow, for
    comparisons"""

    bl_idname = "grating.osl_reference"
    bl_label = "New OSL Reference Material"
    bl_options = {"REGISTER", "UNDO"}

    method: EnumProperty(name="Method", description="What the shader evaluates", items=_METHODS, default="FLSS")
    filepath: StringProperty(
        name="File",
        description="A file of DFT images (for Direct, a bake) that is there already; empty takes the active grating",
        subtype="FILE_PATH",
    )

    @classmethod
    def poll(cls, context):
        missing = missing_for_osl(context.scene)
        if missing:
            cls.poll_message_set(missing[0].upper() + missing[1:])
        return not missing

    def invoke(self, context, event):
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        try:
            material = make_reference(context.scene, self.method, self._file(context.scene))
        except GratingError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{material.name}: assign it to a mesh that has a UV map")
        return {"FINISHED"}

    def _file(self, scene: bpy.types.Scene) -> Path:
        if self.filepath:
            return Path(bpy.path.abspath(self.filepath))
        grating = active_grating(scene)
        return grating.baked_file() if self.method == DIRECT else write_images(grating, self.method.lower())

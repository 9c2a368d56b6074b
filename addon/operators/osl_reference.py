# SPDX-License-Identifier: GPL-3.0-or-later
"""Make a material that evaluates one of the thesis's algorithms, or the bake, in every pixel, in Open Shading
Language."""

import hashlib
from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty

from ...precompute import atlas
from ...precompute.colour import rgb_from_xyz
from ...precompute.dft_images import read_layout
from ...precompute.failure import GratingError
from .. import compat, key_lights
from ..bake_job import BakeJob
from ..gratings import Grating, active_grating, cache_folder
from ..materials.diffraction import group_around, new_diffraction_material, show_key_lights
from ..materials.osl import build_osl_response, missing_for_osl
from ..materials.osl_direct import build_osl_direct
from .bake_grating import input_arguments

_DIRECT = "DIRECT"
_METHODS = (
    ("FLSS", "FLSS", "Every wavelength, Taylor terms of the relief (thesis Algorithm 3)"),
    ("CHEBYSHEV", "Chebyshev", "Every wavelength, Chebyshev terms: for reliefs too deep for Taylor's"),
    ("NMM", "NMM", "Only the wavelengths that the grating equation selects (thesis 4.3)"),
    ("PQ", "PQ", "The scan repeated side by side (thesis Algorithm 5)"),
    (_DIRECT, "Direct", "The add-on's own table, as a shader: the quickest. Bake the grating first"),
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
        return grating.baked_file() if self.method == _DIRECT else write_images(grating, self.method.lower())


def write_images(grating: Grating, method: str) -> Path:
    """The file of a method's DFT images of a grating, made in the cache by a process beside Blender.

    Raises GratingError if that fails."""
    arguments = [*input_arguments(grating), "--method", method, "--texels", "0"]
    # Shaders read the file where it lies: each setting has a folder of its own, so that none is written over.
    key = hashlib.sha256("\0".join(arguments).encode()).hexdigest()[:16]
    job = BakeJob(arguments, cache_folder() / "dft" / key, "dft")
    job.wait()
    return Path(job.result()["files"][0])


def make_reference(scene: bpy.types.Scene, method: str, path: Path) -> bpy.types.Material:
    """A new material by a file of DFT images (whose method it is), or for DIRECT by a bake, lit by the scene's lamps.

    Raises GratingError, with nothing changed, if the file is none, the shader does not compile or no lamp is there."""
    key_lights.find_lamps(scene)
    space = compat.working_space()
    if method == _DIRECT:
        layout, _ = atlas.read_header(path)
        response = build_osl_direct(path.stem, path, layout, rgb_from_xyz(space, layout.illuminant))
    else:
        response = build_osl_response(path.stem, path, rgb_from_xyz(space, read_layout(path).illuminant))
    key_lights.follow_lamps(scene)
    group = group_around(f"OSL {path.stem}", response, shadows=True)
    show_key_lights()
    return new_diffraction_material(f"OSL {path.stem}", group)

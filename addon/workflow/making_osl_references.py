# SPDX-License-Identifier: GPL-3.0-or-later
"""Making a material that evaluates one of the thesis's methods, or the bake, in every pixel."""

import hashlib
from pathlib import Path

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.colour.spaces import rgb_from_xyz
from ...precompute.methods.dft_layout import read_sound_layout
from ...precompute.surface.generated.parameters import title_of_stem
from ...precompute.table.atlas import read_header
from ..blender.working_space import working_space
from ..gratings.cache_folder import cache_folder
from ..gratings.grating import Grating
from ..jobs.child import Job
from ..materials.material import new_diffraction_material
from ..materials.osl.osl_bake import build_osl_direct
from ..materials.osl.thesis_methods import build_osl_response
from ..materials.response import Response
from ..materials.skin import group_around
from .baking import deadline_of
from .lights.lighting import update_lamps


def write_images(grating: Grating, method: str) -> Path:
    """Make a grating's DFT images for a method in a separate process. Returns their file. Raises GratingError if it
    fails."""
    arguments = [*_images_arguments(grating), "--method", method, "--texels", "0"]
    # Shaders read this file. Each set of arguments has its own folder, so no file is overwritten.
    key = hashlib.sha256("\0".join(arguments).encode()).hexdigest()[:16]
    deadline = deadline_of([grating.source], "evaluated")
    job = Job("dft", arguments, cache_folder() / "dft" / key, deadline=deadline)
    job.wait()
    return Path(job.result()["files"][0])


def reference_from_images(scene: bpy.types.Scene, path: Path) -> bpy.types.Material:
    """Make a new material that evaluates a method from its file of DFT images, lit by the scene's lamps. Raises
    GratingError, with nothing changed, if the file holds no DFT images or the shader does not compile."""
    matrix = rgb_from_xyz(working_space(), read_sound_layout(path).illuminant)
    name = title_of_stem(path.stem)
    return _material_of(scene, name, build_osl_response(name, path, matrix))


def reference_from_bake(scene: bpy.types.Scene, path: Path) -> bpy.types.Material:
    """Make a new material whose shader reads a bake's file, lit by the scene's lamps. Raises GratingError, with nothing
    changed, if the file is not a bake or the shader does not compile."""
    layout, _ = read_header(path)
    matrix = rgb_from_xyz(working_space(), layout.illuminant)
    name = title_of_stem(path.stem)
    return _material_of(scene, name, build_osl_direct(name, path, layout, rgb_from_xyz=matrix))


def _material_of(scene: bpy.types.Scene, name: str, response: Response) -> bpy.types.Material:
    update_lamps(scene)
    group = group_around(f"OSL {name}", response, shadows=True)
    return new_diffraction_material(f"OSL {name}", group)


def _images_arguments(grating: Grating) -> list[str]:
    """Arguments of `dft`: the scan, its levelling and its coherence length. Raises GratingError for a grating of
    several scans, because the thesis's methods use one patch of one scan."""
    if grating.further_scans():
        raise GratingError(grating.name, "averages several scans, and this method needs one", "import a single scan")
    arguments = [grating.source_file(), "--level", grating.levelling]
    for option, value in (("--size-um", grating.size_um), ("--height-nm", grating.height_nm)):
        if value > 0:
            arguments += [option, f"{value:.9g}"]
    if grating.coherence_um > 0:
        arguments += ["--coherence-um", f"{grating.coherence_um:.6g}"]
    if grating.channel:
        arguments += ["--channel", grating.channel]
    return arguments

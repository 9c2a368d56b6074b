# SPDX-License-Identifier: GPL-3.0-or-later
"""Making a material that evaluates one of the thesis's algorithms, or the bake, in every pixel."""

import hashlib
from pathlib import Path

import bpy

from ...precompute.colour.working_space import rgb_from_xyz
from ...precompute.methods.dft_layout import read_layout
from ...precompute.table.atlas_file import read_header
from ..jobs.child import Job
from ..lamps.find import find_lamps
from ..lamps.follow import follow_lamps
from ..materials.material import new_diffraction_material
from ..materials.osl.baked import build_osl_direct
from ..materials.osl.thesis import build_osl_response
from ..materials.skin import group_around, show_lamps
from ..scene import compat
from ..scene.gratings import Grating, cache_folder
from .bake import input_arguments

DIRECT = "DIRECT"


def write_images(grating: Grating, method: str) -> Path:
    """The file of a method's DFT images of a grating, made in the cache by a process beside Blender.

    Raises GratingError if that fails."""
    arguments = [*input_arguments(grating), "--method", method, "--texels", "0"]
    # Shaders read the file where it lies: each setting has a folder of its own, so that none is written over.
    key = hashlib.sha256("\0".join(arguments).encode()).hexdigest()[:16]
    job = Job(arguments, cache_folder() / "dft" / key, "dft")
    job.wait()
    return Path(job.result()["files"][0])


def make_reference(scene: bpy.types.Scene, method: str, path: Path) -> bpy.types.Material:
    """A new material by a file of DFT images (whose method it is), or for DIRECT by a bake, lit by the scene's lamps.

    Raises GratingError, with nothing changed, if the file is none, the shader does not compile or no lamp is there."""
    find_lamps(scene)
    space = compat.working_space()
    if method == DIRECT:
        layout, _ = read_header(path)
        response = build_osl_direct(path.stem, path, layout, rgb_from_xyz(space, layout.illuminant))
    else:
        response = build_osl_response(path.stem, path, rgb_from_xyz(space, read_layout(path).illuminant))
    follow_lamps(scene)
    group = group_around(f"OSL {path.stem}", response, shadows=True)
    show_lamps()
    return new_diffraction_material(f"OSL {path.stem}", group)

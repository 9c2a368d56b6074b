# SPDX-License-Identifier: GPL-3.0-or-later
"""The response of a bake's file: its picture, packed into the .blend, read by the Direct node group."""

from pathlib import Path

import bpy

from ....precompute.base.failure import GratingError, printable
from ....precompute.colour.working_space import rgb_from_xyz
from ....precompute.table.atlas_file import read_sound_header
from ...scene import compat
from ..response import Response
from .group import build_direct_group


def direct_response(path: Path) -> Response:
    """The response of a bake's file. Raises GratingError, with nothing left behind, if the file is not a sound bake."""
    layout, record = read_sound_header(path)
    image = load_atlas(path, half=record.get("precision") != "float32")
    matrix = rgb_from_xyz(compat.working_space(), layout.illuminant)
    return build_direct_group(printable(path.stem), image, layout, rgb_from_xyz=matrix)


def load_atlas(path: Path, half: bool) -> bpy.types.Image:
    """The bake's image, packed into the .blend so that it renders wherever that file goes. `half`: a graphics card may
    hold it in half floats, as the file itself does. Raises GratingError if Blender cannot open the file."""
    try:
        image = bpy.data.images.load(str(path), check_existing=False)
    except RuntimeError as error:  # Blender takes a backslash for a slash
        raise GratingError(f"{path}: Blender cannot open it; give it a name of plain letters") from error
    image.name = printable(path.stem)
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "NONE"
    image.use_half_precision = half
    image.pack()
    return image

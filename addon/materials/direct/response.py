# SPDX-License-Identifier: GPL-3.0-or-later
"""The Diffraction group of a bake: its picture packed into the file, and the response that reads it."""

from pathlib import Path

import bpy

from ....precompute.colour.working_space import rgb_from_xyz
from ....precompute.table.atlas_file import read_header
from ...scene import compat
from ..skin import group_around
from .group import build_direct_group


def load_atlas(path: Path, half: bool) -> bpy.types.Image:
    """The bake's image, packed into the .blend so that it renders wherever the file goes; on a graphics card in half
    floats only where those hold it."""
    image = bpy.data.images.load(str(path), check_existing=False)
    image.name = path.stem
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "NONE"
    image.use_half_precision = half
    image.pack()
    return image


def new_diffraction_group(path: Path, shadows: bool = True) -> bpy.types.NodeTree:
    """The Diffraction group of a bake file, for the file's lamps. Raises GratingError if the file is not a bake."""
    layout, record = read_header(path)
    image = load_atlas(path, half=record.get("precision") != "float32")
    matrix = rgb_from_xyz(compat.working_space(), layout.illuminant)
    return group_around(path.stem, build_direct_group(path.stem, image, layout, matrix), shadows)

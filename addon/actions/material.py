# SPDX-License-Identifier: GPL-3.0-or-later
"""Making a grating's node group and its material."""

import bpy

from ..lamps.find import find_lamps
from ..lamps.follow import follow_lamps
from ..materials.direct.response import new_diffraction_group
from ..materials.material import new_diffraction_material
from ..materials.skin import show_lamps
from ..scene.gratings import Grating


def make_material(scene: bpy.types.Scene, grating: Grating) -> bpy.types.Material:
    """A new material of a baked grating. Raises GratingError if the bake or all lamps are missing."""
    grating.material = new_diffraction_material(grating.name, group_of(scene, grating))
    return grating.material


def group_of(scene: bpy.types.Scene, grating: Grating) -> bpy.types.NodeTree:
    """The node group of a baked grating, made if need be, the scene's lamps followed.

    Raises GratingError, with nothing changed, if the bake or all lamps are missing."""
    find_lamps(scene)
    bake = grating.baked_file()
    follow_lamps(scene)
    if grating.group is None:
        grating.group = new_diffraction_group(bake, grating.shadows)
    show_lamps()
    # EEVEE's usual ten bits to a normal put colours off by 1.5 % (median, a sphere) to 10 %.
    scene.render.use_high_quality_normals = True
    return grating.group

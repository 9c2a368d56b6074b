# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist sets on a grating, brought to its materials as soon as it is set."""

import bpy

from ..materials.skin import is_diffraction, lights_of, set_footprint, set_lighting


def follow_settings(first: bpy.types.Scene | None = None) -> None:
    """Have the materials of the file's gratings trace shadow rays, and count the footprint of a pixel, where that is
    set. What is as it should be is not made again. Scenes may share a material, as a copied scene does: then the
    settings of the scene `first` count."""
    done = set()
    for scene in sorted(bpy.data.scenes, key=lambda scene: scene != first):
        for grating in scene.natural_gratings.items if scene.library is None else ():
            group = grating.own_group
            if is_diffraction(group) and group not in done:
                done.add(group)
                set_lighting(group, shadows=grating.shadows, lights=lights_of(group))
                set_footprint(group, grating.footprint)

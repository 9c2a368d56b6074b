# SPDX-License-Identifier: GPL-3.0-or-later
"""Applying a grating's settings to its materials as soon as an artist changes them."""

from collections.abc import Iterable
from typing import Any

import bpy

from ..materials.group_properties import is_diffraction
from ..materials.skin import set_up


def follow_settings(first: bpy.types.Scene | None = None) -> None:
    """Apply the switches of the file's gratings to their materials. Nodes that are right already stay. If
    scenes share a material, as a copied scene does, the settings of the scene `first` count."""
    done: set[bpy.types.NodeTree] = set()
    for scene in sorted(bpy.data.scenes, key=lambda scene: scene != first):
        gratings: Iterable[Any] = scene.natural_gratings.items if scene.library is None else ()
        for grating in gratings:
            group = grating.own_group
            if is_diffraction(group) and group not in done:
                done.add(group)
                set_up(group, shadows=grating.shadows, footprint=grating.footprint, every_lamp=grating.every_lamp)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The sources of a scene's world, stored in properties of the scene and read by nodes
(sky_nodes.py).

A source is a compact bright part of the world, such as the sun in a sky or a window in an HDRI. The surface treats it
as a sun. The properties of source `i` are named `ng_world_<i>_<what>` and have no drivers. When the world changes, the
sources are removed (workflow/fitting_worlds.py), and the closures take over all light of the world.

    place   unit vector to the source; -1 - its variance in rad2 along one axis
    power   its irradiance, W/m2, in the scene's linear RGB; 1, because shadow rays go to its centre"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import bpy

from ..blender import stored

if TYPE_CHECKING:
    from ...precompute.world_sources.sources import Source

# Each source costs time in every pixel of the material.
SOURCES_MAX = 8
# Properties of the scene for the fit: the world's fingerprint, and the share of bright, compact light in no source.
_FINGERPRINT, _MISSED = "ng_world_fingerprint", "ng_world_missed"


def hold_sources(scene: bpy.types.Scene, sources: Sequence[Source], *, fingerprint: str, missed: float) -> None:
    """Store a fit with at most SOURCES_MAX sources."""
    forget_sources(scene)
    for index, source in enumerate(sources[:SOURCES_MAX]):
        scene[source_name(index, "place")] = [*map(float, source.direction), -1.0 - float(source.variance)]
        scene[source_name(index, "power")] = [*map(float, source.irradiance), 1.0]
    scene[_FINGERPRINT], scene[_MISSED] = fingerprint, float(missed)
    scene.update_tag()


def forget_sources(scene: bpy.types.Scene) -> bool:
    """Remove all stored sources. Return whether there were any."""
    names = [source_name(index, what) for index in range(SOURCES_MAX) for what in ("place", "power")]
    present = [name for name in (*names, _FINGERPRINT, _MISSED) if name in scene]
    for name in present:
        del scene[name]
    if present:
        scene.update_tag()
    return bool(present)


def source_count(scene: bpy.types.Scene) -> int:
    """The number of sources that the scene stores."""
    return sum(source_name(index, "place") in scene for index in range(SOURCES_MAX))


def fitted_world(scene: bpy.types.Scene) -> str:
    """The fingerprint of the fitted world; empty if there is no fit, or if a property of it was deleted or edited."""
    return stored.text(scene, _FINGERPRINT) if _is_whole(scene) else ""


def _is_whole(scene: bpy.types.Scene) -> bool:
    """Whether the properties of all sources are complete."""
    noted = [[source_name(index, what) in scene for what in ("place", "power")] for index in range(SOURCES_MAX)]
    names = [source_name(index, what) for index in range(sum(map(any, noted))) for what in ("place", "power")]
    return all(stored.numbers(scene, name, 4) is not None for name in names)


def missed_share(scene: bpy.types.Scene) -> float:
    """The share of the world's light that is bright and compact but in no source."""
    return stored.number(scene, _MISSED, low=0.0, high=1.0)


def source_name(index: int, what: str) -> str:
    """The name of a source's property. Saved .blend files contain these names, so they must not change."""
    return f"ng_world_{index}_{what}"

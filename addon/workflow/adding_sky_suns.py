# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding a sun lamp in place of the sun disc of the world's sky."""

import bpy

from ...precompute.base.failure import GratingError
from ..lamps.sky import SOURCES_MAX
from ..lamps.sky_sun import add_sky_sun, sky_with_disc
from .following_lamps import update_lamps

# The widest radius of a fitted source over the disc's own: the source has the disc's glow around it.
_WIDEST = 2.0


def replace_disc(scene: bpy.types.Scene) -> str:
    """Add a sun lamp with the direction, size, colour and irradiance of the sky's sun, and switch the sun disc off, so
    that no light counts twice. Returns a line to report. Raises GratingError, with nothing changed, if the world shows
    no sun disc or cannot be changed, or as world_probe.fit_of does."""
    from ..worlds.world_probe import fit_of

    world = scene.world
    sky = sky_with_disc(world)
    if world is None or sky is None:
        raise GratingError(f"scene {scene.name}", "its world shows no sky with a sun disc", "add a Sky Texture")
    if world.library is not None:
        raise GratingError(f"world {world.name}", "it is linked from another file", "make it local")
    narrow = (_WIDEST * sky.sun_size / 2) ** 2 / 4
    found = [source for source in fit_of(world, scene, SOURCES_MAX).sources if source.variance < narrow]
    if not found:
        raise GratingError(f"world {world.name}", "its sun is not seen", "raise the sun above the horizon")
    sun = add_sky_sun(scene, sky, max(found, key=lambda source: source.irradiance.sum()))
    update_lamps(scene)
    again = "if you turn the sky, switch the disc on and press again"
    return f"{sun.name}: lights everything in place of the sun disc; {again}"

# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a bake that serves the lamps of a scene."""

import bpy

from ...precompute.colour.several_lamps import light_for
from ..lamps.follow import counted_lamps
from ..lamps.lamp_spectrum import further_spectra, seen_spectrum


def light_of_scene(scene: bpy.types.Scene) -> str:
    """The canonical text of the light that serves the scene's lamps and the sources of its world: `smooth` if all are
    white, because a world's light seldom is. Raises GratingError as light_for does."""
    lamps = {seen_spectrum(lamp.data) for lamp in counted_lamps(scene)} - {""}
    known = further_spectra()
    light = light_for(lamp for lamp in lamps if ":" not in lamp or lamp in known)
    return light_for(["D5500"]) if light == light_for(()) else light

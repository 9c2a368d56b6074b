# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights that the scenes of the file hold, for Diffraction groups, which all scenes share."""

from itertools import zip_longest

import bpy

from ..gratings.lights_choice import REST
from ..lamps.follow import coloured_lamps, followed_lamps, lamp_count, left_out_count
from ..lamps.light_linking import is_linked
from ..lamps.sky import coloured_sources, source_count
from .group_properties import diffraction_groups, lamps_in, left_out_in, lights_of


def lamps_of_file() -> list[bool]:
    """For each lamp that some scene of the file follows, whether its light is linked. Never empty."""
    followed = [[is_linked(lamp) for lamp in followed_lamps(scene)] for scene in bpy.data.scenes]
    return [any(linked) for linked in zip_longest([False], *followed, fillvalue=False)]


def areas_of_file() -> set[int]:
    """The indices of the lamps that are area lamps in some scene of the file."""
    lamps = (pair for scene in bpy.data.scenes for pair in enumerate(followed_lamps(scene)))
    return {index for index, lamp in lamps if lamp.data.type == "AREA"}


def coloured_of_file() -> set[int]:
    """The indices of the lamps that may have another spectrum than white in some scene of the file."""
    return set().union(*map(coloured_lamps, bpy.data.scenes))


def has_coloured_sources() -> bool:
    """Whether a source of a world in the file has another spectrum than white."""
    return any(map(coloured_sources, bpy.data.scenes))


def left_out_of_file() -> int:
    """The largest number of lamps that the artist leaves out of a scene of the file."""
    return max(map(left_out_count, bpy.data.scenes), default=0)


def sources_of_file() -> int:
    """The largest number of world sources that a scene of the file stores."""
    return max(map(source_count, bpy.data.scenes), default=0)


def follows_light_linking() -> bool:
    """Whether some Diffraction group in the file applies light linking."""
    return any(any(lamps_in(group)) for group in diffraction_groups())


def follows_world() -> bool:
    """Whether some Diffraction group that the file uses reads the sources of worlds."""
    return any(group.users and lights_of(group) == REST for group in diffraction_groups())


def linked_with_fewer_lamps(scene: bpy.types.Scene) -> list[str]:
    """One warning line for each linked (so read-only) Diffraction group with fewer lamps than the scene follows, and
    one for each that shows lamps which the artist leaves out."""
    count, left_out = lamp_count(scene), left_out_count(scene)
    groups = [group for group in diffraction_groups() if group.library is not None]
    fewer = [(group.name, len(lamps_in(group))) for group in groups if len(lamps_in(group)) < count]
    lines = [f"{name}: linked with only {held} of {count} lamps; make it local" for name, held in fewer]
    showing = [group.name for group in groups if lights_of(group) == REST and left_out_in(group) < left_out]
    return lines + [f"{name}: linked, so it shows lamps that you leave out; make it local" for name in showing]

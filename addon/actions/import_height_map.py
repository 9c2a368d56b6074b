# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a height map into a scene's gratings."""

import bpy

from ...precompute.base.failure import printable
from ...precompute.surface.description import Description, describe
from ...precompute.surface.height_map import SAMPLE_PREFIX, HeightMap
from ...precompute.surface.quality import LIGHTS
from ...precompute.surface.readers.registry import read_height_map
from ...precompute.surface.samples.catalogue import title_of
from ..scene.gratings import Grating, kept_path


def add_grating(
    scene: bpy.types.Scene, source: str, *, size_um: float = 0.0, height_nm: float = 0.0, channel: str = ""
) -> Grating:
    """Read a height map and add it to the scene as its active grating.

    Where size_um, height_nm or channel is 0 or empty, the value that the file holds is used.

    Raises GratingError if it cannot be read, or if Blender cannot keep its name."""
    height_map = read_height_map(kept_path(source), size_um or None, height_nm or None, channel=channel or None)
    facts = describe(height_map)
    gratings = scene.natural_gratings
    name = unused_name(name_of(height_map), {g.name for g in gratings.items})
    grating = gratings.items.add()
    grating.name = name
    grating.source, grating.summary, grating.quality = source, summary_of(facts), quality_of(facts)
    grating.size_um, grating.height_nm, grating.channel = size_um, height_nm, channel
    gratings.active_index = len(gratings.items) - 1
    return grating


def quality_of(facts: Description) -> str:
    """The light of the whole scan, and below it a line of each finding that is not good."""
    found = (each for each in facts.quality.findings if each.light != LIGHTS[0])
    return "\n".join([facts.quality.light, *(f"{each.topic}: {each.light}; {each.sentence}" for each in found)])


def name_of(height_map: HeightMap) -> str:
    """A new grating's name: the sample's as people write it, or the file's."""
    return title_of(height_map.stem) if height_map.source.startswith(SAMPLE_PREFIX) else printable(height_map.stem)


def unused_name(name: str, taken: set[str]) -> str:
    """The name, with a number in Blender's form where it is taken. Names must differ because a finished bake finds
    its grating by name."""
    candidates = (name, *(f"{name}.{number:03}" for number in range(1, len(taken) + 1)))
    return next(c for c in candidates if c not in taken)


def summary_of(facts: Description) -> str:
    """One line of what `info` found."""
    dy, dx = facts.pixel_size_m
    size = f"{facts.cols * dx * 1e6:.3g} x {facts.rows * dy * 1e6:.3g} um"
    periods = facts.periods_m
    # round() and + 0 keep a minus off zero.
    angle = round(facts.period_angles_deg[0]) + 0 if periods else 0
    period = f", period {periods[0] * 1e9:.0f} nm at {angle} deg" if periods else ""
    return f"{size}, relief {facts.relief_in_words()}{period}"

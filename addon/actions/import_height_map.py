# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a height map into a scene's gratings, and what the import dialog says of the files that can be read."""

from dataclasses import dataclass
from typing import Any

import bpy

from ...precompute.surface.description import describe
from ...precompute.surface.readers import registry
from ..scene.gratings import Grating


@dataclass(frozen=True)
class FileKind:
    """A kind of file that can be read. `needs_size`: its size and height must be given, as it does not hold them."""

    name: str
    extensions: tuple[str, ...]
    needs_size: bool


def file_kinds() -> tuple[FileKind, ...]:
    """Every kind of file that precompute reads. Only this function knows the shape of precompute's registry."""
    return tuple(FileKind(kind.name, kind.extensions, not kind.measured) for kind in registry.FORMATS)


def file_filter() -> str:
    """The patterns by which the file browser hides other files."""
    return ";".join(f"*{extension}" for kind in file_kinds() for extension in kind.extensions)


def menu_text() -> str:
    """The entry in File > Import, with the first extension of each kind."""
    return f"Height Map ({', '.join(kind.extensions[0] for kind in file_kinds())})"


def tooltip() -> str:
    """What the import does, and for which files it needs a width and a height."""
    named = {
        needs_size: ", ".join(
            f"{kind.name} ({', '.join(kind.extensions)})" for kind in file_kinds() if kind.needs_size == needs_size
        )
        for needs_size in (False, True)
    }
    return (
        f"Read a measured height map into the scene's gratings. Files that hold their own size: {named[False]}. "
        f"Pictures, for which you give width and height: {named[True]}"
    )


def add_grating(
    scene: bpy.types.Scene, source: str, *, size_um: float = 0.0, height_nm: float = 0.0, channel: str = ""
) -> Grating:
    """Read a height map and add it to the scene as its active grating. Width, height and channel are the file's own
    where they are 0 or empty.

    Raises GratingError if it cannot be read."""
    height_map = registry.read_height_map(source, size_um or None, height_nm or None, channel or None)
    facts = describe(height_map)
    gratings = scene.natural_gratings
    name = unused_name(height_map.stem, {g.name for g in gratings.items})
    grating = gratings.items.add()
    grating.name = name
    grating.source, grating.summary = source, summary_of(facts)
    grating.size_um, grating.height_nm, grating.channel = size_um, height_nm, channel
    gratings.active_index = len(gratings.items) - 1
    return grating


def unused_name(name: str, taken: set[str]) -> str:
    """The name, with a number as Blender gives them if it is taken: a bake that ends finds its grating by name."""
    candidates = (name, *(f"{name}.{number:03}" for number in range(1, len(taken) + 1)))
    return next(c for c in candidates if c not in taken)


def summary_of(facts: dict[str, Any]) -> str:
    """A height map's description in one line."""
    dy, dx = facts["pixel_size_m"]
    size = f"{facts['cols'] * dx * 1e6:.3g} x {facts['rows'] * dy * 1e6:.3g} um"
    relief = f"relief {facts['height_range_m'] * 1e9:.0f} nm"
    periods = facts["periods_m"]
    # round() and + 0 avoid "-0 deg".
    angle = round(facts["period_angles_deg"][0]) + 0 if periods else 0
    period = f", period {periods[0] * 1e9:.0f} nm at {angle} deg" if periods else ""
    return f"{size}, {relief}{period}"

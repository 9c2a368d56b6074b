# SPDX-License-Identifier: GPL-3.0-or-later
"""Importing height maps as gratings of a scene, and the width that the dialog offers for files that do not store
theirs: from their names, else the last one."""

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.surface.generated.parameters import canonical, parse_grating
from ...precompute.surface.height_map import GRATING_PREFIX, SAMPLE_PREFIX, HeightMap, is_synthetic
from ...precompute.surface.quality import LIGHTS, Description, describe
from ...precompute.surface.readers.pictures import named_width_um
from ...precompute.surface.readers.reader_registry import read_height_map, read_other_way, reader_of
from ...precompute.surface.samples.catalogue import matter_of, title_of
from ...precompute.surface.steps.pipeline import DEFAULT
from ..blender.guard import absolute, kept_path
from ..gratings.grating import Grating, Variation, scan_record, take_matter, unused_name
from ..gratings.wording import in_one_line, labelled
from ..materials.group_properties import variation_of


def add_grating(
    scene: bpy.types.Scene, source: str, *, size_um: float = 0.0, height_nm: float = 0.0, channel: str = ""
) -> Grating:
    """Read a height map and add it as the scene's active grating. 0 or empty arguments mean the file's own values.
    Raises GratingError if the file cannot be read, or if Blender cannot store its name."""
    (grating,) = add_each(scene, [scan_record(source, size_um, height_nm, channel=channel)])
    return grating


def add_each(scene: bpy.types.Scene, records: Sequence[dict[str, Any]]) -> list[Grating]:
    """Read scans, given as records of a request, and add each as a separate grating; the last becomes the active one.
    Raises GratingError, with none added, as add_grating does."""
    return [_add(scene, [record], [read]) for record, read in zip(records, _read(records), strict=True)]


def add_averaged(scene: bpy.types.Scene, records: Sequence[dict[str, Any]]) -> Grating:
    """Read scans of one skin, or tiles of one area, given as records of a request, and add them as one grating, the
    active one. Its bake averages their spectra. Raises GratingError as add_each does."""
    return _add(scene, records, _read(records))


def import_scans(scene: bpy.types.Scene, records: Sequence[dict[str, Any]], *, averaged: bool = False) -> list[str]:
    """Read scans and add them as add_each does, or with `averaged` as add_averaged does. If the list has an identical
    grating already, that one becomes active instead: a duplicate would only cost a second bake and material. Returns a
    line for each grating. Raises GratingError as add_each does."""
    known = _read(records)
    each = [(records, known)] if averaged else [([r], [k]) for r, k in zip(records, known, strict=True)]
    return [_import(scene, *one) for one in each]


def _import(scene: bpy.types.Scene, records: Sequence[dict[str, Any]], known: Sequence[tuple[str, Description]]) -> str:
    _add(scene, records, known)
    return keep_if_new(scene)


def all_or_none(scene: bpy.types.Scene, adds: Iterable[Callable[[], list[str]]]) -> list[str]:
    """Add gratings by functions that return lines to report; returns all lines. If one raises GratingError, the scene
    keeps none of them."""
    gratings = scene.natural_gratings
    count, active = len(gratings.items), gratings.active_index
    try:
        return [line for add in adds for line in add()]
    except GratingError:
        while len(gratings.items) > count:
            gratings.items.remove(len(gratings.items) - 1)
        gratings.active_index = active
        raise


def keep_if_new(scene: bpy.types.Scene) -> str:
    """Remove the scene's last grating again if an identical one is in the list, and make that one active. Returns a
    line for the grating that is kept."""
    gratings = scene.natural_gratings
    new = _settings(gratings.items[-1])
    last = len(gratings.items) - 1
    same = next(index for index, grating in enumerate(gratings.items) if _settings(grating) == new)
    if same == last:
        return f"{gratings.items[last].name}: {in_one_line(gratings.items[last].summary)}"
    gratings.items.remove(last)
    gratings.active_index = same
    return (
        f"{gratings.items[same].name}: it is in the list already, and now selected. For a second, change this one first"
    )


def _settings(grating: Grating) -> tuple[Any, ...]:
    """All settings of a grating except its name."""
    scan = (absolute(grating.source), grating.channel, grating.size_um, grating.height_nm)
    optics = (grating.matter, grating.layers, grating.plate_ior, grating.illuminant)
    bake = (grating.levelling, grating.delta_e, grating.coherence_um, grating.spread_deg, *optics, grating.request)
    variation = Variation() if grating.group is None else variation_of(grating.group)
    look = (tuple(grating.look.base_color), grating.look.base_roughness, grating.look.inputs, grating.look.hologram)
    shown = grating.lights, grating.shadows, grating.footprint, grating.every_lamp
    return *scan, *bake, *look, *shown, grating.frame_source(), variation


def _read(records: Sequence[dict[str, Any]]) -> list[tuple[str, Description]]:
    """The name and description of each scan. Only one scan is in memory at a time."""
    return [description_of(record) for record in records]


def description_of(record: dict[str, Any]) -> tuple[str, Description]:
    """The name and description of a scan, given as a record of a request. Raises GratingError if it cannot be read."""
    sizes = record["size_um"], record["height_nm"]
    height_map = read_height_map(kept_path(record["source"]), *sizes, channel=record["channel"])
    return name_of(height_map), describe(height_map, partial(read_other_way, height_map))


def _add(
    scene: bpy.types.Scene, records: Sequence[dict[str, Any]], known: Sequence[tuple[str, Description]]
) -> Grating:
    gratings = scene.natural_gratings
    first, *others = records
    name = unused_name(known[0][0], {g.name for g in gratings.items})
    grating = gratings.items.add()
    grating.name, grating.source = name, canonical(first["source"])
    grating.channel = first["channel"] or ""
    grating.size_um, grating.height_nm = first["size_um"] or 0.0, first["height_nm"] or 0.0
    _describe(grating, known)
    grating.request = json.dumps({"scans": others}, sort_keys=True) if others else ""
    grating.levelling = ",".join(step.text for step in DEFAULT)
    take_matter(grating, matter_of(first["source"]))
    gratings.active_index = len(gratings.items) - 1
    return grating


def _describe(grating: Grating, known: Sequence[tuple[str, Description]]) -> None:
    """Keep the summary and the quality of a grating's scans."""
    mean = f"\nthe mean of {len(known)} scans" if len(known) > 1 else ""
    grating.summary, grating.quality = summary_of(known[0][1]) + mean, quality_of(known)


def quality_of(known: Sequence[tuple[str, Description]]) -> str:
    """The worst quality rating of the scans, then a line for each finding that is not good, with the scan if there are
    several."""
    light = max((facts.quality.light for _, facts in known), key=LIGHTS.index)
    found = (
        (f"{name}: " if len(known) > 1 else "") + f"{each.topic}: {each.light}; {labelled(each.words)}"
        for name, facts in known
        for each in facts.quality.findings
        if each.light != LIGHTS[0]
    )
    return "\n".join([light, *found])


def name_of(height_map: HeightMap) -> str:
    """A new grating's name: the sample's title, the kind and the period of a grating by its parameters, or the file's
    name."""
    if height_map.source.startswith(GRATING_PREFIX):
        return parse_grating(height_map.source).title
    return title_of(height_map.stem) if height_map.source.startswith(SAMPLE_PREFIX) else printable(height_map.stem)


def summary_of(facts: Description) -> str:
    """The scan's size, relief and period, a line each."""
    dy, dx = facts.pixel_size_m
    size = f"{facts.cols * dx * 1e6:.3g} x {facts.rows * dy * 1e6:.3g} um"
    periods = facts.periods_m
    # round() and + 0 avoid "-0".
    angle = round(facts.period_angles_deg[0]) + 0 if periods else 0
    period = f"\nperiod {periods[0] * 1e9:.0f} nm at {angle} deg" if periods else ""
    return f"{size}\nrelief {facts.relief_in_words()}{period}"


# The width that was used last in this session, in micrometres; none before the first.
_last: list[float] = []


@dataclass(frozen=True)
class Offer:
    """A width in micrometres, and the words that say where it comes from. 0: there is none to offer."""

    width_um: float = 0.0
    origin: str = ""


def offer_for(paths: Sequence[str]) -> Offer:
    """The width to offer for files that are chosen together. There is none if their names differ in it."""
    named = {named_width_um(path) for path in paths if needs_width(path)}
    if not named:
        return Offer()
    if named == {None}:
        return Offer(_last[0], "as in your last import") if _last else Offer()
    (width, *others) = named
    if others or width is None:
        return Offer()
    return Offer(width, "from the file's name" if len(paths) == 1 else "from the files' names")


def needs_width(path: str) -> bool:
    """Whether a file does not store its width. False for a file that cannot be read."""
    try:
        return not is_synthetic(path) and reader_of(path).needs_size
    except GratingError:
        return False


def import_chosen(
    scene: bpy.types.Scene, paths: Sequence[str], *, size_um: float, height_nm: float, channel: str, averaged: bool,
    origin: str,
) -> list[str]:  # fmt: skip
    """Import files as import_scans does, and remember the width. `origin` says where the width comes from if it is an
    offer: then only files that do not store theirs take it, and their lines name it."""
    sizes = [0.0 if origin and not needs_width(path) else size_um for path in paths]
    records = [scan_record(p, size, height_nm, channel=channel) for p, size in zip(paths, sizes, strict=True)]
    lines = import_scans(scene, records, averaged=averaged)
    if any(sizes):
        _last[:] = [size_um]
    notes = [f", width {size_um:.6g} um {origin}" if origin and size else "" for size in sizes]
    return [line + note for line, note in zip(lines, [max(notes)] if averaged else notes, strict=True)]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Making gratings from bakes that exist already, with everything that a bake's header says."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import bpy

from ...precompute.bake.request import BakeRequest, Scan, request_from
from ...precompute.base.failure import GratingError, printable
from ...precompute.cli.arguments import existing_bake
from ...precompute.measure.shown_colours import is_shown
from ...precompute.surface.generated.parameters import title_of_stem
from ...precompute.surface.height_map import is_synthetic
from ...precompute.surface.quality import Description
from ...precompute.table.atlas import read_sound_header
from ...precompute.table.blur_levels import BYTES_PER_TEXEL
from ...precompute.table.sample_set import path_beside
from ...precompute.table.sample_set import read_header as read_sample_set_header
from ..blender.guard import absolute, kept_path
from ..gratings.grating import Grating, unused_name
from ..gratings.wording import in_one_line
from .baking import record_bake
from .importing import description_of, quality_of, summary_of


def load_bake(scene: bpy.types.Scene, bake: str) -> list[str]:
    """Make a bake's grating, or select the one in the list, and make it the scene's active grating. `bake` is the
    bake's file, its sample set, or their folder. Returns a line to report. Raises GratingError as index_of does."""
    gratings = scene.natural_gratings
    before = len(gratings.items)
    gratings.active_index = index_of(scene, bake)
    grating = gratings.active()
    if len(gratings.items) == before:
        return [f"{grating.name}: it is in the list already, and now selected"]
    grating.name = unused_name(grating.name, {each.name for each in gratings.items[:before]})
    return [f"{grating.name}: {in_one_line(grating.bake_summary or grating.summary) or 'loaded'}"]


def index_of(scene: bpy.types.Scene, bake: str) -> int:
    """The index of the scene's grating with a bake, added if missing. Raises GratingError if there is no such bake, or
    if its files are damaged; then no grating is added."""
    file = bake_file(bake)
    path = kept_path(str(file.resolve()))
    items = scene.natural_gratings.items
    for index, grating in enumerate(items):
        if grating.bake_path == path:
            return index
    found = _found(Path(path))
    grating = items.add()
    grating.name = title_of_stem(file.stem)
    _fill(grating, path, found)
    return len(items) - 1


def take_bake(grating: Grating, path: str) -> None:
    """Set a grating's fields from the header of its bake. Raises GratingError, with nothing changed, as index_of
    does."""
    _fill(grating, path, _found(Path(absolute(path))))


def bake_file(bake: str) -> Path:
    """A bake's file, given the file, its sample set or its folder. Raises GratingError if there is none."""
    file = existing_bake(bake) if bake else None  # no text is the working folder
    if file is None or not file.is_file():
        raise GratingError(bake, "no bake there", "give the .exr that `bake` wrote, or its folder")
    return _table_of(file) if _is_sample_set(file) else file


def _is_sample_set(file: Path) -> bool:
    try:
        read_sample_set_header(file)
    except GratingError:
        return False
    return True


def _table_of(sample_set: Path) -> Path:
    """The bake beside its sample set. Raises GratingError if it is not there."""
    for table in sorted(sample_set.parent.glob("*.exr")):
        if path_beside(table) == sample_set:
            return table
    raise GratingError(sample_set, "half of a bake: its other .exr is not beside it", "copy both into one folder")


@dataclass(frozen=True)
class _Found:
    """The contents of a bake's header: its request, the facts that a bake reports, and the scan's summary and rating.
    Without provenance, all are None or empty."""

    request: BakeRequest | None = None
    facts: dict[str, Any] | None = None
    summary: str = ""
    quality: str = ""


def _found(path: Path) -> _Found:
    """Read a bake's header, and its surface if that needs no file. Raises GratingError for a damaged or forged file."""
    layout, record = read_sound_header(path)
    if not {"request", "delta_e", "coherence_um", "pixel_size_m", "shape", "height_range_m"} <= set(record):
        return _Found()
    request = request_from(record["request"], str(path))
    pairs = record["shape"], record["pixel_size_m"], [record["coherence_um"], record["delta_e"].get("p99")]
    if not (request.scans and all(map(_are_numbers, pairs))):
        raise GratingError(path, "its header's provenance is incomplete", "bake it again")
    facts = {
        "delta_e": record["delta_e"],
        "coherence_um": record["coherence_um"],
        "tiles": layout.terms,
        "blender_bytes": BYTES_PER_TEXEL * layout.width * layout.height,
        "files": [str(path)],
    }
    if is_shown(record.get("shown")):
        facts["shown"] = record["shown"]
    if not _needs_no_file(request):
        return _Found(request, facts, _summary_of_header(record))
    known = [_described(scan, path) for scan in request.scans]
    more = f"\nthe mean of {len(known)} scans" if known[1:] else ""
    return _Found(request, facts, summary_of(known[0][1]) + more, quality_of(known))


def _are_numbers(pair: list[Any]) -> bool:
    return len(pair) == 2 and all(type(number) in (int, float) for number in pair)


def _needs_no_file(request: BakeRequest) -> bool:
    return all(is_synthetic(scan.source) for scan in request.scans)


def _described(scan: Scan, path: Path) -> tuple[str, Description]:
    """The name and description of a synthetic surface. Raises GratingError, with the bake's path, if there is none."""
    try:
        return description_of(asdict(scan))
    except GratingError as error:
        raise error.within(path) from error


def _summary_of_header(record: dict[str, Any]) -> str:
    """The scan's size and relief as the bake's header has them, a line each."""
    (rows, cols), (dy, dx) = record["shape"], record["pixel_size_m"]
    scan = printable(record.get("source", "")) or "scan"
    return (
        f"{cols * dx * 1e6:.3g} x {rows * dy * 1e6:.3g} um\nrelief {record['height_range_m'] * 1e9:.0f} nm levelled\n"
        f"from its bake, without {scan}"
    )


def _fill(grating: Grating, path: str, found: _Found) -> None:
    """Set a new grating's fields."""
    grating.bake_path = path
    if found.request is None or found.facts is None:
        return
    grating.take_request(found.request)
    if not _needs_no_file(found.request):
        grating.source = ""  # the header does not store the scan's folder
    grating.summary, grating.quality = found.summary, found.quality
    record_bake(grating, found.facts, found.request)

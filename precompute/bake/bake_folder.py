# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a bake and writes it into a folder, with its provenance in the header. The files appear complete or not at all
(base/files.py)."""

import hashlib
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base.progress import Progress, span_of
from ..measure.shown_colours import is_shown
from ..optics import coherence
from ..surface.height_map import HeightMap
from ..surface.quality import replaced_width
from ..surface.relief import Relief, relief_of
from ..surface.steps.pipeline import WARNING, level
from ..table import sample_set
from ..table.atlas_file import AnyLayout, check_can_write, write_together
from ..table.sample_set import path_beside
from .kernel import extent
from .make import Made, make
from .request import BakeRequest
from .table_colours import shown_colours

# The share of a bake's time that levelling takes, about.
_LEVELLED = 0.01
# The stage that levels the scans, and may refuse one.
LEVELLING = "levelling"
# The figures that bake_to_folder reports, and the figures in `delta_e`.
_FIGURES = ("seconds", "check_seconds", "blender_bytes", "tiles", "resolution", "coherence_um", "largest_albedo")
_ERRORS = ("mean", "p95", "p99", "max", "pairs")


def bake_to_folder(
    height_maps: Sequence[HeightMap], request: BakeRequest, folder: Path, *, progress: Progress
) -> dict[str, Any]:
    """Bake height maps into a folder: the table's file and the sample set's file.

    Returns the run's facts, as for `--json`; the table's file comes first in `files`. Raises GratingError as
    `check_can_write`, `make` and `write_together` do."""
    check_can_write()
    reliefs, told = _levelled(height_maps, request, progress=span_of(progress, 0, _LEVELLED))
    source = ", ".join(height_map.source for height_map in height_maps)
    made = make(reliefs, request, progress=span_of(progress, _LEVELLED, 1), source=source)
    provenance = provenance_of(height_maps, reliefs, request, made=made)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{bake_name(height_maps)}.exr"
    pictures: dict[Path, tuple[np.ndarray, AnyLayout]] = {path: (made.image, made.layout)}
    if made.sample_set is not None:
        pictures[path_beside(path)] = sample_set.pack(made.sample_set)
    write_together(pictures, provenance)
    return {
        "seconds": made.seconds,
        "check_seconds": made.check_seconds,
        "peak_bytes": peak_bytes(),
        "blender_bytes": made.blender_bytes,
        "tiles": made.layout.terms,
        "resolution": max(made.table.tile),
        "tile": list(made.table.tile),
        "wavelengths": made.wavelengths,
        "transforms": made.transforms,
        "precision": str(made.image.dtype),
        "coherence_um": provenance["coherence_um"],
        "largest_albedo": made.table.largest_albedo,
        "levelling": [*told, *_reduced(request, made.table.coherence_length_m)],
        "delta_e": made.delta_e,
        "shown": provenance["shown"],
        "files": [str(file) for file in pictures],
    }


def _reduced(request: BakeRequest, length_m: float) -> list[str]:
    """A warning if a bake's coherence length is shorter than the requested one (kernel.py)."""
    asked_m = request.coherence_length_m or length_m
    if length_m > 0.99 * asked_m:
        return []
    asked, given = (f"{each * 1e6:.3g} um" for each in (asked_m, length_m))
    return [f"{WARNING}coherence of {asked}: reduced to {given}, as the scan's size or what the scene needs allows"]


def _levelled(
    height_maps: Sequence[HeightMap], request: BakeRequest, *, progress: Progress
) -> tuple[list[Relief], list[str]]:
    """Level the scans. Returns the reliefs and the steps' messages; with several scans, each names its scan."""
    reliefs, told = [], []
    for number, height_map in enumerate(height_maps):
        progress(LEVELLING, number / len(height_maps))
        levelled = level(height_map, request.levelling)
        reliefs.append(relief_of(levelled.height_map, plate_ior=request.matter.plate_ior))
        replaced = replaced_width(height_map)
        lines = [*([f"{WARNING}{replaced}"] if replaced else []), *levelled.told]
        told += [f"{height_map.source_name}: {line}" if len(height_maps) > 1 else line for line in lines]
    return reliefs, told


def provenance_of(
    height_maps: Sequence[HeightMap], reliefs: Sequence[Relief], request: BakeRequest, *, made: Made
) -> dict[str, Any]:
    """The provenance in a bake's header. Several scans are listed in the given order."""
    length_m = made.table.coherence_length_m
    area, profiles = extent(reliefs)
    return {
        "source": ", ".join(height_map.source_name for height_map in height_maps),
        "channel": height_maps[0].channel,
        "heights_sha256": list(map(heights_sha256, height_maps)),
        "pixel_size_m": list(height_maps[0].pixel_size_m),
        "shape": list(height_maps[0].height_m.shape),
        "height_range_m": max(relief.height_range_m for relief in reliefs),
        "model": request.model,
        "coherence_um": length_m * 1e6,
        "coherence_areas": coherence.coherence_areas((area, 1.0), length_m, profiles),
        "precision": str(made.image.dtype),
        "asked_delta_e": request.delta_e,
        "request": request.as_dict(),
        "delta_e": made.delta_e,
        "shown": {space: found.as_dict() for space, found in shown_colours(made.table).items()},
    }


def heights_sha256(height_map: HeightMap) -> str:
    """The SHA-256 of a scan's heights, in hexadecimal."""
    return hashlib.sha256(np.ascontiguousarray(height_map.height_m, dtype="<f8").data).hexdigest()


def are_facts(facts: Mapping[str, Any], height_maps: Sequence[HeightMap]) -> bool:
    """Whether a record holds bake_to_folder's facts for these height maps, with file names under `files`."""
    name = bake_name(height_maps)
    told = facts.get("levelling", [])
    tile, errors = facts.get("tile"), facts.get("delta_e")
    return (
        facts["files"] in ([f"{name}.exr"], [f"{name}.exr", path_beside(Path(f"{name}.exr")).name])
        and all(_is_figure(facts.get(key)) for key in _FIGURES)
        and isinstance(tile, list)
        and len(tile) == 2
        and all(map(_is_figure, tile))
        and isinstance(told, list)
        and all(isinstance(line, str) for line in told)
        and isinstance(errors, dict)
        and all(_is_figure(errors.get(key)) for key in _ERRORS)
        and is_shown(facts.get("shown", {}))
    )


def _is_figure(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def bake_name(height_maps: Sequence[HeightMap]) -> str:
    """The file stem of a bake: the stem of the first height map, and the number of further height maps."""
    more = f"_and_{len(height_maps) - 1}_more" if len(height_maps) > 1 else ""
    return height_maps[0].stem + more


def peak_bytes() -> int | None:
    """The peak memory of this process in bytes; None if the system does not report it (Windows)."""
    status = Path("/proc/self/status")
    if status.is_file():
        # On Linux, ru_maxrss includes the memory of the parent at the start of this process; VmHWM does not.
        held = [line.split()[1] for line in status.read_text().splitlines() if line.startswith("VmHWM:")]
        if held:
            return int(held[0]) * 1024
    try:
        import resource
    except ImportError:
        return None
    # ru_maxrss is in kilobytes on Linux, and in bytes on macOS.
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)

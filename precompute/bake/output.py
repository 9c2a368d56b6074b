# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake written into a folder, with what its header says of its making."""

import hashlib
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..base.progress import Progress
from ..optics import coherence
from ..surface.height_map import HeightMap
from ..surface.relief import Relief, prepare
from ..table import sample_set
from ..table.atlas_file import write_together
from ..table.sample_set import path_beside
from .kernel import extent
from .make import Made, make
from .request import BakeRequest


def bake_to_folder(height_maps: Sequence[HeightMap], request: BakeRequest, folder: Path, progress: Progress) -> dict:
    """Bake height maps into a folder, the table's file and the sample set's; the facts of the run, as `--json` gives
    them, the table's file first."""
    reliefs = [prepare(height_map) for height_map in height_maps]
    made = make(reliefs, request, progress=progress, source=", ".join(height_map.source for height_map in height_maps))
    provenance = provenance_of(height_maps, reliefs, request, made)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{bake_name(height_maps)}.exr"
    pictures = {path: (made.image, made.layout)}
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
        "delta_e": provenance["delta_e"],
        "files": [str(file) for file in pictures],
    }


def provenance_of(
    height_maps: Sequence[HeightMap], reliefs: Sequence[Relief], request: BakeRequest, made: Made
) -> dict:
    """What the header says of a bake's making; of several scans in the order given."""
    length_m = coherence.coherence_length(made.table.sigma_b)
    area, profiles = extent(reliefs)
    return {
        "source": ", ".join(height_map.source_name for height_map in height_maps),
        "channel": height_maps[0].channel,
        "heights_sha256": [
            hashlib.sha256(np.ascontiguousarray(height_map.height_m).tobytes()).hexdigest()
            for height_map in height_maps
        ],
        "pixel_size_m": list(height_maps[0].pixel_size_m),
        "shape": list(height_maps[0].height_m.shape),
        "height_range_m": max(relief.height_range_m for relief in reliefs),
        "model": request.model,
        "coherence_um": length_m * 1e6,
        "coherence_areas": coherence.coherence_areas((area, 1.0), length_m, profiles),
        "precision": str(made.image.dtype),
        "asked_delta_e": request.delta_e,
        "request": request.as_dict(),
        "delta_e": made.errors.as_dict(),
    }


def bake_name(height_maps: Sequence[HeightMap]) -> str:
    """File stem of a bake: the first height map's."""
    more = f"_and_{len(height_maps) - 1}_more" if len(height_maps) > 1 else ""
    return height_maps[0].stem + more


def peak_bytes() -> int | None:
    """The most memory this process has held, where the system tells (not on Windows)."""
    status = Path("/proc/self/status")
    if status.is_file():
        # Linux counts in ru_maxrss what the parent held when it started us; the mark of our own memory does not.
        held = [line.split()[1] for line in status.read_text().splitlines() if line.startswith("VmHWM:")]
        if held:
            return int(held[0]) * 1024
    try:
        import resource
    except ImportError:
        return None
    # Kilobytes on Linux, bytes on macOS.
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)

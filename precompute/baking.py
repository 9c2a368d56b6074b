# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake that keeps its budget: plan, carry out, measure what the file would hold, and refine once if it must be."""

import hashlib
import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from . import atlas, coherence, lobes, patch_bake
from .bake import BYTES_PER_TEXEL, Bake, Progress, blender_bytes, carry_out, extent, plan
from .failure import GratingError
from .height_map import HeightMap
from .metric import Errors
from .needs import EVERYTHING, Needs
from .relief import Relief, prepare
from .self_check import self_check

# Past this a table is no longer something to hand to an artist's graphics card.
ATLAS_BYTES_MAX = 1 << 30
# |dY| over Y that goes with a dE00 of 1 or less.
_RELATIVE_DY = 0.01


@dataclass(frozen=True)
class Order:
    """What is asked of a bake. `delta_e` is the 99th percentile of CIEDE2000; a coherence length of None is auto, under
    the patch model the thesis's."""

    delta_e: float = 1.0
    coherence_length_m: float | None = None
    illuminant: str = "D65"
    needs: Needs = EVERYTHING
    model: str = "ensemble"


MODELS = "ensemble", "patch"


@dataclass(frozen=True)
class Made:
    """A bake as its file will hold it, the sample set beside it (none under the patch model), its measured errors, and
    what it took."""

    bake: Bake
    sample_set: lobes.Lobes | None
    image: np.ndarray
    layout: atlas.Layout
    errors: Errors
    wavelengths: int
    transforms: int
    seconds: float
    check_seconds: float

    @property
    def blender_bytes(self) -> int:
        return BYTES_PER_TEXEL * self.layout.width * self.layout.height


def make(
    reliefs: Sequence[Relief], order: Order, progress: Progress = lambda stage, fraction: None, source: str = "the scan"
) -> Made:
    """Bake reliefs to an order. Raises GratingError, naming `source`, if its budget cannot be met, with what could
    be."""
    made = _attempt(reliefs, order, progress, 1.0, source)
    excess = _excess(made.errors, order.delta_e)
    if excess > 1:
        # The error falls as the fourth power of the texels; what it does not, a second look tells.
        again = _attempt(reliefs, order, progress, (1.5 * excess) ** 0.25, source)
        again = _with_time_of(again, made)
        made = again if _excess(again.errors, order.delta_e) < excess else made
    if _excess(made.errors, order.delta_e) > 1:
        errors = made.errors
        reached = max(errors.p99, errors.relative_dy / _RELATIVE_DY)
        raise GratingError(
            f"{source}: the bake reaches a dE00 of {errors.p99:.2f} (99th percentile) and {errors.relative_dy:.1%} of "
            f"the light, not the asked {order.delta_e:g}; ask for --delta-e {math.ceil(reached * 10.5) / 10:g} or a "
            "shorter --coherence-um"
        )
    return made


def _excess(errors: Errors, delta_e: float) -> float:
    """By how much a bake misses its budget: 1 or less is kept."""
    return max(errors.p99 / delta_e, errors.relative_dy / (_RELATIVE_DY * max(delta_e, 1)))


def _steps(model: str) -> tuple[Callable, Callable, Callable]:
    """Plan, carry out and self-check of a model of coherence."""
    if model == "patch":
        return patch_bake.plan, patch_bake.carry_out, patch_bake.self_check
    return plan, carry_out, self_check


def _attempt(reliefs, order: Order, progress: Progress, finer: float, source: str) -> Made:
    started = time.perf_counter()
    plan_it, carry_it_out, check_it = _steps(order.model)
    try:
        chosen = plan_it(
            reliefs, order.coherence_length_m, order.delta_e, order.illuminant, order.needs, progress, finer
        )  # fmt: skip
    except GratingError as error:
        raise GratingError(f"{source}: {error}") from error
    in_blender = blender_bytes(chosen.terms, tuple(len(axis) for axis in chosen.axes), chosen.sigma_b)
    if in_blender > ATLAS_BYTES_MAX:
        raise GratingError(
            f"{source}: the table would take {in_blender / 2**20:.0f} MiB in Blender; ask for a shorter "
            "--coherence-um, or for a part of it by --needs"
        )
    image, layout = atlas.pack(carry_it_out(chosen, order.illuminant, progress))
    stored = atlas.unpack(image, layout)
    sample_set = None if order.model == "patch" else lobes.make_lobes(chosen.ensemble, chosen.sigma_b)
    baked = time.perf_counter()
    errors = check_it(reliefs, chosen, stored, progress)
    transforms = sum(len(series.amplitude) for series in chosen.ensemble)
    return Made(
        stored, sample_set, image, layout, errors, len(chosen.wavelengths), transforms, baked - started,
        time.perf_counter() - baked,
    )  # fmt: skip


def _with_time_of(made: Made, earlier: Made) -> Made:
    seconds, check_seconds = made.seconds + earlier.seconds, made.check_seconds + earlier.check_seconds
    return replace(made, seconds=seconds, check_seconds=check_seconds)


def bake_to_folder(height_maps: Sequence[HeightMap], order: Order, folder: Path, progress: Progress) -> dict:
    """Bake height maps into a folder, the table's file and the sample set's; the facts of the run, as `--json` gives
    them, the table's file first."""
    reliefs = [prepare(height_map) for height_map in height_maps]
    made = make(reliefs, order, progress, ", ".join(height_map.source for height_map in height_maps))
    provenance = provenance_of(height_maps, reliefs, order, made)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{bake_name(height_maps)}.exr"
    pictures = {path: (made.image, made.layout)}
    if made.sample_set is not None:
        pictures[lobes.path_beside(path)] = lobes.pack(made.sample_set)
    atlas.write_together(pictures, provenance)
    return {
        "seconds": made.seconds,
        "check_seconds": made.check_seconds,
        "peak_bytes": peak_bytes(),
        "blender_bytes": made.blender_bytes,
        "tiles": made.layout.terms,
        "resolution": max(made.bake.tile),
        "tile": list(made.bake.tile),
        "wavelengths": made.wavelengths,
        "transforms": made.transforms,
        "precision": str(made.image.dtype),
        "coherence_um": provenance["coherence_um"],
        "delta_e": provenance["delta_e"],
        "files": [str(file) for file in pictures],
    }


def provenance_of(height_maps: Sequence[HeightMap], reliefs: Sequence[Relief], order: Order, made: Made) -> dict:
    """What the header says of a bake's making; of several scans in the order given."""
    length_m = coherence.coherence_length(made.bake.sigma_b)
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
        "model": order.model,
        "coherence_um": length_m * 1e6,
        "coherence_areas": coherence.coherence_areas((area, 1.0), length_m, profiles),
        "precision": str(made.image.dtype),
        "asked_delta_e": order.delta_e,
        "needs": order.needs.as_dict(),
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

# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a bake that keeps the requested colour error, in memory (make) or in a folder (bake_to_folder).

By one of two coherence models, the bake is planned and made, and the error of its file's contents is measured. If the
error is too large, the bake is made once more for a smaller error. The files in a folder have the bake's provenance in
their headers, and appear complete or not at all (base/files.py)."""

import hashlib
import math
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ..base.exr_reader import TEXELS_MAX
from ..base.failure import GratingError, Setting
from ..base.progress import Progress, forwards, silent, span_of
from ..colour.channels import channel_count
from ..measure.errors import RELATIVE_DY, Errors
from ..measure.shown_colours import is_shown
from ..optics import coherence
from ..surface.height_map import HeightMap
from ..surface.quality import replaced_width
from ..surface.relief import Relief, relief_of
from ..surface.steps.pipeline import WARNING, level
from ..table import atlas, sample_set
from ..table.atlas import AnyLayout, check_can_write, write_together
from ..table.blur_levels import BYTES_PER_TEXEL
from ..table.sample_set import SampleSet, path_beside
from ..table.table import Table
from . import ensemble, patch
from .levels_and_basis import adds_little, comparison, with_learnt_basis, with_levels
from .plan import Plan, blender_bytes, extent
from .request import BakeRequest
from .self_check import Judge, Wide, shown_colours, wide_errors


class CoherenceModel(Protocol):
    """A coherence model: plans the resolution of a bake, makes the bake, and measures its error."""

    def plan(self, reliefs: Sequence[Relief], request: BakeRequest, *, progress: Progress = ...) -> Plan:
        """Choose the resolution that a table needs to keep the request's colour error.

        Raises GratingError for a request that the model cannot keep."""
        ...

    def carry_out(self, chosen: Plan, illuminant: str, progress: Progress) -> Table:
        """Make the table of a plan, without wider blur levels."""
        ...

    def judge(self, reliefs: Sequence[Relief], chosen: Plan, illuminant: str, *, progress: Progress) -> Judge:
        """What a plan's table is judged by: the reliefs' exact spectra."""
        ...

    def sample_set(self, chosen: Plan) -> SampleSet | None:
        """Make the sample set that belongs to the table, for lights of every kind; None if the model has none."""
        ...


# The models by their names in a request (MODELS in request.py).
COHERENCE_MODELS: dict[str, CoherenceModel] = {"ensemble": ensemble, "patch": patch}


# No larger picture is read.
ATLAS_BYTES_MAX = BYTES_PER_TEXEL * TEXELS_MAX
# The shares of the reported time, which ends with the self-check's sums, after which an attempt's plan, and its table,
# are done: measured on the samples Elaphe and Xenopeltis, 0.10 and 0.11, 0.64 and 0.70.
_PLANNED, _CARRIED_OUT = 0.1, 0.7
# The same if directions are spread, which on the scan of Elaphe takes half of the bake.
_SPREAD, _CARRIED_OUT_SPREAD = 0.7, 0.85
# The second attempt aims at an error smaller by this factor than the error that would be just enough.
_MARGIN = 2.0
# The share of the requested error that a table in a learnt basis of w may reach. The rest is for the file's rounding.
_BEFORE_ROUNDING = 0.9
# The error of a table read by B-splines grows as this power of its texels. What is asked below a dE00 of 1 binds the
# first level alone: if memory is short, the wider levels have texels for a dE00 of 1, and are closer to each other.
_ORDER_OF_TEXELS = 4
# The share of the progress for the first attempt. A second attempt is the exception, so it gets the rest.
_FIRST = 0.9


@dataclass(frozen=True)
class Made:
    """A bake as in its file, and the cost of making it.

    table          the table, rounded as in the file
    sample_set     the sample set beside it; None under the patch model
    image, layout  the atlas: the table packed into one picture
    errors         the measured errors of `table` under its own kernel, which the request limits
    lamps          the measured errors of its colours under lamps of other spectra, by lamp
    wide           the measured errors under wider kernels, of large lamps and rough surfaces: a level's or between two
    wavelengths    the number of wavelengths
    transforms     the number of Fourier transforms of the relief
    seconds        the time of planning and baking, the choice of the functions of w included
    check_seconds  the time of measuring the errors"""

    table: Table
    sample_set: SampleSet | None
    image: np.ndarray
    layout: atlas.Layout
    errors: Errors
    lamps: dict[str, Errors]
    wide: tuple[Wide, ...]
    wavelengths: int
    transforms: int
    seconds: float
    check_seconds: float

    @property
    def blender_bytes(self) -> int:
        """Bytes that the atlas takes in Blender."""
        return BYTES_PER_TEXEL * self.layout.width * self.layout.height

    @property
    def delta_e(self) -> dict[str, Any]:
        """The errors for JSON: those of `errors`; the worst under a wider kernel, with its place between the levels;
        the claim, the dE00 that the 99th percentile keeps under every kernel; and under each lamp the mean, the 95th
        percentile, and the dE00 that this percentile keeps at other directions."""
        wide = {}
        if self.wide:
            worst = max(self.wide, key=lambda each: each.errors.p99_most)
            errors = worst.errors.as_dict()
            wide = {"wide_p99": errors["p99"], "wide_p99_most": errors["p99_most"], "wide_level": worst.level}
        claim = max([self.errors.claim, *(each.errors.p99_most for each in self.wide)])
        lamps = {lamp: [round(each.mean, 2), round(each.p95, 2)] for lamp, each in self.lamps.items()}
        claims = {lamp: math.ceil(100 * each.p95_claim) / 100 for lamp, each in self.lamps.items()}
        told = {**wide, "claim": claim if math.isfinite(claim) else None}
        return {**self.errors.as_dict(), **told, **({"lamps": lamps, "lamps_claim": claims} if lamps else {})}


def make(
    reliefs: Sequence[Relief], request: BakeRequest, *, progress: Progress = silent, source: str = "the scan"
) -> Made:
    """Bake reliefs for a request. `progress` is called with the share of the whole bake.

    Raises GratingError, with `source` and an error that can be kept, if the requested colour error cannot."""
    progress = forwards(progress)
    made = _attempt(reliefs, request, span_of(progress, 0, _FIRST), source)
    excess = made.errors.over(request.delta_e)
    if excess > 1:
        # A smaller error only changes terms, texels, wavelengths and transforms. Other errors stay and are measured.
        stricter = replace(request, delta_e=request.delta_e / (_MARGIN * excess))
        again = _attempt(reliefs, stricter, span_of(progress, _FIRST, 1), source)
        again = _with_time_of(again, made)
        made = again if again.errors.over(request.delta_e) < excess else made
    if made.errors.over(request.delta_e) > 1:
        errors, reached = made.errors, _reached(made.errors)
        raise GratingError(
            source,
            f"the bake reaches a dE00 of {errors.p99:.2f} (99th percentile; up to "
            f"{errors.p99_allowance:.2f} more on other directions) and {errors.relative_dy:.1%} of the light, not the "
            f"asked {request.delta_e:g}",
            ("ask for ", Setting.DELTA_E, f" {math.ceil(reached * 10.5) / 10:g} or a shorter ", Setting.COHERENCE_UM),
        )
    return made


def _reached(errors: Errors) -> float:
    """The least dE00 that the errors keep."""
    return max(errors.p99_most, errors.relative_dy / RELATIVE_DY)


def _attempt(reliefs: Sequence[Relief], request: BakeRequest, progress: Progress, source: str) -> Made:
    """Plan and make one bake of the reliefs for a request, and measure its errors."""
    started = time.perf_counter()
    model = COHERENCE_MODELS[request.model]
    planned, carried_out = (_PLANNED, _CARRIED_OUT) if request.spread_deg is None else (_SPREAD, _CARRIED_OUT_SPREAD)
    if not request.needs.is_reached:
        raise GratingError(
            source, "no directions of light and view have the u, v and w of its needs", "widen their ranges"
        )
    try:
        chosen = model.plan(reliefs, request, progress=span_of(progress, 0, planned))
    except GratingError as error:
        raise error.within(source) from error
    rows, columns = map(len, chosen.axes)
    triples = channel_count(request.illuminant) // 3
    in_blender = blender_bytes(chosen.terms, (rows, columns), chosen.sigma_b, triples=triples)
    if in_blender > ATLAS_BYTES_MAX:
        raise GratingError(
            source,
            f"the table would take {in_blender / 2**20:.0f} MiB in Blender",
            ("ask for a shorter ", Setting.COHERENCE_UM, ", or for a part of it by ", Setting.NEEDS),
        )
    table = model.carry_out(chosen, request.illuminant, span_of(progress, planned, carried_out))
    sample_set = model.sample_set(chosen)
    baked = time.perf_counter()
    judge = model.judge(reliefs, chosen, request.illuminant, progress=span_of(progress, carried_out, 1))
    judged = time.perf_counter()
    added_by = comparison(table, request.illuminant)

    def keeps(fewer: Table) -> bool:
        is_small = adds_little(*added_by(fewer), request.delta_e)
        return is_small and judge.errors_of(fewer).over(request.delta_e) <= _BEFORE_ROUNDING

    coarser = max(1.0, request.delta_e ** (-1 / _ORDER_OF_TEXELS))
    image, layout = atlas.pack(with_levels(with_learnt_basis(table, keeps), coarser=coarser))
    stored = atlas.unpack(image, layout)
    packed = time.perf_counter()
    errors = judge.errors_of(stored)
    wide = wide_errors(stored, table, errors, illuminant=request.illuminant)
    transforms = sum(len(series.amplitude) for series in chosen.ensemble)
    return Made(
        stored, sample_set, image, layout, errors, judge.errors_under_lamps(stored), wide,
        len(chosen.wavelengths), transforms,
        seconds=baked - started + packed - judged, check_seconds=judged - baked + time.perf_counter() - packed,
    )  # fmt: skip


def _with_time_of(made: Made, earlier: Made) -> Made:
    """The second attempt, with the first attempt's times added."""
    seconds, check_seconds = made.seconds + earlier.seconds, made.check_seconds + earlier.check_seconds
    return replace(made, seconds=seconds, check_seconds=check_seconds)


# The share of a bake's time that levelling takes, about.
_LEVELLED = 0.01
# The stage that levels the scans, and may refuse one.
LEVELLING = "levelling"
# The figures that bake_to_folder reports, and the figures in `delta_e`.
_FIGURES = ("seconds", "check_seconds", "blender_bytes", "tiles", "resolution", "coherence_um", "largest_albedo")
_ERRORS = ("mean", "p95", "p99", "max", "pairs")


def bake_to_folder(
    height_maps: Sequence[HeightMap], request: BakeRequest, folder: Path, *, progress: Progress = silent
) -> dict[str, Any]:
    """Bake height maps into a folder: the table's file and the sample set's file.

    Returns the run's facts, as for `--json`; the table's file comes first in `files`. Raises GratingError as
    `check_can_write`, `make` and `write_together` do.

    >>> request = BakeRequest(delta_e=2, coherence_length_m=4e-6)
    >>> facts = bake_to_folder([read_height_map("sample:blazed")], request, Path("bakes"))
    >>> [Path(file).name for file in facts["files"]], facts["delta_e"]["p99"] < 2
    (['blazed.exr', 'blazed.lobes.exr'], True)"""
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
    """A warning if a bake's coherence length is shorter than the requested one (plan.py)."""
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

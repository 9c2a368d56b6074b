# SPDX-License-Identifier: GPL-3.0-or-later
"""What the benchmark measures: how much effort, and on which surfaces."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

from ...surface.height_map import HeightMap
from ...surface.readers.registry import read_height_map
from ...surface.relief import Relief, prepare
from ...surface.samples.gratings import blazed
from .. import evaluation

# Beside the project's root, where a checkout has it.
SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"


@dataclass(frozen=True)
class Effort:
    """How much of a run: the pieces' size and coherence in metres, what is judged and swept, the synthetic scans."""

    piece_m: float
    w_count: int
    pairs: int
    patch_pairs: int
    delta_es: tuple[float, ...]
    steps_nm: tuple[float, ...]
    sweeps: bool
    map_pixels: int
    map_w: int
    map_pairs: int
    reference_nm: float
    naive_transforms: int
    seconds_timed: float
    sizes: tuple[int, ...]
    scan_m: float | None = None
    scan_bakes: int = 2
    coherence_m: float = 15e-6


FULL = Effort(
    32e-6, 4, 800, 200, (3, 1, 0.3, 0.1), (2, 5, 10, 20), True, 512, 2, 150, 1, 8, 0.2, (512, 1024, 2048, 4096, 8192)
)


QUICK = Effort(8e-6, 2, 300, 60, (3, 0.3), (5, 20), False, 128, 1, 60, 5, 3, 0.05, (256, 512), 12e-6, 1, 6e-6)


@dataclass(frozen=True)
class Surface:
    """A piece for the ensemble model and a smaller one, as long as its coherence, for the patch model; `period_m` of
    the order whose angle is looked at, which lies along T."""

    name: str
    whole: Relief
    patch: Relief
    period_m: float


def surfaces(effort: Effort, scan: HeightMap) -> list[Surface]:
    """The blaze, the scan, and the Xenopeltis-like sample turned so that its strong period lies along T."""
    fingers = evaluation.turned(read_height_map("sample:xenopeltis"), 90)
    found = [
        Surface(
            "blaze", prepare(_blaze(effort.piece_m)), prepare(_blaze(effort.coherence_m)), 2.5e-6
        )
    ]  # fmt: skip
    for name, heights, period_m in (("elaphe", scan, 1144e-9), ("xenopeltis", fingers, 1552e-9)):
        whole, patch = (prepare(middle(heights, length)) for length in (effort.piece_m, effort.coherence_m))
        found.append(Surface(name, whole, patch, period_m))
    return found


def _blaze(length_m: float) -> HeightMap:
    periods = max(1, int(length_m / 2.5e-6))
    return blazed(periods=periods, rows=32 * periods)


def middle(height_map: HeightMap, length_m: float) -> HeightMap:
    """The middle length_m x length_m of a height map."""
    part = []
    for count, pixel in zip(height_map.height_m.shape, height_map.pixel_size_m, strict=True):
        kept = min(count, round(length_m / pixel))
        part.append(slice((count - kept) // 2, (count - kept) // 2 + kept))
    return replace(height_map, height_m=height_map.height_m[tuple(part)], periodic=False)


def elaphe_scan(shared: Path) -> HeightMap:
    """The scan of Elaphe where it is, else the sample like it."""
    path = shared / "snake" / "elaphe_65um.png"
    return read_height_map(str(path), 65, 375) if path.is_file() else read_height_map("sample:elaphe")


def as_file(height_map: HeightMap, folder: Path) -> list[str]:
    """Write a height map as a grey picture of 16 bits; how the command line names it."""
    low, span = height_map.height_m.min(), np.ptp(height_map.height_m)
    path = folder / "piece.png"
    Image.fromarray(np.rint((height_map.height_m - low) / span * 65535).astype(np.uint16)).save(path)
    width_m = height_map.height_m.shape[1] * height_map.pixel_size_m[1]
    return [str(path), "--size-um", repr(float(width_m * 1e6)), "--height-nm", repr(float(span * 1e9))]

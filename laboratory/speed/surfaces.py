# SPDX-License-Identifier: GPL-3.0-or-later
"""What the benchmark measures: how much effort, and on which surfaces."""

from dataclasses import dataclass, replace
from pathlib import Path

from precompute.surface.height_map import HeightMap
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import Relief, prepare
from precompute.surface.samples.ruled_gratings import blazed

from ..study import evaluation

# Beside the folder of the project.
SHARED = Path(__file__).resolve().parents[3] / "shared" / "data"
# Height in nanometres from black to white of the scans, which are 65 um wide.
SKINS = {"elaphe": 375, "xenopeltis": 818.69}


@dataclass(frozen=True)
class Effort:
    """How much a run does.

    piece_m           side of the pieces that methods of the ensemble model see
    w_count           values of w at which colours are compared
    pairs             direction pairs at each w, for the ensemble model
    patch_pairs       the same for the patch model
    delta_es          colour differences that bakes are asked to keep
    steps_nm          wavelength steps that are tried
    sweeps            whether single settings of a method are varied as well
    reference_nm      wavelength step of the references
    seconds_timed     the least that a method is timed for
    coherence_m       coherence length
    """

    piece_m: float
    w_count: int
    pairs: int
    patch_pairs: int
    delta_es: tuple[float, ...]
    steps_nm: tuple[float, ...]
    sweeps: bool
    reference_nm: float
    seconds_timed: float
    coherence_m: float = 15e-6


FULL = Effort(
    piece_m=32e-6, w_count=4, pairs=800, patch_pairs=200, delta_es=(3, 1, 0.3, 0.1), steps_nm=(2, 5, 10, 20),
    sweeps=True, reference_nm=1, seconds_timed=0.2,
)  # fmt: skip
QUICK = Effort(
    piece_m=8e-6, w_count=2, pairs=300, patch_pairs=60, delta_es=(3, 0.3), steps_nm=(5, 20), sweeps=False,
    reference_nm=5, seconds_timed=0.05, coherence_m=6e-6,
)  # fmt: skip


@dataclass(frozen=True)
class Surface:
    """What methods are tried on: `whole` for the ensemble model, and `patch` for the patch model, a smaller piece that
    is as long as the coherence. The first order of the period `period_m` along T is looked at."""

    name: str
    whole: Relief
    patch: Relief
    period_m: float


def surfaces(effort: Effort, elaphe: HeightMap, xenopeltis: HeightMap) -> list[Surface]:
    """The blaze, Elaphe, and Xenopeltis turned so that the period along its fingers lies along T."""
    fingers = evaluation.turned(xenopeltis, 90)
    found = [
        Surface(
            "blaze", prepare(_blaze(effort.piece_m)), prepare(_blaze(effort.coherence_m)), 2.5e-6
        )
    ]  # fmt: skip
    for name, heights, period_m in (("elaphe", elaphe, 1144e-9), ("xenopeltis", fingers, 1552e-9)):
        whole, patch = (prepare(middle(heights, length)) for length in (effort.piece_m, effort.coherence_m))
        found.append(Surface(name, whole, patch, period_m))
    return found


def _blaze(length_m: float) -> HeightMap:
    periods = max(1, int(length_m / 2.5e-6))
    return blazed(periods=periods, rows=32 * periods)


def middle(height_map: HeightMap, length_m: float) -> HeightMap:
    """The middle length_m x length_m of a height map, or as much of it as there is."""
    part = []
    for count, pixel in zip(height_map.height_m.shape, height_map.pixel_size_m, strict=True):
        kept = min(count, round(length_m / pixel))
        part.append(slice((count - kept) // 2, (count - kept) // 2 + kept))
    return replace(height_map, height_m=height_map.height_m[tuple(part)], periodic=False)


def skin(shared: Path, name: str) -> HeightMap:
    """The scan of a skin, one of SKINS, if the folder has it; else the sample that resembles it."""
    path = shared / "snake" / f"{name}_65um.png"
    return read_height_map(str(path), 65, SKINS[name]) if path.is_file() else read_height_map(f"sample:{name}")

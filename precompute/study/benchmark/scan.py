# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake of a scan and a map beside what they replace: exact transforms, and FLSS."""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ...bake.ensemble import plan
from ...base.failure import GratingError
from ...colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, spectral_weights, wavelengths
from ...measure.errors import measure
from ...methods.baked import Baked
from ...methods.method import Settings
from ...methods.registry import METHODS
from ...optics import coherence
from ...spectra.resample import KERNEL_REACH, Resampler
from ...spectra.spectrum import frequency_grid, scattered_spectrum
from ...surface.height_map import HeightMap
from ...surface.relief import Relief, prepare
from ...table import atlas_file
from .. import brdf_map
from .candidates import FLSS_TERMS, seconds_for
from .references import ensemble_truths, patch_truths
from .surfaces import Effort, as_file

Tick = Callable[[str, float], None]


# A bake beside what it replaces


def transform_seconds(shape: tuple[int, int], repeats: int = 5) -> float:
    """The fastest of some complex double-precision transforms of a size."""
    field = np.random.default_rng(0).standard_normal(shape) + 0j
    return min(seconds_for(np.fft.fft2, field) for _ in range(repeats))


def bake_in_child(scan: list[str], folder: Path, delta_e: float = 1.0) -> dict:
    """The facts of `bake --no-cache` in a process of its own: its peak of memory is nobody else's."""
    command = ["bake", *scan, "--delta-e", f"{delta_e:g}", "--no-cache", "-o", str(folder), "--json", "-"]
    return _child("precompute", [*command, "--progress", "none"])


def scan_in_child(pixels: int) -> dict:
    """benchmark_scan's figures in a process of its own."""
    return _child("precompute.benchmark_scan", [str(pixels)])


def _child(module: str, arguments: list[str]) -> dict:
    root = Path(__file__).resolve().parents[1]
    done = subprocess.run(
        [sys.executable, "-m", module, *arguments], cwd=root, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        said = (done.stderr.strip().splitlines() or ["no word of why"])[-1]
        raise GratingError(f"{module}: a child process failed: {said}")
    return json.loads(done.stdout)


def naive_seconds(relief: Relief, chosen, transforms: int) -> tuple[float, int]:
    """Seconds that one exact transform for every wavelength and tile would take, and how many there are: a few are
    timed, evenly over the wavelengths, and scaled up."""
    v, u = chosen.axes
    reach = KERNEL_REACH * chosen.sigma_b
    grid = frequency_grid(relief, (2 + reach) / WAVELENGTH_MIN_M, chosen.sigma_b / WAVELENGTH_MAX_M)
    weights = spectral_weights(chosen.wavelengths)
    table = np.zeros((len(v), len(u), 3))
    lambdas = np.linspace(0, len(chosen.wavelengths) - 1, transforms).astype(int)
    started = time.perf_counter()
    for k in lambdas:
        lam = chosen.wavelengths[k]
        power, _ = scattered_spectrum(relief, 1 / lam, grid)
        resample = Resampler(grid, u, v, lam, chosen.sigma_b, 2 + 3 * chosen.texel)
        table += resample(power[resample.kept])[..., None] * weights[k]
    each = (time.perf_counter() - started) / transforms
    total = len(chosen.wavelengths) * chosen.terms
    return each * total, total


def scan_facts(scan: HeightMap, effort: Effort, tick: Tick) -> tuple[dict, Baked]:
    """Figures of the scan's bake as ratios to transforms of its size, and the bake."""
    relief = prepare(scan)
    transform = transform_seconds(relief.height_m.shape)
    with tempfile.TemporaryDirectory() as folder:
        named, runs = as_file(scan, Path(folder)), []
        for k in range(effort.scan_bakes):
            runs.append(bake_in_child(named, Path(folder)))
            tick("bake of the scan", (k + 1) / (effort.scan_bakes + 1))
        table, _ = atlas_file.read(Path(runs[0]["files"][0]))
    transform = min(transform, transform_seconds(relief.height_m.shape))
    best = min(runs, key=lambda facts: facts["seconds"])
    naive, transforms = naive_seconds(relief, plan(relief), effort.naive_transforms)
    tick("bake of the scan", 1)
    facts = {
        "pixels": list(relief.height_m.shape),
        "transform_seconds": transform,
        "bake_seconds": best["seconds"],
        "check_seconds": min(facts["check_seconds"] for facts in runs),
        "bake_to_24_transforms": best["seconds"] / (24 * transform),
        "naive_seconds": naive,
        "naive_transforms": transforms,
        "naive_timed": effort.naive_transforms,
        "naive_to_bake": naive / best["seconds"],
        "peak_bytes": best["peak_bytes"],
        "table_bytes": best["blender_bytes"],
        "tiles": best["tiles"],
        "tile": best["tile"],
        "wavelengths": best["wavelengths"],
        "coherence_um": best["coherence_um"],
        "delta_e": best["delta_e"],
    }
    return facts, Baked(table, Settings())


def map_facts(relief: Relief, baked: Baked, effort: Effort, tick: Tick) -> dict:
    """A map by the bake beside the same by FLSS, in Stam's form both, and the dE00 of both, each by its own model's
    reference."""
    size, theta_i = effort.map_pixels, np.radians(30)

    def from_bake() -> np.ndarray:
        return brdf_map.from_bake(baked.table, size, theta_i, conserving=False)

    settings = Settings(terms=FLSS_TERMS, step_m=5e-9, texels=3)
    started = time.perf_counter()
    flss = METHODS["flss"](relief, settings)
    prepared = time.perf_counter() - started
    seconds = min(seconds_for(from_bake) for _ in range(7))
    flss_seconds = seconds_for(brdf_map.from_method, flss, size, theta_i)
    seconds = min(seconds, *(seconds_for(from_bake) for _ in range(7)))
    tick("maps", 0.3)
    sigma_b = baked.table.sigma_b
    step_m = effort.reference_nm * 1e-9
    truths = ensemble_truths(relief, sigma_b, effort.map_w, effort.map_pairs, wavelengths(step_m))
    of_bake = measure(truths, lambda u, v, w: (baked.table.scattered_over_w2(u, v, w), np.zeros(3)))
    tick("maps", 0.6)
    length_m = settings.patch_sigma_m * 4
    truths = patch_truths(
        relief, coherence.kernel_sigma(length_m), length_m, effort.map_w, effort.map_pairs, step_m
    )  # fmt: skip
    of_flss = measure(truths, lambda u, v, w: (flss.xyz(u, v, np.full(len(u), w)) / w**2, np.zeros(3)))
    tick("maps", 1)
    return {
        "pixels": size,
        "bake_seconds": seconds,
        "flss_seconds": flss_seconds,
        "flss_preparation_seconds": prepared,
        "flss_to_bake": flss_seconds / seconds,
        "reference_step_nm": effort.reference_nm,
        "bake": of_bake.as_dict(),
        "flss": of_flss.as_dict(),
    }

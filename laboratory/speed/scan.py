# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake of a scan beside exact transforms, and a map by the bake beside the same map by FLSS."""

import json
import os
import sys
import tempfile
import time
from dataclasses import fields
from pathlib import Path

import numpy as np

from precompute.bake.ensemble import plan
from precompute.bake.plan import Plan
from precompute.base.child_process import PYTHON_FLAGS, ChildProcess, lines_of
from precompute.base.failure import GratingError
from precompute.base.progress import Progress
from precompute.colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, spectral_weights, wavelengths
from precompute.maps import brdf_map
from precompute.measure.errors import Errors, measure
from precompute.methods.baked import Baked
from precompute.methods.flss import THESIS_TERMS
from precompute.methods.method import Settings
from precompute.methods.method_registry import METHODS
from precompute.spectra.series import KERNEL_REACH, Resampler
from precompute.spectra.spectrum import frequency_grid, scattered_spectrum
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import Relief, prepare
from precompute.table import atlas

from .candidates import seconds_for
from .references import ensemble_truths, exact_series, patch_truths
from .result import MapResult, ScanResult, SizeResult
from .surfaces import Effort, as_file

_PROJECT = Path(__file__).resolve().parents[2]
_MAP_REPEATS = 7
# The largest scan that is measured, 8192 x 8192 pixels, is baked and checked in 142 s on two cores.
_LONGEST_SECONDS = 24 * 3600


def transform_seconds(shape: tuple[int, int], repeats: int = 5) -> float:
    """Seconds of a complex double-precision transform of a shape, the fastest of some."""
    field = np.random.default_rng(0).standard_normal(shape) + 0j
    return min(seconds_for(np.fft.fft2, field) for _ in range(repeats))


def bake_in_child(scan: list[str], folder: Path, delta_e: float = 1.0) -> dict:
    """The JSON of `bake --no-cache`, run in a process of its own, so that the peak of memory is the bake's."""
    command = ["bake", *scan, "--delta-e", f"{delta_e:g}", "--no-cache", "-o", str(folder), "--json", "-"]
    return _child("precompute", [*command, "--progress", "none"])


def scan_in_child(pixels: int) -> SizeResult:
    """The bake of a synthetic scan, in a process of its own."""
    return SizeResult(**_child("laboratory.speed.synthetic_scan", [str(pixels)]))


def _child(module: str, arguments: list[str]) -> dict:
    """The JSON that a module prints, run in a process that ends with this one.

    Raises GratingError with the process's last line if it fails."""
    command = [sys.executable, *PYTHON_FLAGS, "-m", module, *arguments]
    path = os.pathsep.join(filter(None, (str(_PROJECT), *sys.path)))
    child = ChildProcess(lambda _: command, os.environ | {"PYTHONPATH": path}, longest_seconds=_LONGEST_SECONDS)
    try:
        child.wait()
        if child.is_late:
            raise GratingError(module, f"not over after {_LONGEST_SECONDS // 3600} h", "measure a smaller scan")
        if child.status != 0:
            said = (lines_of(child.err_path) or ["no word of why"])[-1]
            raise GratingError(module, f"a child process failed: {said}", "")
        return json.loads(child.out_path.read_text(encoding="utf-8"))
    finally:
        child.clean_up()


def naive_seconds(relief: Relief, chosen: Plan, transforms: int) -> tuple[float, int]:
    """Seconds that one exact transform for every wavelength and tile would take, and how many transforms those are.

    Only `transforms` of them are timed, evenly over the wavelengths, and the time is scaled up."""
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
        resample = Resampler(grid, u, v, lam, grid.kernel_left(chosen.sigma_b, lam), 2 + 3 * chosen.texel)
        table += resample(power[resample.kept])[..., None] * weights[k]
    each = (time.perf_counter() - started) / transforms
    total = len(chosen.wavelengths) * chosen.terms
    return each * total, total


def scan_result(scan: HeightMap, effort: Effort, progress: Progress) -> tuple[ScanResult, Baked]:
    """The scan's bake beside transforms of its size, and the bake itself."""
    relief = prepare(scan)
    transform = transform_seconds(relief.height_m.shape)
    with tempfile.TemporaryDirectory() as folder:
        named, runs = as_file(scan, Path(folder)), []
        for k in range(effort.scan_bakes):
            runs.append(bake_in_child(named, Path(folder)))
            progress("bake of the scan", (k + 1) / (effort.scan_bakes + 1))
        table, _ = atlas.read(Path(runs[0]["files"][0]))
    transform = min(transform, transform_seconds(relief.height_m.shape))
    best = min(runs, key=lambda facts: facts["seconds"])
    naive, transforms = naive_seconds(relief, plan(relief), effort.naive_transforms)
    progress("bake of the scan", 1)
    result = ScanResult(
        pixels=list(relief.height_m.shape),
        transform_seconds=transform,
        bake_seconds=best["seconds"],
        check_seconds=min(facts["check_seconds"] for facts in runs),
        bake_to_24_transforms=best["seconds"] / (24 * transform),
        naive_seconds=naive,
        naive_transforms=transforms,
        naive_timed=effort.naive_transforms,
        naive_to_bake=naive / best["seconds"],
        peak_bytes=best["peak_bytes"],
        table_bytes=best["blender_bytes"],
        tiles=best["tiles"],
        tile=best["tile"],
        wavelengths=best["wavelengths"],
        coherence_um=best["coherence_um"],
        delta_e=Errors(**{field.name: best["delta_e"][field.name] for field in fields(Errors)}),
    )
    return result, Baked(table, Settings())


def map_result(relief: Relief, baked: Baked, effort: Effort, *, progress: Progress) -> MapResult:
    """A map by the bake beside the same map by FLSS, both in Stam's form. The errors are those against the reference of
    each one's model of coherence."""
    size, wi = effort.map_pixels, brdf_map.light_from(np.radians(30))

    def from_bake() -> np.ndarray:
        return brdf_map.from_bake(baked.table, size, wi, stam=True)

    settings = Settings(terms=THESIS_TERMS, step_m=5e-9, texels=3)
    started = time.perf_counter()
    flss = METHODS["flss"](relief, settings)
    prepared = time.perf_counter() - started
    seconds = min(seconds_for(from_bake) for _ in range(_MAP_REPEATS))
    flss_seconds = seconds_for(brdf_map.from_method, flss, size, wi)
    seconds = min(seconds, *(seconds_for(from_bake) for _ in range(_MAP_REPEATS)))
    progress("maps", 0.3)
    sigma_b = baked.table.sigma_b
    step_m = effort.reference_nm * 1e-9
    truths = ensemble_truths(
        exact_series(relief, sigma_b), sigma_b, effort.map_w, pairs=effort.map_pairs, lambdas=wavelengths(step_m)
    )
    of_bake = measure(truths, lambda u, v, w: (baked.table.scattered_over_w2(u, v, w), np.zeros(3)))
    progress("maps", 0.6)
    length_m = settings.patch_sigma_m * 4
    truths = patch_truths(relief, length_m, effort.map_w, pairs=effort.map_pairs, step_m=step_m)
    of_flss = measure(truths, lambda u, v, w: (flss.xyz(u, v, np.full(len(u), w)) / w**2, np.zeros(3)))
    progress("maps", 1)
    return MapResult(
        pixels=size,
        bake_seconds=seconds,
        flss_seconds=flss_seconds,
        flss_preparation_seconds=prepared,
        flss_to_bake=flss_seconds / seconds,
        reference_step_nm=effort.reference_nm,
        bake=of_bake,
        flss=of_flss,
    )

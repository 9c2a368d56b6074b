# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed against error: every method of the core on the same surfaces, in one run, so that ratios mean something.

A method is judged by precompute.metric against the reference of its own model of coherence, away from the zero order
(which a patch's tails and an ensemble's kernel draw differently), and timed on directions of which no two share a w.
"""

import json
import math
import os
import platform
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np
from PIL import Image

from . import atlas, brdf_map, coherence, evaluation, metric
from .bake import BYTES_PER_TEXEL, carry_out, plan
from .baking import Order, make
from .colour import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, spectral_weights
from .failure import GratingError
from .height_map import HeightMap
from .methods import METHODS, Method, Settings
from .methods.baked import Baked
from .readers import read_height_map
from .reference import blurred, reference_grid, wavelengths
from .relief import Relief, prepare
from .resample import KERNEL_REACH, Resampler
from .samples import blazed
from .series import spectrum_series
from .spectrum import frequency_grid, scattered_spectrum

THETA_I = np.radians(75)
# Pairs nearer to the zero order than this many sigma_b are left to the zero order's own figure.
ZERO_ORDER_REACH = 8.0
FLSS_TERMS = 37
# Interpolation of the ensemble reference's spectra in s, as evaluation's; a test holds it against the direct sums.
_EXACT = 1e-10
_WHOLE = (slice(None), slice(None))
# The fastest of so many more is what a machine that others use can do.
_REPEATS = 3

# Beside the project's root, where a checkout has it.
SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"

Tick = Callable[[str, float], None]


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


@dataclass(frozen=True)
class Candidate:
    """A method to try: its name in METHODS, what differs from others of its name, how it is built and of what size."""

    method: str
    label: str
    settings: Settings = field(default_factory=Settings)
    delta_e: float | None = None
    terms: int | None = None
    finer: float = 1.0

    @property
    def model(self) -> str:
        """Of coherence."""
        return "ensemble" if self.method in ("reference", "stam", "gem", "bake") else "patch"


@dataclass(frozen=True)
class Row:
    """A line of the table. Preparation and evaluation in seconds, bytes held and at the peak of preparing and judging;
    the angle between the brightest views of method and reference in degrees; colour errors by metric.Errors."""

    surface: str
    method: str
    label: str
    model: str
    seconds_per_million: float
    preparation_seconds: float
    peak_bytes: int
    table_bytes: int
    peak_angle_deg: float
    mean: float
    p95: float
    p99: float
    max: float
    relative_rms: float
    relative_dy: float


@dataclass(frozen=True)
class Refusal:
    """A candidate that a surface cannot have, and why."""

    surface: str
    method: str
    label: str
    reason: str


def pareto(points: Sequence[tuple[float, float]]) -> list[int]:
    """Indices, cheapest first, of the points (cost, error) that no other beats in both."""
    front, least = [], math.inf
    for k in sorted(range(len(points)), key=lambda k: points[k]):
        if points[k][1] < least:
            front.append(k)
            least = points[k][1]
    return front


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


# The references


def ensemble_truths(relief: Relief, sigma_b: float, w_count: int, pairs: int, lambdas, series=None):
    """As metric.truths, the spectra interpolated in s to 1e-10: one transform a node, not one a wavelength and w."""
    rng = np.random.default_rng(0)
    series = series or exact_series(relief, sigma_b)
    found = []
    for w in metric.draw_w(w_count, rng):

        def spectrum(s: float):
            return _power(series, s), series.grid

        drawn = metric.draw_pairs(spectrum, sigma_b, w, pairs, rng)
        drawn = away_from_zero_order(drawn, sigma_b)
        found.append(metric.Truth(w, drawn, ensemble_xyz(series, sigma_b, drawn.u, drawn.v, w, lambdas), np.zeros(3)))
    return found


def exact_series(relief: Relief, sigma_b: float):
    """The spectrum of a relief at every s, to 1e-10."""
    return spectrum_series(relief, reference_grid(relief, sigma_b), 2 / WAVELENGTH_MIN_M, _EXACT)


def ensemble_xyz(series, sigma_b: float, u, v, w: float, lambdas: np.ndarray) -> np.ndarray:
    """Scattered XYZ (n, 3) at one w, from the bins under the kernel."""
    xyz = np.zeros((len(u), 3))
    for lam, weight in zip(lambdas, spectral_weights(lambdas), strict=True):
        xyz += blurred(_power(series, w / lam), series.grid, u, v, lam, sigma_b)[:, None] * weight
    return xyz


def _power(series, s: float) -> np.ndarray:
    return series.mixed(series.weights(np.array([s])) * s**2, _WHOLE)[:, 0]


def patch_truths(relief: Relief, sigma_b: float, length_m: float, w_count: int, pairs: int, step_m: float):
    """metric.Truth by the patch model's direct sums; each w has one phasor a wavelength, so they are few."""
    rng = np.random.default_rng(0)
    grid = reference_grid(relief, sigma_b)
    reference = METHODS["reference-patch"](relief, Settings(coherence_length_m=length_m, step_m=step_m))
    found = []
    for w in metric.draw_w(w_count, rng):
        drawn = metric.draw_pairs(lambda s: (scattered_spectrum(relief, s, grid)[0], grid), sigma_b, w, pairs, rng)
        drawn = away_from_zero_order(drawn, sigma_b)
        found.append(metric.Truth(w, drawn, reference.xyz(drawn.u, drawn.v, w), np.zeros(3)))
    return found


def away_from_zero_order(pairs: metric.Pairs, sigma_b: float) -> metric.Pairs:
    """The pairs that see nothing of the zero order."""
    kept = np.hypot(pairs.u, pairs.v) > ZERO_ORDER_REACH * sigma_b
    return metric.Pairs(pairs.wi[kept], pairs.wr[kept], pairs.drawn[kept])


@dataclass(frozen=True)
class Judge:
    """The references of one surface under one model: pairs and their colours, and the angle of the brightest view."""

    truths: list[metric.Truth]
    plane: evaluation.Plane
    brightest_deg: float
    series: object = None


def judges(surface: Surface, effort: Effort) -> dict[str, Judge]:
    """By model of coherence."""
    sigma_b = coherence.kernel_sigma(effort.coherence_m)
    step_m = effort.reference_nm * 1e-9
    plane = evaluation.first_order_plane(THETA_I, wavelengths(5e-9), surface.period_m)
    settings = Settings(coherence_length_m=effort.coherence_m)
    series = exact_series(surface.whole, sigma_b)
    truths = {
        "ensemble": ensemble_truths(surface.whole, sigma_b, effort.w_count, effort.pairs, wavelengths(step_m), series),
        "patch": patch_truths(surface.patch, sigma_b, effort.coherence_m, effort.w_count, effort.patch_pairs, step_m),
    }
    found, lambdas = {}, wavelengths(2.5e-9)
    for model, name, relief in (
        ("ensemble", "reference", surface.whole), ("patch", "reference-patch", surface.patch),
    ):  # fmt: skip
        density = evaluation.response(METHODS[name](relief, settings), plane, lambdas)
        luminance = density.T @ spectral_weights(lambdas)[:, 1]
        brightest = evaluation.peak(np.degrees(plane.theta_v), luminance)
        found[model] = Judge(truths[model], plane, brightest, series if model == "ensemble" else None)
    return found


# The candidates


def candidates(effort: Effort) -> list[Candidate]:
    """All that is tried on a surface."""
    base = Settings(coherence_length_m=effort.coherence_m)

    def of(method: str, label: str, **changes) -> Candidate:
        return Candidate(method, label, replace(base, **changes))

    found = [Candidate("bake", f"dE {de:g}", base, de) for de in effort.delta_es]
    found += [of("reference", f"{nm:g} nm", step_m=nm * 1e-9) for nm in effort.steps_nm if nm >= 5]
    found += [of("stam", ""), of("gem", "brightness fitted")]
    wide = {"terms": FLSS_TERMS, "step_m": 5e-9}
    found += [of("flss", f"N {FLSS_TERMS}, {nm:g} nm", terms=FLSS_TERMS, step_m=nm * 1e-9) for nm in effort.steps_nm]
    found += [of("chebyshev", f"N auto, {nm:g} nm", step_m=nm * 1e-9) for nm in effort.steps_nm]
    found += [of("flss", f"N {FLSS_TERMS}, 5 nm, float64", dtype=np.float64, **wide)]
    found += [of("chebyshev", "N auto, 5 nm, 7 x 7 texels", texels=7)]
    if effort.sweeps:
        found += [Candidate("bake", f"dE 1, K {k}", base, 1.0, terms=k) for k in (2, 3, 4, 6, 8)]
        found += [Candidate("bake", f"dE 1, texels x {f:g}", base, 1.0, finer=f) for f in (0.6, 1.6)]
        found += [of("flss", f"N {n}, 5 nm", terms=n) for n in (9, 19)]
        found += [of("flss", f"N {FLSS_TERMS}, 5 nm, 7 x 7 texels", texels=7, **wide)]
        found += [of("chebyshev", f"N {n}, 5 nm", terms=n) for n in (5, 9)]
        found += [of("chebyshev", "N auto, 5 nm, float64", dtype=np.float64)]
        found += [of("chebyshev", "N auto, 2 nm, 13 x 13 texels", texels=13, step_m=2e-9)]
    found += [of(method, "5 nm") for method in ("nmm", "nmm-jacobian", "pq", "pq-printed")]
    return found


def build(candidate: Candidate, surface: Surface) -> tuple[Method, int]:
    """The method, and the bytes of what it reads: a bake's as Blender holds it. Raises GratingError as methods do."""
    relief = surface.whole if candidate.model == "ensemble" else surface.patch
    settings = replace(candidate.settings, period_m=surface.period_m)
    if candidate.method == "bake":
        if candidate.terms is None and candidate.finer == 1:
            made = make([relief], Order(candidate.delta_e, settings.coherence_length_m), source=surface.name)
            return Baked(made.bake, settings), made.blender_bytes
        chosen = plan(relief, settings.coherence_length_m, candidate.delta_e, finer=candidate.finer)
        chosen = replace(chosen, terms=candidate.terms or chosen.terms)
        image, layout = atlas.pack(carry_out(chosen))
        return Baked(atlas.unpack(image, layout), settings), layout.width * layout.height * BYTES_PER_TEXEL
    method = METHODS[candidate.method](relief, settings)
    images = getattr(getattr(method, "full", method), "images", None)
    if images is not None:
        return method, images.terms.nbytes
    profile = getattr(method, "profile_m", None)
    return method, relief.height_m.nbytes if candidate.method == "reference" else getattr(profile, "nbytes", 0)


def judge(candidate: Candidate, surface: Surface, judge: Judge, effort: Effort) -> Row:
    """Build, judge and time a candidate. Raises GratingError where the method does."""
    tracemalloc.start()
    try:
        started = time.perf_counter()
        method, table_bytes = build(candidate, surface)
        preparation = time.perf_counter() - started
        errors, brightest = measured(candidate, surface, method, judge)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    return Row(
        surface.name, candidate.method, candidate.label, candidate.model,
        seconds_per_million(candidate, method, effort.seconds_timed), preparation, peak, table_bytes,
        abs(brightest - judge.brightest_deg), errors.mean, errors.p95, errors.p99, errors.max,
        errors.relative_rms, errors.relative_dy,
    )  # fmt: skip


def measured(candidate: Candidate, surface: Surface, method: Method, judge: Judge) -> tuple[metric.Errors, float]:
    """Errors of colour, and the angle of the brightest view in degrees."""
    plane, nothing = judge.plane, np.zeros(len(judge.plane.theta_v))
    if candidate.method == "reference":
        # Its own road takes a transform for every wavelength of every w: the same sums, from the spectra in s.
        lambdas = wavelengths(candidate.settings.step_m)
        sigma_b = method.sigma_b

        def xyz(u, v, w):
            return ensemble_xyz(judge.series, sigma_b, u, v, float(np.ravel(w)[0]), lambdas)

        density = evaluation.response(method, plane, lambdas)
        luminance = density.T @ spectral_weights(lambdas)[:, 1]
    else:
        xyz = method.xyz
        luminance = xyz(plane.u, nothing, plane.w)[:, 1]
    gain = fitted_gain(judge.truths, xyz) if candidate.method == "gem" else 1.0

    def answer(u, v, w):
        return gain * xyz(u, v, np.full(len(u), w)) / w**2, np.zeros(3)

    return metric.measure(judge.truths, answer), evaluation.peak(np.degrees(plane.theta_v), luminance)


def fitted_gain(truths: list[metric.Truth], xyz) -> float:
    """What gives a method without units the reference's total light."""
    found = sum(xyz(t.pairs.u, t.pairs.v, np.full(len(t.pairs.u), t.w))[:, 1].sum() for t in truths)
    return sum(t.scattered_xyz[:, 1].sum() for t in truths) / found


def seconds_per_million(candidate: Candidate, method: Method, least: float) -> float:
    """Seconds for a million directions, each of its own w, as a picture has them."""
    if candidate.method == "reference":
        # Hours: a few directions at a few wavelengths, times the number of wavelengths there are.
        few = replace(method, settings=replace(method.settings, step_m=100e-9))
        share = len(wavelengths(100e-9)) / len(wavelengths(method.settings.step_m))
        return _seconds_for(few.xyz, *_directions(2)) / 2 * 1e6 / share
    count = 256
    while True:
        seconds = _seconds_for(method.xyz, *_directions(count))
        if seconds >= least or count >= 1 << 17:
            again = (_seconds_for(method.xyz, *_directions(count)) for _ in range(_REPEATS))
            return min(seconds, *again) / count * 1e6
        count *= 4


def _seconds_for(call: Callable, *arguments) -> float:
    started = time.perf_counter()
    call(*arguments)
    return time.perf_counter() - started


def _directions(count: int) -> np.ndarray:
    """u, v, w (3, count) of pairs of cosine-weighted directions."""
    rng = np.random.default_rng(1)
    radius, turn = np.sqrt(rng.random((2, count))), rng.uniform(0, 2 * np.pi, (2, count))
    each = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1 - radius**2)])
    return each.sum(axis=1)


# A bake beside what it replaces


def transform_seconds(shape: tuple[int, int], repeats: int = 5) -> float:
    """The fastest of some complex double-precision transforms of a size."""
    field = np.random.default_rng(0).standard_normal(shape) + 0j
    return min(_seconds_for(np.fft.fft2, field) for _ in range(repeats))


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
        table, _ = atlas.read(Path(runs[0]["files"][0]))
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
    seconds = min(_seconds_for(from_bake) for _ in range(7))
    flss_seconds = _seconds_for(brdf_map.from_method, flss, size, theta_i)
    seconds = min(seconds, *(_seconds_for(from_bake) for _ in range(7)))
    tick("maps", 0.3)
    sigma_b = baked.table.sigma_b
    step_m = effort.reference_nm * 1e-9
    truths = ensemble_truths(relief, sigma_b, effort.map_w, effort.map_pairs, wavelengths(step_m))
    of_bake = metric.measure(truths, lambda u, v, w: (baked.table.scattered_over_w2(u, v, w), np.zeros(3)))
    tick("maps", 0.6)
    length_m = settings.patch_sigma_m * 4
    truths = patch_truths(
        relief, coherence.kernel_sigma(length_m), length_m, effort.map_w, effort.map_pairs, step_m
    )  # fmt: skip
    of_flss = metric.measure(truths, lambda u, v, w: (flss.xyz(u, v, np.full(len(u), w)) / w**2, np.zeros(3)))
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


def machine() -> dict[str, str | int]:
    """What the figures were measured on; no names of hosts."""
    model = platform.processor() or platform.machine()
    cpus = Path("/proc/cpuinfo")
    if cpus.is_file():
        named = [line.split(":", 1)[1].strip() for line in cpus.read_text().splitlines() if line.startswith("model n")]
        model = named[0] if named else model
    return {
        "processor": model,
        "cores": os.cpu_count() or 1,
        "system": platform.system(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "load": f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown",
    }


def run(effort: Effort, shared: Path, tick: Tick = lambda stage, fraction: None) -> dict:
    """The whole benchmark; its facts, as `--json` gives them."""
    started = time.perf_counter()
    scan = elaphe_scan(shared)
    judged = middle(scan, effort.scan_m) if effort.scan_m else replace(scan, periodic=False)
    facts: dict = {"machine": machine(), "quick": effort is not FULL, "surface": scan.source_name}
    facts["scan"], baked = scan_facts(judged, effort, tick)
    facts["map"] = map_facts(prepare(judged), baked, effort, tick)
    rows, refused, pairs = [], [], {}
    for surface in surfaces(effort, scan):
        of_model = judges(surface, effort)
        pairs = {model: sum(len(truth.pairs.u) for truth in one.truths) for model, one in of_model.items()}
        wanted = candidates(effort)
        for k, candidate in enumerate(wanted):
            try:
                rows.append(judge(candidate, surface, of_model[candidate.model], effort))
            except GratingError as error:
                refused.append(Refusal(surface.name, candidate.method, candidate.label, str(error)))
            tick(surface.name, (k + 1) / len(wanted))
    facts["rows"] = [asdict(row) for row in rows]
    facts["refused"] = [asdict(refusal) for refusal in refused]
    facts["front"] = {name: front_of(rows, name) for name in dict.fromkeys(row.surface for row in rows)}
    facts["sizes"] = []
    for k, pixels in enumerate(effort.sizes):
        facts["sizes"].append(scan_in_child(pixels))
        tick("sizes", (k + 1) / len(effort.sizes))
    facts["pairs"], facts["piece_um"] = pairs, effort.piece_m * 1e6
    facts["coherence_um"] = effort.coherence_m * 1e6
    facts["seconds"] = time.perf_counter() - started
    return facts


def front_of(rows: Sequence[Row], surface: str) -> list[str]:
    """Methods and labels on a surface's Pareto front of seconds against the 99th percentile, cheapest first."""
    here = [row for row in rows if row.surface == surface]
    return [f"{here[k].method} {here[k].label}".strip() for k in pareto([(r.seconds_per_million, r.p99) for r in here])]

# SPDX-License-Identifier: GPL-3.0-or-later
"""The methods that the benchmark tries, how each is built, judged and timed."""

import time
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ...bake.ensemble import plan
from ...bake.make import make
from ...bake.request import BakeRequest
from ...bake.tiles import carry_out
from ...colour.observer import spectral_weights, wavelengths
from ...measure.errors import Errors, Truth, measure
from ...methods.baked import Baked
from ...methods.method import Method, Settings
from ...methods.registry import METHODS
from ...table import atlas
from ...table.tiling import BYTES_PER_TEXEL
from .. import evaluation
from ..response import response
from .references import Judge, ensemble_xyz
from .surfaces import Effort, Surface

FLSS_TERMS = 37


# The fastest of so many more is what a machine that others use can do.
_REPEATS = 3


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
            made = make([relief], BakeRequest(candidate.delta_e, settings.coherence_length_m), source=surface.name)
            return Baked(made.table, settings), made.blender_bytes
        chosen = plan(
            relief,
            BakeRequest(delta_e=candidate.delta_e, coherence_length_m=settings.coherence_length_m),
            finer=candidate.finer,
        )
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


def measured(candidate: Candidate, surface: Surface, method: Method, judge: Judge) -> tuple[Errors, float]:
    """Errors of colour, and the angle of the brightest view in degrees."""
    plane, nothing = judge.plane, np.zeros(len(judge.plane.theta_v))
    if candidate.method == "reference":
        # Its own road takes a transform for every wavelength of every w: the same sums, from the spectra in s.
        lambdas = wavelengths(candidate.settings.step_m)
        sigma_b = method.sigma_b

        def xyz(u, v, w):
            return ensemble_xyz(judge.series, sigma_b, u, v, float(np.ravel(w)[0]), lambdas)

        density = response(method, plane, lambdas)
        luminance = density.T @ spectral_weights(lambdas)[:, 1]
    else:
        xyz = method.xyz
        luminance = xyz(plane.u, nothing, plane.w)[:, 1]
    gain = fitted_gain(judge.truths, xyz) if candidate.method == "gem" else 1.0

    def answer(u, v, w):
        return gain * xyz(u, v, np.full(len(u), w)) / w**2, np.zeros(3)

    return measure(judge.truths, answer), evaluation.peak(np.degrees(plane.theta_v), luminance)


def fitted_gain(truths: list[Truth], xyz) -> float:
    """What gives a method without units the reference's total light."""
    found = sum(xyz(t.pairs.u, t.pairs.v, np.full(len(t.pairs.u), t.w))[:, 1].sum() for t in truths)
    return sum(t.scattered_xyz[:, 1].sum() for t in truths) / found


def seconds_per_million(candidate: Candidate, method: Method, least: float) -> float:
    """Seconds for a million directions, each of its own w, as a picture has them."""
    if candidate.method == "reference":
        # Hours: a few directions at a few wavelengths, times the number of wavelengths there are.
        few = replace(method, settings=replace(method.settings, step_m=100e-9))
        share = len(wavelengths(100e-9)) / len(wavelengths(method.settings.step_m))
        return seconds_for(few.xyz, *_directions(2)) / 2 * 1e6 / share
    count = 256
    while True:
        seconds = seconds_for(method.xyz, *_directions(count))
        if seconds >= least or count >= 1 << 17:
            again = (seconds_for(method.xyz, *_directions(count)) for _ in range(_REPEATS))
            return min(seconds, *again) / count * 1e6
        count *= 4


def seconds_for(call: Callable, *arguments) -> float:
    started = time.perf_counter()
    call(*arguments)
    return time.perf_counter() - started


def _directions(count: int) -> np.ndarray:
    """u, v, w (3, count) of pairs of cosine-weighted directions."""
    rng = np.random.default_rng(1)
    radius, turn = np.sqrt(rng.random((2, count))), rng.uniform(0, 2 * np.pi, (2, count))
    each = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1 - radius**2)])
    return each.sum(axis=1)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The methods that the benchmark tries: the trials of each, and how each is built, judged and timed."""

import time
import tracemalloc
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from precompute.bake.make import make
from precompute.bake.request import BakeRequest
from precompute.colour.observer import spectral_weights, wavelengths
from precompute.measure.errors import Errors, Truth, measure
from precompute.methods.baked import Baked
from precompute.methods.flss import THESIS_TERMS
from precompute.methods.method import Method, MethodEntry, Settings
from precompute.methods.method_registry import ENTRIES
from precompute.surface.relief import Relief

from ..study import evaluation
from ..study.response import response
from ..study.traits import TRAITS
from .references import Judge, ensemble_xyz
from .result import Row
from .surfaces import Effort, Surface


@dataclass(frozen=True)
class Trial:
    """One arrangement of a method that the benchmark tries.

    label     names the trial among the trials of the method
    changes   the fields of Settings that the trial changes, by name
    build     build(relief, settings, source) in place of the entry's own; `source` names the surface in error messages
    """

    label: str
    changes: Mapping[str, object] = field(default_factory=dict)
    build: Callable[[Relief, Settings, str], Method] | None = None


def trials(method: str, effort: Effort) -> list[Trial]:
    """The trials of a method by its name."""
    return _TRIALS[method](effort)


def build_checked(relief: Relief, settings: Settings, source: str, *, delta_e: float) -> Baked:
    """Bake a relief as the verb `bake` does: the error is measured, and the bake is refined where the error exceeds
    delta_e.

    Raises GratingError, naming `source`, for a colour difference that cannot be kept."""
    made = make([relief], BakeRequest(delta_e, settings.coherence_length_m), source=source)
    return Baked(made.table, settings, made.blender_bytes)


def _reference(effort: Effort) -> list[Trial]:
    return [Trial(f"{nm:g} nm", {"step_m": nm * 1e-9}) for nm in effort.steps_nm if nm >= 5]


def _flss(effort: Effort) -> list[Trial]:
    wide = {"terms": THESIS_TERMS, "step_m": 5e-9}
    found = [
        Trial(f"N {THESIS_TERMS}, {nm:g} nm", {"terms": THESIS_TERMS, "step_m": nm * 1e-9}) for nm in effort.steps_nm
    ]
    found += [Trial(f"N {THESIS_TERMS}, 5 nm, float64", {"dtype": np.float64, **wide})]
    if effort.sweeps:
        found += [Trial(f"N {n}, 5 nm", {"terms": n}) for n in (9, 19)]
        found += [Trial(f"N {THESIS_TERMS}, 5 nm, 7 x 7 texels", {"texels": 7, **wide})]
    return found


def _chebyshev(effort: Effort) -> list[Trial]:
    found = [Trial(f"N auto, {nm:g} nm", {"step_m": nm * 1e-9}) for nm in effort.steps_nm]
    found += [Trial("N auto, 5 nm, 7 x 7 texels", {"texels": 7})]
    if effort.sweeps:
        found += [Trial(f"N {n}, 5 nm", {"terms": n}) for n in (5, 9)]
        found += [Trial("N auto, 5 nm, float64", {"dtype": np.float64})]
        found += [Trial("N auto, 2 nm, 13 x 13 texels", {"texels": 13, "step_m": 2e-9})]
    return found


def _bake(effort: Effort) -> list[Trial]:
    return [Trial(f"dE {de:g}", build=partial(build_checked, delta_e=de)) for de in effort.delta_es]


def _one(label: str) -> Callable[[Effort], list[Trial]]:
    return lambda effort: [Trial(label)]


# reference-patch sums over every pixel for every direction, so that a trial would take hours.
_TRIALS: dict[str, Callable[[Effort], list[Trial]]] = {
    "reference": _reference,
    "reference-patch": lambda effort: [],
    "flss": _flss,
    "chebyshev": _chebyshev,
    "nmm": _one("5 nm"),
    "nmm-jacobian": _one("5 nm"),
    "pq": _one("5 nm"),
    "pq-printed": _one("5 nm"),
    "stam": _one(""),
    "gem": _one("brightness fitted"),
    "bake": _bake,
}


# A time is the fastest of this many further runs, which is close to what the machine can do when nobody else uses it.
_REPEATS = 3
# Wavelength step at which the reference is timed; the time is then scaled up.
_COARSE_M = 100e-9


@dataclass(frozen=True)
class Candidate:
    """A method to try in one arrangement, with the settings that follow from both."""

    entry: MethodEntry
    trial: Trial
    settings: Settings

    @property
    def method(self) -> str:
        """Name of the method."""
        return self.entry.name

    @property
    def title(self) -> str:
        """The method and what tells the candidate from others of its method."""
        return f"{self.method} {self.trial.label}".strip()

    @property
    def model(self) -> str:
        """Model of coherence."""
        return self.entry.coherence


def candidates(effort: Effort) -> list[Candidate]:
    """All candidates that are tried on a surface."""
    base = Settings(coherence_length_m=effort.coherence_m)
    return [
        Candidate(entry, trial, replace(base, **trial.changes))
        for entry in ENTRIES.values()
        for trial in trials(entry.name, effort)
    ]


def build(candidate: Candidate, surface: Surface) -> Method:
    """The method of a surface. Raises GratingError as methods do."""
    relief = surface.whole if candidate.model == "ensemble" else surface.patch
    settings = replace(candidate.settings, period_m=surface.period_m)
    if candidate.trial.build is not None:
        return candidate.trial.build(relief, settings, surface.name)
    return candidate.entry.build(relief, settings)


def judge(candidate: Candidate, surface: Surface, judge: Judge, *, seconds_timed: float) -> Row:
    """Build, judge and time a candidate. Raises GratingError where the method does."""
    tracemalloc.start()
    try:
        started = time.process_time()
        method = build(candidate, surface)
        preparation = time.process_time() - started
        errors, brightest = measured(candidate, method, judge)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    return Row(
        surface=surface.name,
        method=candidate.method,
        label=candidate.trial.label,
        model=candidate.model,
        seconds_per_million=seconds_per_million(candidate, method, seconds_timed),
        preparation_seconds=preparation,
        peak_bytes=peak,
        table_bytes=method.table_bytes,
        peak_angle_deg=abs(brightest - judge.brightest_deg),
        mean=errors.mean,
        p95=errors.p95,
        p99=errors.p99,
        max=errors.max,
        relative_rms=errors.relative_rms,
        relative_dy=errors.relative_dy,
    )


def measured(candidate: Candidate, method: Method, judge: Judge) -> tuple[Errors, float]:
    """Errors of colour, and the angle of the brightest view in degrees."""
    plane, nothing = judge.plane, np.zeros(len(judge.plane.theta_v))
    if TRAITS[candidate.method].is_reference:
        # The method itself would take a transform for every pair of w and wavelength. These are the same sums, with the
        # spectra interpolated in s.
        lambdas = wavelengths(candidate.settings.step_m)
        sigma_b = method.sigma_b

        def xyz(u, v, w):
            return ensemble_xyz(judge.series, sigma_b, u, v=v, w=float(np.ravel(w)[0]), lambdas=lambdas)

        density = response(method, plane, lambdas)
        luminance = density.T @ spectral_weights(lambdas)[:, 1]
    else:
        xyz = method.xyz
        luminance = xyz(plane.u, nothing, plane.w)[:, 1]
    gain = 1.0 if TRAITS[candidate.method].has_units else fitted_gain(judge.truths, xyz)

    def answer(u, v, w):
        return gain * xyz(u, v, np.full(len(u), w)) / w**2, np.zeros(3)

    return measure(judge.truths, answer), evaluation.peak(np.degrees(plane.theta_v), luminance)


def fitted_gain(truths: list[Truth], xyz: Callable) -> float:
    """The factor that gives a method without units the total light of the reference."""
    found = sum(xyz(t.pairs.u, t.pairs.v, np.full(len(t.pairs.u), t.w))[:, 1].sum() for t in truths)
    return sum(t.scattered_xyz[:, 1].sum() for t in truths) / found


def seconds_per_million(candidate: Candidate, method: Method, least: float) -> float:
    """Seconds for a million directions, each of its own w as in a picture, from a run of at least `least` seconds."""
    if TRAITS[candidate.method].is_reference:
        # A million would take hours: two directions are timed at a few wavelengths, and the time is scaled up.
        few = replace(method, settings=replace(method.settings, step_m=_COARSE_M))
        share = len(wavelengths(_COARSE_M)) / len(wavelengths(method.settings.step_m))
        return seconds_for(few.xyz, *_directions(2)) / 2 * 1e6 / share
    count = 256
    while True:
        seconds = seconds_for(method.xyz, *_directions(count))
        if seconds >= least or count >= 1 << 17:
            again = (seconds_for(method.xyz, *_directions(count)) for _ in range(_REPEATS))
            return min(seconds, *again) / count * 1e6
        count *= 4


def seconds_for(call: Callable, *arguments) -> float:
    """Seconds that a call takes."""
    started = time.process_time()
    call(*arguments)
    return time.process_time() - started


def _directions(count: int) -> np.ndarray:
    """u, v, w (3, count) of pairs of cosine-weighted directions."""
    rng = np.random.default_rng(1)
    radius, turn = np.sqrt(rng.random((2, count))), rng.uniform(0, 2 * np.pi, (2, count))
    each = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1 - radius**2)])
    return each.sum(axis=1)

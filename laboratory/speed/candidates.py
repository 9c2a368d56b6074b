# SPDX-License-Identifier: GPL-3.0-or-later
"""The methods that the benchmark tries, how each is built, judged and timed."""

import time
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from precompute.colour.observer import spectral_weights, wavelengths
from precompute.measure.errors import Errors, Truth, measure
from precompute.methods.method import Method, MethodEntry, Settings
from precompute.methods.method_registry import ENTRIES

from ..study import evaluation
from ..study.response import response
from ..study.traits import TRAITS
from .references import Judge, ensemble_xyz
from .result import Row
from .surfaces import Effort, Surface
from .trials import Trial, trials

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
    def label(self) -> str:
        """What tells the candidate from others of its method."""
        return self.trial.label

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
        started = time.perf_counter()
        method = build(candidate, surface)
        preparation = time.perf_counter() - started
        errors, brightest = measured(candidate, method, judge)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    return Row(
        surface=surface.name,
        method=candidate.method,
        label=candidate.label,
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
    started = time.perf_counter()
    call(*arguments)
    return time.perf_counter() - started


def _directions(count: int) -> np.ndarray:
    """u, v, w (3, count) of pairs of cosine-weighted directions."""
    rng = np.random.default_rng(1)
    radius, turn = np.sqrt(rng.random((2, count))), rng.uniform(0, 2 * np.pi, (2, count))
    each = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1 - radius**2)])
    return each.sum(axis=1)

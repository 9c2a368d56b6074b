# SPDX-License-Identifier: GPL-3.0-or-later
"""The trials that the benchmark makes of each method."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from precompute.bake.make import make
from precompute.bake.request import BakeRequest
from precompute.methods.baked import Baked
from precompute.methods.flss import THESIS_TERMS
from precompute.methods.method import Method, Settings
from precompute.surface.relief import Relief

from .surfaces import Effort


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

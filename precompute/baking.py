# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake that keeps its budget: plan, carry out, measure what the file would hold, and refine once if it must be."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from . import atlas
from .bake import BYTES_PER_TEXEL, Bake, Progress, carry_out, plan
from .failure import GratingError
from .metric import Errors
from .needs import EVERYTHING, Needs
from .relief import Relief
from .self_check import self_check

# Past this a table is no longer something to hand to an artist's graphics card.
ATLAS_BYTES_MAX = 1 << 30
# Under this budget the three digits of a half float (2^-11, 0.02 of dE00) are no longer nothing.
_FLOATS_BELOW = 0.15
# |dY| over Y that goes with a dE00 of 1 or less.
_RELATIVE_DY = 0.01


@dataclass(frozen=True)
class Order:
    """What is asked of a bake. `delta_e` is the 99th percentile of CIEDE2000; a coherence length of None is auto."""

    delta_e: float = 1.0
    coherence_length_m: float | None = None
    illuminant: str = "D65"
    needs: Needs = EVERYTHING


@dataclass(frozen=True)
class Made:
    """A bake as its file will hold it, its measured errors, and what it took."""

    bake: Bake
    image: np.ndarray
    layout: atlas.Layout
    errors: Errors
    wavelengths: int
    transforms: int
    seconds: float
    check_seconds: float

    @property
    def blender_bytes(self) -> int:
        return self.layout.width * self.layout.height * BYTES_PER_TEXEL


def make(
    reliefs: Sequence[Relief], order: Order, progress: Progress = lambda stage, fraction: None, source: str = "the scan"
) -> Made:
    """Bake reliefs to an order. Raises GratingError, naming `source`, if its budget cannot be met, with what could
    be."""
    made = _attempt(reliefs, order, progress, 1.0, source)
    excess = _excess(made.errors, order.delta_e)
    if excess > 1:
        # The error falls as the square of the texels; what it does not, a second look tells.
        again = _attempt(reliefs, order, progress, math.sqrt(1.25 * excess), source)
        again = _with_time_of(again, made)
        made = again if _excess(again.errors, order.delta_e) < excess else made
    if _excess(made.errors, order.delta_e) > 1:
        errors = made.errors
        reached = max(errors.p99, errors.relative_dy / _RELATIVE_DY)
        raise GratingError(
            f"{source}: the bake reaches a dE00 of {errors.p99:.2f} (99th percentile) and {errors.relative_dy:.1%} of "
            f"the light, not the asked {order.delta_e:g}; ask for --delta-e {math.ceil(reached * 10.5) / 10:g} or a "
            "shorter --coherence-um"
        )
    return made


def _excess(errors: Errors, delta_e: float) -> float:
    """By how much a bake misses its budget: 1 or less is kept."""
    return max(errors.p99 / delta_e, errors.relative_dy / (_RELATIVE_DY * max(delta_e, 1)))


def _attempt(reliefs, order: Order, progress: Progress, finer: float, source: str) -> Made:
    started = time.perf_counter()
    chosen = plan(
        reliefs, order.coherence_length_m, order.delta_e, order.illuminant, order.needs, progress, finer
    )  # fmt: skip
    in_blender = chosen.terms * len(chosen.axes[0]) * len(chosen.axes[1]) * BYTES_PER_TEXEL
    if in_blender > ATLAS_BYTES_MAX:
        raise GratingError(
            f"{source}: the table would take {in_blender / 2**20:.0f} MiB in Blender; ask for a shorter --coherence-um"
        )
    precision = np.float32 if order.delta_e < _FLOATS_BELOW else np.float16
    image, layout = atlas.pack(carry_out(chosen, order.illuminant, progress), precision)
    stored = atlas.unpack(image, layout)
    baked = time.perf_counter()
    errors = self_check(reliefs, chosen, stored, progress)
    transforms = sum(len(series.amplitude) for series in chosen.ensemble)
    return Made(
        stored, image, layout, errors, len(chosen.wavelengths), transforms, baked - started,
        time.perf_counter() - baked,
    )  # fmt: skip


def _with_time_of(made: Made, earlier: Made) -> Made:
    seconds, check_seconds = made.seconds + earlier.seconds, made.check_seconds + earlier.check_seconds
    return replace(made, seconds=seconds, check_seconds=check_seconds)

# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake that keeps its budget: plan, carry out, measure what the file would hold, and refine once if it must be."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.failure import GratingError
from ..base.progress import Progress
from ..measure.errors import Errors
from ..surface.relief import Relief
from ..table import atlas
from ..table.sample_set import SampleSet
from ..table.table import Table
from ..table.tiling import BYTES_PER_TEXEL
from . import patch
from .draws import make_sample_set
from .ensemble import plan
from .request import BakeRequest
from .resolution import blender_bytes
from .self_check import self_check
from .tiles import carry_out

# Past this a table is no longer something to hand to an artist's graphics card.
ATLAS_BYTES_MAX = 1 << 30


# |dY| over Y that goes with a dE00 of 1 or less.
_RELATIVE_DY = 0.01


@dataclass(frozen=True)
class Made:
    """A bake as its file will hold it, the sample set beside it (none under the patch model), its measured errors, and
    what it took."""

    bake: Table
    sample_set: SampleSet | None
    image: np.ndarray
    layout: atlas.Layout
    errors: Errors
    wavelengths: int
    transforms: int
    seconds: float
    check_seconds: float

    @property
    def blender_bytes(self) -> int:
        return BYTES_PER_TEXEL * self.layout.width * self.layout.height


def make(
    reliefs: Sequence[Relief],
    order: BakeRequest,
    progress: Progress = lambda stage, fraction: None,
    source: str = "the scan",
) -> Made:
    """Bake reliefs to an order. Raises GratingError, naming `source`, if its budget cannot be met, with what could
    be."""
    made = _attempt(reliefs, order, progress, 1.0, source)
    excess = _excess(made.errors, order.delta_e)
    if excess > 1:
        # The error falls as the fourth power of the texels; what it does not, a second look tells.
        again = _attempt(reliefs, order, progress, (1.5 * excess) ** 0.25, source)
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


def _steps(model: str) -> tuple[Callable, Callable, Callable]:
    """Plan, carry out and self-check of a model of coherence."""
    if model == "patch":
        return patch.plan, patch.carry_out, patch.self_check
    return plan, carry_out, self_check


def _attempt(reliefs, order: BakeRequest, progress: Progress, finer: float, source: str) -> Made:
    started = time.perf_counter()
    plan_it, carry_it_out, check_it = _steps(order.model)
    try:
        chosen = plan_it(
            reliefs, order.coherence_length_m, order.delta_e, order.illuminant, order.needs, progress, finer
        )  # fmt: skip
    except GratingError as error:
        raise GratingError(f"{source}: {error}") from error
    in_blender = blender_bytes(chosen.terms, tuple(len(axis) for axis in chosen.axes), chosen.sigma_b)
    if in_blender > ATLAS_BYTES_MAX:
        raise GratingError(
            f"{source}: the table would take {in_blender / 2**20:.0f} MiB in Blender; ask for a shorter "
            "--coherence-um, or for a part of it by --needs"
        )
    image, layout = atlas.pack(carry_it_out(chosen, order.illuminant, progress))
    stored = atlas.unpack(image, layout)
    sample_set = None if order.model == "patch" else make_sample_set(chosen.ensemble, chosen.sigma_b)
    baked = time.perf_counter()
    errors = check_it(reliefs, chosen, stored, progress)
    transforms = sum(len(series.amplitude) for series in chosen.ensemble)
    return Made(
        stored, sample_set, image, layout, errors, len(chosen.wavelengths), transforms, baked - started,
        time.perf_counter() - baked,
    )  # fmt: skip


def _with_time_of(made: Made, earlier: Made) -> Made:
    seconds, check_seconds = made.seconds + earlier.seconds, made.check_seconds + earlier.check_seconds
    return replace(made, seconds=seconds, check_seconds=check_seconds)

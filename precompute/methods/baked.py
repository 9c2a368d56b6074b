# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake as a method: its table is read as the materials read it."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..bake.ensemble import bake, plan
from ..bake.levels import with_levels
from ..bake.make import make
from ..bake.request import BakeRequest
from ..bake.tiles import carry_out
from ..base.failure import GratingError
from ..surface.relief import Relief
from ..table import atlas
from ..table.table import Table
from ..table.tiling import BYTES_PER_TEXEL
from .entry import Extent, MethodEntry, PlotStyle, Trial
from .method import Coherence, Method, Settings

# The factors by which the texels of trials are finer. Reading alone blurs as much as a kernel of 0.58 texels, and a
# bake has at least 0.9 texels to its kernel.
FINER = (0.7, 1.6)


@dataclass(frozen=True)
class Baked(Method):
    """A table as its file holds it, in half floats. `table_bytes` is the memory that it takes in Blender."""

    table: Table
    settings: Settings
    table_bytes: int = 0
    name: str = "bake"
    coherence: Coherence = "ensemble"

    def density(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float, *, wavelength_m: float) -> np.ndarray:
        """Always raises GratingError: a bake has no spectrum."""
        raise GratingError("bake: it holds colours, not spectra; compare its colours, or take another method")

    def xyz(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float) -> np.ndarray:
        """See Method."""
        u, v, w = np.broadcast_arrays(u, v, w)
        held = self.table.holds(u, v, w) * w**2
        scattered = self.table.scattered_over_w2(u, v, w) * held[:, None]
        return scattered + self.table.zero_order_xyz(w) * self.table.kernel(u, v)[:, None]


def build(relief: Relief, settings: Settings) -> Baked:
    """Bake a relief and round its table to the half floats of the atlas. The bake's error is not measured."""
    request = BakeRequest(coherence_length_m=settings.coherence_length_m, illuminant=settings.illuminant)
    return _stored(bake(relief, request), settings)


def build_checked(relief: Relief, settings: Settings, source: str, *, delta_e: float) -> Baked:
    """Bake a relief as the verb `bake` does: the error is measured, and the bake is refined where the error exceeds
    delta_e.

    Raises GratingError, naming `source`, for a colour difference that cannot be kept."""
    made = make([relief], BakeRequest(delta_e, settings.coherence_length_m), source=source)
    return Baked(made.table, settings, made.blender_bytes)


def build_varied(
    relief: Relief, settings: Settings, source: str, *, delta_e: float, terms: int | None = None, finer: float = 1.0
) -> Baked:
    """A bake with another plan: another number of terms, or texels `finer` times as small. Its error is not
    measured."""
    request = BakeRequest(delta_e=delta_e, coherence_length_m=settings.coherence_length_m)
    chosen = plan(relief, request, finer=finer)
    return _stored(with_levels(carry_out(replace(chosen, terms=terms or chosen.terms))), settings)


def _stored(table: Table, settings: Settings) -> Baked:
    image, layout = atlas.pack(table)
    return Baked(atlas.unpack(image, layout), settings, layout.width * layout.height * BYTES_PER_TEXEL)


def _trials(extent: Extent) -> list[Trial]:
    found = [Trial(f"dE {de:g}", build=partial(build_checked, delta_e=de)) for de in extent.delta_es]
    if extent.sweeps:
        varied = partial(build_varied, delta_e=1.0)
        found += [Trial(f"dE 1, K {k}", build=partial(varied, terms=k)) for k in (2, 3, 4, 6, 8)]
        found += [Trial(f"dE 1, texels x {f:g}", build=partial(varied, finer=f)) for f in FINER]
    return found


ENTRY = MethodEntry(
    "bake", "ensemble", build, PlotStyle("C0", "o", first=True), has_spectrum=False, trials=_trials
)  # fmt: skip

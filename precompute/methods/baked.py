# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake as a method: its table is read as in the materials."""

from dataclasses import dataclass

import numpy as np

from ..bake.ensemble import bake
from ..bake.request import BakeRequest
from ..base.failure import GratingError
from ..surface.relief import Relief
from ..table import atlas
from ..table.blur_levels import BYTES_PER_TEXEL
from ..table.table import Table
from .method import Coherence, Method, MethodEntry, Settings


@dataclass(frozen=True)
class Baked(Method):
    """A table as in its file, in half floats. `table_bytes` is its memory in Blender."""

    table: Table
    settings: Settings
    table_bytes: int = 0
    name: str = "bake"
    coherence: Coherence = "ensemble"

    def density(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float, *, wavelength_m: float) -> np.ndarray:
        """Always raises GratingError: a bake has no spectrum."""
        raise GratingError("bake", "it holds colours, not spectra", "compare its colours, or take another method")

    def xyz(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float) -> np.ndarray:
        """See Method."""
        u, v, w = np.broadcast_arrays(u, v, w)
        held = self.table.holds(u, v, w) * w**2
        scattered = self.table.scattered_over_w2(u, v, w) * held[:, None]
        return scattered + self.table.zero_order_xyz(w) * self.table.kernel(u, v)[:, None]


def build(relief: Relief, settings: Settings) -> Baked:
    """Bake a relief and round its table to the half floats of the atlas, without measuring the error."""
    request = BakeRequest(coherence_length_m=settings.coherence_length_m, illuminant=settings.illuminant)
    image, layout = atlas.pack(bake(relief, request))
    return Baked(atlas.unpack(image, layout), settings, layout.width * layout.height * BYTES_PER_TEXEL)


ENTRY = MethodEntry("bake", "ensemble", build)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake, as the materials read it, among the other methods."""

from dataclasses import dataclass

import numpy as np

from ..bake.ensemble import bake
from ..bake.request import BakeRequest
from ..base.failure import GratingError
from ..surface.relief import Relief
from ..table import atlas
from ..table.table import Table
from .method import Settings


@dataclass(frozen=True)
class Baked:
    """A table as its file holds it, in half floats."""

    table: Table
    settings: Settings
    name: str = "bake"
    coherence: str = "ensemble"

    def density(self, u, v, w, wavelength_m) -> np.ndarray:
        """Never: raises GratingError."""
        raise GratingError("bake: it holds colours, not spectra; compare its colours, or take another method")

    def xyz(self, u, v, w) -> np.ndarray:
        """See Method."""
        u, v, w = np.broadcast_arrays(u, v, w)
        scattered = self.table.scattered_over_w2(u, v, w) * (w**2)[:, None]
        return scattered + self.table.zero_order_xyz(w) * self.table.kernel(u, v)[:, None]


def build(relief: Relief, settings: Settings) -> Baked:
    """Bake a relief, through the half floats of the atlas."""
    table = bake(relief, BakeRequest(coherence_length_m=settings.coherence_length_m, illuminant=settings.illuminant))
    return Baked(atlas.unpack(*atlas.pack(table)), settings)

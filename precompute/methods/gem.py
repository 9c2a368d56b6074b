# SPDX-License-Identifier: GPL-3.0-or-later
"""The rainbow of GPU Gems, chapter 8 (Stam 2004): an artistic look without physics.

Each order n = 1 .. 7 of u d = n lambda, with lambda from 0.5 to 1 um running over the rainbow, adds three bumps 1 - x^2
in red, green and blue. The highlight is a Gaussian of r u / w, with roughness r. It ignores heights, v and energy.
"""

from dataclasses import dataclass

import numpy as np

from ..base.failure import GratingError
from ..colour.spaces import rgb_from_xyz
from ..surface.quality import grating_period
from ..surface.relief import Relief
from .method import Coherence, Method, MethodEntry, Settings

ORDERS = 7
_SHARPNESS = 4.0
_CENTRES = np.array([0.75, 0.5, 0.25])
_ROUGHNESS = 20.0


def bump(x: np.ndarray) -> np.ndarray:
    """max(0, 1 - x^2)."""
    return np.maximum(0, 1 - x**2)


@dataclass(frozen=True)
class Gem(Method):
    """The rainbow of a grating of period_m."""

    period_m: float
    settings: Settings
    name: str = "gem"
    coherence: Coherence = "ensemble"

    def density(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float, *, wavelength_m: float) -> np.ndarray:
        """Always raises GratingError: the rainbow has no spectrum."""
        raise GratingError("gem", "it has colours but no spectrum", "leave it out of an evaluation by wavelength")

    def xyz(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float) -> np.ndarray:
        """The rainbow's linear Rec.709 as XYZ (n, 3)."""
        u, _, w = np.broadcast_arrays(u, v, w)
        path_um = np.abs(u) * self.period_m * 1e6
        rgb = np.exp(-((_ROUGHNESS * u / np.maximum(w, 1e-6)) ** 2))[:, None] * np.ones(3)
        for n in range(1, ORDERS + 1):
            y = 2 * path_um / n - 1
            rgb = rgb + bump(_SHARPNESS * (y[:, None] - _CENTRES))
        return rgb @ np.linalg.inv(rgb_from_xyz("Rec.709", self.settings.illuminant)).T


def build(relief: Relief, settings: Settings) -> Gem:
    """Build the rainbow of a relief's period. Raises GratingError if the relief has no period."""
    return Gem(grating_period(relief, settings.period_m), settings)


ENTRY = MethodEntry("gem", "ensemble", build)

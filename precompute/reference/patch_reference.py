# SPDX-License-Identifier: GPL-3.0-or-later
"""Reference of the patch model of coherence: the sum P(q; s) of precompute/spectra/patch_window.py, computed for each
direction as a product of matrices."""

from dataclasses import dataclass

import numpy as np

from ..spectra.patch_window import PatchWindow
from ..spectra.spectrum import phasor
from ..surface.relief import Relief

# Complex numbers in one block of waves, to limit memory.
_CHUNK = 2_000_000


@dataclass(frozen=True)
class PatchReference:
    """The direct transform of the repeated patch under its window: exact phasor, float64, no expansion."""

    window: PatchWindow

    def density(
        self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float, *, wavelength_m: np.ndarray | float
    ) -> np.ndarray:
        """Density (n,) over (u, v) of the reflected light at u, v (n,), for R = O = 1.

        w and wavelength_m, in metres, are (n,) or one number."""
        u, v, w, lam = np.broadcast_arrays(u, v, w, wavelength_m)
        amplitude = np.empty(len(u), complex)
        step = max(1, _CHUNK // sum(self.window.relief.height_m.shape))
        sums = self._line_sums if _is_line_grating(self.window.relief) else self._sums
        for start in range(0, len(u), step):
            part = slice(start, start + step)
            amplitude[part] = sums(v[part] / lam[part], u[part] / lam[part], w[part] / lam[part])
        return self.window.density_scale() * np.abs(amplitude) ** 2 / lam**2

    def _sums(self, q_y: np.ndarray, q_x: np.ndarray, s: np.ndarray) -> np.ndarray:
        out = np.empty(len(s), complex)
        waves_y, waves_x = self.window.waves(0, q_y), self.window.waves(1, q_x)
        relief = self.window.relief
        for one in np.unique(s):
            at = s == one
            field = relief.apodisation * phasor(relief.height_m, one)
            out[at] = np.einsum("ny,yn->n", waves_y[at], field @ waves_x[at].T)
        return out

    def _line_sums(self, q_y: np.ndarray, q_x: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Like _sums, for a relief that is constant along y: the product of a sum over y and a sum over x."""
        relief = self.window.relief
        apodisation_y, apodisation_x = relief.apodisation_axes
        line = np.exp((-2j * np.pi) * s[:, None] * relief.height_m[0])
        along_x = np.einsum("nx,nx,x->n", self.window.waves(1, q_x), line, apodisation_x)
        return self.window.waves(0, q_y) @ apodisation_y * along_x


def _is_line_grating(relief: Relief) -> bool:
    return bool(np.all(relief.height_m == relief.height_m[0]))

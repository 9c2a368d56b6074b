# SPDX-License-Identifier: GPL-3.0-or-later
"""PQ: the patch repeated N times side by side, without a window (thesis 3.5 and Algorithm 5).

The transform of N copies along an axis is the transform of one patch times a Dirichlet kernel,

    p + i q = sum_n exp(-i 2 pi f T n),   n = 0 .. N - 1,

for a patch of length T at the frequency f. The transform of one patch is interpolated from its DFT by sinc functions.
The thesis multiplies the kernels of the two axes as (p1 p2 - q1 q2) + i (p1 p2 + q1 q2). The right product is (p1 p2 -
q1 q2) + i (p1 q2 + q1 p2).
"""

from dataclasses import dataclass

import numpy as np

from ..optics.coherence import THESIS_COHERENCE_M
from ..surface.quality import unit_cell
from ..surface.relief import Relief
from . import flss
from .method import Coherence, Method, MethodEntry, Settings
from .term_images import Expansion, ShaderImages, TermImages, make_images, read_spectrum

# The thesis takes p = N, q = 0 if 1 - cos(phase) is below this.
_PRINTED_LIMIT = 1e-5


def copies_sum(phase: np.ndarray, copies: int) -> np.ndarray:
    """sum_{n < copies} exp(-i n phase) (m,) at phases (m,) in radians."""
    half = np.asarray(phase) / 2
    turns = np.rint(half / np.pi)
    small = half - turns * np.pi
    # sin(N x) / sin(x) is 0 / 0 at x = turns pi, where its limit is N up to the sign.
    near = np.abs(small) < 1e-9
    safe = np.where(near, 1.0, small)
    ratio = np.where(near, copies, np.sin(copies * safe) / np.sin(safe)) * np.where(turns * (copies - 1) % 2, -1, 1)
    return ratio * np.exp(-1j * (copies - 1) * half)


def printed_factor(phase: np.ndarray, copies: int) -> np.ndarray:
    """The thesis's p + i q over N (m,): its sum runs from 0 to N, one copy too many."""
    total = copies_sum(phase, copies + 1)
    return np.where(1 - np.cos(phase) < _PRINTED_LIMIT, copies, total) / copies


def printed_product(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The thesis's product of p1 + i q1 and p2 + i q2."""
    real = first.real * second.real - first.imag * second.imag
    return real + 1j * (first.real * second.real + first.imag * second.imag)


@dataclass(frozen=True)
class Pq(Method):
    """A cell of images.size_m (Ty, Tx) metres, repeated `copies` times (along B, along T).

    `printed` keeps the two errors of the thesis: one copy too many, and the wrong product."""

    name: str
    images: TermImages
    expansion: Expansion
    copies: tuple[int, int]
    printed: bool
    settings: Settings
    coherence: Coherence = "patch"

    def density(
        self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float, *, wavelength_m: np.ndarray | float
    ) -> np.ndarray:
        """See Method; wavelength_m may be (n,)."""
        directions = np.broadcast_arrays(u, v, w, wavelength_m)
        patch = read_spectrum(
            self.images, self.expansion, directions, weight=lambda _, d: np.sinc(d), texels=self.settings.texels
        )
        u, v, _, lam = directions
        phases = [2 * np.pi * length * c / lam for length, c in zip(self.images.size_m, (v, u), strict=True)]
        if self.printed:
            factor = printed_product(*(printed_factor(p, n) for p, n in zip(phases, self.copies, strict=True)))
        else:
            along_b, along_t = (copies_sum(p, n) / n for p, n in zip(phases, self.copies, strict=True))
            factor = along_b * along_t
        area = np.prod(self.images.size_m) * np.prod(self.copies)
        return area * np.abs(factor * patch) ** 2 / lam**2

    @property
    def table_bytes(self) -> int:
        """Bytes of the images."""
        return self.images.terms.nbytes

    def shader_images(self) -> ShaderImages:
        """See Method."""
        area = float(np.prod(self.images.size_m) * np.prod(self.copies))
        return ShaderImages(self.images, self.expansion, area, copies=self.copies)


def copies_of(cell: Relief, settings: Settings) -> tuple[int, int]:
    """The number of cells that fill the coherence length along each axis, at least one."""
    length_m = settings.coherence_length_m or THESIS_COHERENCE_M
    along_b, along_t = (max(1, int(np.ceil(length_m / side - 1e-6))) for side in cell.size_m)
    return along_b, along_t


def _build(name: str, printed: bool, relief: Relief, settings: Settings) -> Pq:
    cell = unit_cell(relief)
    expansion = flss.expansion_for(cell, settings)
    images = make_images(cell, expansion, settings.dtype)
    return Pq(name, images, expansion, copies_of(cell, settings), printed, settings)


def build(relief: Relief, settings: Settings) -> Pq:
    """Build PQ with the right product. Raises GratingError for a relief too deep for the Taylor series."""
    return _build("pq", False, relief, settings)


def build_printed(relief: Relief, settings: Settings) -> Pq:
    """Build PQ as the thesis prints it. Raises GratingError as `build` does."""
    return _build("pq-printed", True, relief, settings)


ENTRIES = (
    MethodEntry("pq", "patch", build, has_shader=True),
    MethodEntry("pq-printed", "patch", build_printed),
)

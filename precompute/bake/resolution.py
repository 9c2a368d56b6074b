# SPDX-License-Identifier: GPL-3.0-or-later
"""The resolution of a table: its texels, and its bytes in Blender."""

import math

import numpy as np

from ..table import tiling
from ..table.atlas import STRIP_ROWS
from ..table.table import ZERO_ORDER_SAMPLES
from ..table.tiling import BYTES_PER_TEXEL, TILE_PADDING

# The least and greatest number of texels a side of a whole table. kernel.py refuses a finer table.
RESOLUTION_MIN, RESOLUTION_MAX = 64, 2048
# The greatest number of bytes of a bake in Blender if no coherence length is requested.
DEFAULT_BYTES = 128 << 20
# Texels per standard deviation of the kernel that keep a dE00 of 1 on any surface, ideal line gratings included
# (docs/data_flow.md).
TEXELS_ALWAYS = 1.2


def texel_size(resolution: int) -> float:
    """The step of u per texel, for a tile of `resolution` texels a side.

    The centres of its inner texels reach from -2 to 2."""
    return 4 / (resolution - 2 * TILE_PADDING - 1)


def resolution_for(sigma_b: float, texels_per_sigma: float) -> int:
    """Texels a side of the coarsest whole table that has `texels_per_sigma` texels per kernel sigma_b.

    The number is even, and at least RESOLUTION_MIN."""
    count = math.ceil(4 * texels_per_sigma / sigma_b - 1e-9) + 1 + 2 * TILE_PADDING
    return max(RESOLUTION_MIN, count + count % 2)


def blender_bytes(terms: int, tile: tuple[int, int], sigma_b: float, *, triples: int = 1) -> int:
    """Bytes of a table's atlas in Blender. `tile` is rows and columns of a tile of blur level 0, `triples` the number
    of channels over 3."""
    inner_rows, inner_columns = (n - 2 * TILE_PADDING for n in tile)
    rows, columns = tiling.cell_for(terms * triples, (inner_rows, inner_columns), sigma_b).size
    width_min = ZERO_ORDER_SAMPLES + 1
    down, across = tiling.grid(terms * triples, (rows, columns), width_min=width_min)
    height = down * rows + STRIP_ROWS * triples
    return BYTES_PER_TEXEL * height * max(across * columns, width_min)


def texel_middles(low: float, high: float, texel: float) -> np.ndarray:
    """The centres of the texels from low to high, and of TILE_PADDING more texels at each end.

    If low and high are not a whole number of texels apart, the outer centres exceed them by equal amounts."""
    count = math.ceil((high - low) / texel - 1e-9) + 1 + 2 * TILE_PADDING
    return (low + high) / 2 + (np.arange(count) - (count - 1) / 2) * texel

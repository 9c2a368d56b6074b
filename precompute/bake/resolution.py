# SPDX-License-Identifier: GPL-3.0-or-later
"""How fine a table is: texels, wavelengths, and the bytes that they take in Blender."""

import math

import numpy as np

from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M
from ..table import tiling
from ..table.albedo_bound import BOUND_ROWS
from ..table.atlas import STRIP_ROWS
from ..table.table import ZERO_ORDER_SAMPLES
from ..table.tiling import BYTES_PER_TEXEL, TILE_PADDING

RESOLUTION_MIN, RESOLUTION_MAX = 64, 2048


# What a bake may take in Blender unless a coherence length is asked for.
DEFAULT_BYTES = 128 << 20


# Texels to a sigma that hold a dE00 of 1 on any surface, ideal line gratings included.
TEXELS_ALWAYS = 1.2


def texel_size(resolution: int) -> float:
    """Step in u of a tile whose inner texels' middles cover [-2, 2]."""
    return 4 / (resolution - 2 * TILE_PADDING - 1)


def resolution_for(sigma_b: float, texels_per_sigma: float) -> int:
    """Texels a side of the coarsest whole table that gives a kernel sigma_b so many texels; even."""
    count = math.ceil(4 * texels_per_sigma / sigma_b - 1e-9) + 1 + 2 * TILE_PADDING
    return max(RESOLUTION_MIN, count + count % 2)


def blender_bytes(terms: int, tile: tuple[int, int], sigma_b: float) -> int:
    """What the atlas of a table takes in Blender."""
    inner = tuple(n - 2 * TILE_PADDING for n in tile)
    levels = tiling.level_count(sigma_b, inner)
    stride, width_min = tiling.first_stride(inner, levels), ZERO_ORDER_SAMPLES + 1
    block = tiling.tile_block(terms, stride, levels, width_min)
    height, width = tiling.blocks_size(block, stride, levels)
    return BYTES_PER_TEXEL * (height + STRIP_ROWS + BOUND_ROWS + 2) * max(width, width_min)


def texel_middles(low: float, high: float, texel: float) -> np.ndarray:
    """Middles of the texels from low to high, or from as little outside, and TILE_PADDING more at each end."""
    count = math.ceil((high - low) / texel - 1e-9) + 1 + 2 * TILE_PADDING
    return (low + high) / 2 + (np.arange(count) - (count - 1) / 2) * texel


def bake_wavelengths(sigma_b: float, delta_e: float = 1.0, reach: float = 2.0) -> np.ndarray:
    """Wavelengths (n,) equally spaced in log: at |u| = reach a step moves an order by f sigma_b, and a Gaussian summed
    at that spacing is flat to 2 exp(-2 pi^2 / f^2), which is put at 0.1 % for a dE00 of 1. At least 80, for the colour
    matching functions."""
    spacing = math.pi * math.sqrt(2 / math.log(2 / min(1e-3 * delta_e, 0.1)))
    step = min(spacing * sigma_b / reach, np.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) / 80)
    count = int(np.ceil(np.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) / step)) + 1
    return np.geomspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, count)

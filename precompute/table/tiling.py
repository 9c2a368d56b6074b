# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the tiles of a table and of its wider levels stand in one picture.

Level l has the kernel sigma_b 2^l and the texel texel 2^l. Everything is of closed form in 2^-l, since a material
computes it for a level that only the shading knows. With A the inner texels of level 0, rounded up to a multiple of
2^(levels - 1), a tile of level l takes A / 2^l + LEVEL_PADDING texels of the picture:

    inner texels    ceil((inner - 1) / 2^l) + 1, the first at the same (u, v) on every level
    TILE_PADDING    more on each side, which a cubic reading between inner texels meets
    the rest        empty

Level 0 fills a block of rows x columns tiles; the blocks of the other levels stand one above the other to its right.
"""

import math

from ..base.failure import GratingError

TILE_PADDING = 2


# Of a tile, over what its inner texels take: they may be one more than A / 2^l.
LEVEL_PADDING = 2 * TILE_PADDING + 2


# A picture's side that every graphics card of today takes.
PICTURE_SIDE_MAX = 16384


# Its longer side over the shorter, where tiles allow.
ASPECT_MAX = 3.0


# A packed picture is held as RGBA of 32 bits.
BYTES_PER_TEXEL = 16


# The widest kernel that lights and roughness ask for, and the fewest inner texels that still show one.
_WIDEST_KERNEL, _INNER_MIN = 0.25, 8


Pair = tuple[int, int]


def level_count(sigma_b: float, inner: Pair) -> int:
    """Levels of a table with so many inner rows and columns: up to the first that is as wide as ever asked for, or
    the last that has texels enough."""
    wanted = math.ceil(math.log2(_WIDEST_KERNEL / sigma_b) - 1e-9)
    held = math.floor(math.log2(max(min(inner) - 1, 1) / (_INNER_MIN - 1)))
    return 1 + max(0, min(wanted, held))


def level_inner(inner: Pair, level: int) -> Pair:
    """Inner rows and columns of a level."""
    return tuple(math.ceil((n - 1) / 2**level) + 1 for n in inner)


def first_stride(inner: Pair, levels: int) -> Pair:
    """Rows and columns of the picture that a tile of level 0 takes."""
    step = 2 ** (levels - 1)
    return tuple(math.ceil(n / step) * step + LEVEL_PADDING for n in inner)


def level_stride(stride: Pair, level: int) -> Pair:
    """Rows and columns that a tile of a level takes, of one whose tiles of level 0 take `stride`."""
    return tuple((n - LEVEL_PADDING) // 2**level + LEVEL_PADDING for n in stride)


def block_origin(block: Pair, stride: Pair, level: int) -> Pair:
    """Lower left texel (x, y) of a level's block of rows x columns tiles, y upward from the first block's bottom."""
    if level == 0:
        return 0, 0
    (rows, columns), inner_rows = block, stride[0] - LEVEL_PADDING
    below = inner_rows - inner_rows // 2 ** (level - 1) + LEVEL_PADDING * (level - 1)
    return columns * stride[1], rows * below


def blocks_size(block: Pair, stride: Pair, levels: int) -> Pair:
    """Rows and columns of the picture that the blocks of all levels take."""
    height, width = (count * n for count, n in zip(block, stride, strict=True))
    if levels > 1:
        width += block[1] * level_stride(stride, 1)[1]
        height = max(height, block_origin(block, stride, levels)[1])
    return height, width


def tile_block(terms: int, stride: Pair, levels: int, width_min: int = 1) -> Pair:
    """Rows and columns of tiles in a block: of the pictures that a graphics card takes, width_min wide at least, and
    that are not much longer than wide if there are any, the smallest, then the squarest.

    Raises GratingError if no graphics card takes any."""
    found = []
    for columns in range(1, terms + 1):
        block = math.ceil(terms / columns), columns
        height, width = blocks_size(block, stride, levels)
        short, long = sorted((height, max(width, width_min)))
        if long <= PICTURE_SIDE_MAX:
            found.append((max(long / short, ASPECT_MAX), short * long, long / short, block))
    if not found:
        raise GratingError(
            f"a table of {terms} tiles of {stride[1]} x {stride[0]}: larger than a graphics card takes; ask for a "
            "shorter --coherence-um"
        )
    return min(found)[-1]

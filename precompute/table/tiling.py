# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the tiles of a table and of its wider levels stand in one picture.

Level l has the kernel sigma_b 2^l, and texels that are 2^l times as large as those of level 0. Which level is read
depends on the point that is shaded, so a material computes a tile's place while it shades. Therefore every place has a
closed form in 2^-l. The inner texels of a tile hold the table; the texels around them are there only for reading.

Let A be the number of inner texels of level 0 along an axis, rounded up to a multiple of 2^(levels - 1). Along this
axis a tile of level l takes A / 2^l + LEVEL_PADDING texels of the picture:

    inner texels    ceil((inner - 1) / 2^l) + 1 of them; the first is at the same (u, v) on every level
    TILE_PADDING    more on each side, which a cubic reading between inner texels uses
    the rest        empty

Level 0 fills a block of rows x columns tiles. The blocks of the other levels stand to its right, one above the other.
"""

import math

from ..base.failure import GratingError

# Texels on each side of a tile that a cubic reading of its inner texels uses.
TILE_PADDING = 2
# Texels that a tile takes beside the A / 2^l of its inner texels: the padding on both sides, one inner texel that a
# level may have over A / 2^l, and one to spare.
LEVEL_PADDING = 2 * TILE_PADDING + 2
# The side of a picture that every graphics card of today takes.
PICTURE_SIDE_MAX = 16384
# The longer side of a picture over its shorter side, at most, where the tiles allow it.
ASPECT_MAX = 3.0
# The most terms of a table. Light that returns from heights d apart changes with w as exp(2 pi i w d / lambda), and its
# colour, the sum over the observer's wavelengths, is a sum of 89 Chebyshev polynomials of w to an error of 1e-5 for a
# d of 5 um. No relief that diffracts is half as deep. The time that Blender takes to make the nodes of a material grows
# as the square of this number, and is some seconds for 64.
TERMS_MAX = 96
# Blender holds a picture as RGBA of 32 bits a channel.
BYTES_PER_TEXEL = 16
# The standard deviation in (u, v) of the widest kernel that lights and roughness ask for, and the fewest inner texels
# along an axis that still show a kernel.
_WIDEST_KERNEL, _INNER_MIN = 0.25, 8

# Rows and columns, or x and y.
Pair = tuple[int, int]


def level_count(sigma_b: float, inner: Pair) -> int:
    """Levels of a table with the given inner rows and columns.

    The last level is the first level whose kernel is as wide as lights and roughness ever ask for, or the last level
    that still has _INNER_MIN inner texels along each axis, whichever comes first."""
    wanted = math.ceil(math.log2(_WIDEST_KERNEL / sigma_b) - 1e-9)
    held = math.floor(math.log2(max(min(inner) - 1, 1) / (_INNER_MIN - 1)))
    return 1 + max(0, min(wanted, held))


def level_inner(inner: Pair, level: int) -> Pair:
    """Inner rows and columns of a level, from those of level 0."""
    return tuple(math.ceil((n - 1) / 2**level) + 1 for n in inner)


def first_stride(inner: Pair, levels: int) -> Pair:
    """Rows and columns of the picture that a tile of level 0 takes."""
    step = 2 ** (levels - 1)
    return tuple(math.ceil(n / step) * step + LEVEL_PADDING for n in inner)


def level_stride(stride: Pair, level: int) -> Pair:
    """Rows and columns of the picture that a tile of a level takes, if a tile of level 0 takes `stride`."""
    return tuple((n - LEVEL_PADDING) // 2**level + LEVEL_PADDING for n in stride)


def block_origin(block: Pair, stride: Pair, level: int) -> Pair:
    """Lower left texel (x, y) of a level's block of tiles, y counted upward from the bottom of the first block.

    `block` is the number of rows and columns of tiles in a block. `stride` is the number of rows and columns of the
    picture that a tile of level 0 takes."""
    if level == 0:
        return 0, 0
    (rows, columns), inner_rows = block, stride[0] - LEVEL_PADDING
    below = inner_rows - inner_rows // 2 ** (level - 1) + LEVEL_PADDING * (level - 1)
    return columns * stride[1], rows * below


def blocks_size(block: Pair, stride: Pair, levels: int) -> Pair:
    """Rows and columns of the picture that the blocks of all levels take together."""
    height, width = (count * n for count, n in zip(block, stride, strict=True))
    if levels > 1:
        width += block[1] * level_stride(stride, 1)[1]
        height = max(height, block_origin(block, stride, levels)[1])
    return height, width


def tile_block(terms: int, stride: Pair, levels: int, *, width_min: int = 1) -> Pair:
    """Rows and columns of tiles in a block, for the best picture that holds `terms` terms.

    A picture must be at least `width_min` wide, and no side may exceed PICTURE_SIDE_MAX. A picture whose longer side is
    at most ASPECT_MAX times its shorter side is better than any other. Among such pictures the smallest is the best,
    and among pictures of equal size the squarest.

    Raises GratingError for more than TERMS_MAX terms, and if every picture is too large for a graphics card."""
    if terms > TERMS_MAX:
        raise GratingError(
            f"a table of {terms} terms, for a relief too deep or a colour error too small: a material reads at most "
            f"{TERMS_MAX}; ask for a larger --delta-e, or crop the scan to a shallower part"
        )
    found = []
    for columns in range(1, terms + 1):
        block = math.ceil(terms / columns), columns
        height, width = blocks_size(block, stride, levels)
        short, long = sorted((height, max(width, width_min)))
        if long <= PICTURE_SIDE_MAX:
            found.append((max(long / short, ASPECT_MAX), short * long, long / short, block))
    if not found:
        raise GratingError(
            f"a table of {terms} tiles of {stride[1]} x {stride[0]} is larger than a graphics card takes; ask for a "
            "shorter --coherence-um"
        )
    return min(found)[-1]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimates the memory and the time of a bake before its transforms begin.

The constants are measured (`./dev bench memory` prints expected and measured figures side by side) on two cores of a
server, on pictures of 512 to 1024 pixels that are 40 to 200 um wide and 0.3 to 5 um high. The estimated memory is 1.5
to 2.4 times the measured one. The time is right to a factor of two there, and scales with the speed of other machines.
"""

import math

from ..base.memory import in_words, refuse_beyond_memory
from ..base.progress import Progress
from ..spectra.fast import Work
from ..surface.relief import SMALLER
from ..table.atlas import Layout
from ..table.tiling import BYTES_PER_TEXEL, TILE_PADDING, cell_for, grid
from .needs import Needs
from .resolution import texel_middles

# Bytes per byte of the series, per bin of a transform, per transform (the probe), and constant (tables).
_PER_SERIES_BYTE, _PER_FINE_BIN, _PER_TRANSFORM, _ALWAYS = 3.6, 16, 4 << 20, 100 << 20
# Seconds per bin, transform, node of w (about as many as transforms) and wavelength; and constant.
_SECONDS_EACH, _SECONDS_ALWAYS = 3e-10, 2.0


def expected_bytes(work: Work) -> float:
    """The peak memory that a bake needs from its first transform on, in addition to the memory it already has."""
    series = 4 * work.transforms * work.bins
    return _PER_SERIES_BYTE * series + _PER_FINE_BIN * work.fine_bins + _PER_TRANSFORM * work.transforms + _ALWAYS


def expected_seconds(work: Work, wavelengths: int) -> float:
    """The time of a bake in seconds."""
    return _SECONDS_ALWAYS + _SECONDS_EACH * wavelengths * work.transforms**2 * work.bins


def tell(work: Work, wavelengths: int, *, scans: int, progress: Progress) -> None:
    """Report to `progress` the expected memory and time of a bake of `scans` scans, all like the first.

    Raises GratingError if the memory is more than half of the free memory."""
    needed, seconds = scans * expected_bytes(work), scans * expected_seconds(work, wavelengths)
    refuse_beyond_memory(needed, "the bake", SMALLER)
    duration = f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"
    progress(f"expects {in_words(needed)} and about {duration}", 0.0)


def expected_table_bytes(layout: Layout, needs: Needs) -> tuple[int, int]:
    """Estimate a table's bytes in Blender if it holds only the needs, from the layout of a whole table of the same
    surface; returns them and the whole table's bytes.

    The tiles are cropped to the region. Their texels grow with the kernel if the scene's lights and pixels are wider
    than it. Of the functions of w, two are a constant and a slope; the number of the others is taken as proportional to
    the range of w."""
    sigma_b = max(layout.sigma_b, needs.kernel)
    texel = layout.texel * sigma_b / layout.sigma_b
    tile = tuple(len(texel_middles(*side, texel)) for side in (needs.region.v, needs.region.u))
    side = math.ceil(4 / texel - 1e-9) + 1
    low, high = needs.w
    terms = min(layout.terms, 2 + round((layout.terms - 2) * (high - low) / 2))
    rows, columns = (count - 2 * TILE_PADDING for count in tile)
    spacing = layout.spacing
    cell = cell_for(
        terms, (rows, columns), sigma_b, whole=(side, side), spacings=(spacing,),
        coarser=layout.level_coarser / spacing.stretch,
    )  # fmt: skip
    width_min = layout.zero_order_samples + 1
    down, across = grid(terms, cell.size, width_min=width_min)
    width = max(across * cell.size[1], width_min)
    texels = (down * cell.size[0] + layout.strip_rows) * width
    return BYTES_PER_TEXEL * texels, BYTES_PER_TEXEL * layout.width * layout.height

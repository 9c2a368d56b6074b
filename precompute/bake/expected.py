# SPDX-License-Identifier: GPL-3.0-or-later
"""The memory and the time that a bake is expected to take, told before its transforms begin.

The constants are measured (`python -m benchmarks memory` prints expected and measured figures side by side) on two
cores of a server, on pictures of 512 to 1024 pixels that are 40 to 200 um wide and 0.3 to 5 um high. Memory comes out
up to a third above what is taken; time is right to a factor of two there, and in proportion on other machines.
"""

from ..base.memory import in_words, refuse_beyond_memory
from ..base.progress import Progress
from ..spectra.fast import Work
from ..surface.relief import SMALLER

# Bytes for each byte of the series, for each bin of a transform, for each transform (the probe), and for tables.
_PER_SERIES_BYTE, _PER_FINE_BIN, _PER_TRANSFORM, _ALWAYS = 3.6, 16, 4 << 20, 100 << 20
# Seconds for each bin, transform, node of w (there are about as many as transforms) and wavelength, and always.
_SECONDS_EACH, _SECONDS_ALWAYS = 1e-9, 8.0


def expected_bytes(work: Work) -> float:
    """The most memory that a bake takes from its first transform on, over what it has taken before."""
    series = 4 * work.transforms * work.bins
    return _PER_SERIES_BYTE * series + _PER_FINE_BIN * work.fine_bins + _PER_TRANSFORM * work.transforms + _ALWAYS


def expected_seconds(work: Work, wavelengths: int) -> float:
    """The time that a bake takes in seconds."""
    return _SECONDS_ALWAYS + _SECONDS_EACH * wavelengths * work.transforms**2 * work.bins


def tell(work: Work, wavelengths: int, *, scans: int, progress: Progress) -> None:
    """Tell `progress` what a bake of so many scans, all like the first, will take.

    Raises GratingError where that is more than half of the memory that is free."""
    needed, seconds = scans * expected_bytes(work), scans * expected_seconds(work, wavelengths)
    refuse_beyond_memory(needed, "the bake", SMALLER)
    duration = f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"
    progress(f"expects {in_words(needed)} and about {duration}", 0.0)

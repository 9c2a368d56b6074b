# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a surface: the list of all readers, and what follows from the list.

Detection, error messages, the filter of the import dialog and the formats that it names all come from READERS.
"""

from __future__ import annotations

import stat
from pathlib import Path

import numpy as np

from ...base.failure import GratingError, Setting
from ..height_map import SAMPLE_PREFIX, HeightMap
from ..samples.catalogue import make_sample
from .agilent import AGILENT
from .asd import ASD
from .channels import other_way
from .digital_surf import DIGITAL_SURF
from .exr_picture import EXR
from .gsf import GSF
from .gwy import GWYDDION
from .gwyddion_text import GWYDDION_TEXT
from .hdf5 import HDF5
from .ibw import ASYLUM
from .image import BMP, PNG, TIFF
from .jpk import JPK
from .nanonis import NANONIS
from .nanoscope import NANOSCOPE
from .nid import NANOSURF
from .npy import NPY
from .ntmdt import NT_MDT
from .park import PARK
from .reader import BEGINNING_BYTES, Reader
from .sdf import SDF
from .text_arrays import MATRIX, XYZ
from .unread import CONVERT, known_fault
from .wsxm import WSXM
from .x3p import X3P

# The first that knows a file's beginning reads it: instruments' TIFFs before pictures, texts with a header before bare
# numbers.
READERS: tuple[Reader, ...] = (
    NANOSURF, GWYDDION, GSF, NANOSCOPE, ASYLUM, JPK, PARK, WSXM, AGILENT, NT_MDT, NANONIS, HDF5, ASD, DIGITAL_SURF, SDF,
    X3P, GWYDDION_TEXT, PNG, TIFF, BMP, EXR, NPY, XYZ, MATRIX,
)  # fmt: skip

# The least rows and columns of a map. Fewer are a profile, or the beginning of a scan.
_SIDE_MIN = 8
# Sides of a pixel in metres: a picometre is a hundredth of an atom, and a pixel of a millimetre is no scan.
_PIXEL_M = (1e-12, 1e-3)
# The highest relief in metres: a thousand wavelengths, far beyond scalar diffraction.
_RELIEF_MAX_M = 1e-3
# The farthest that heights may lie from 0, in metres. Double precision resolves a femtometre there, and no microscope
# reaches farther.
_FARTHEST_M = 1.0


def read_height_map(
    source: str, size_um: float | None = None, height_nm: float | None = None, *, channel: str | None = None
) -> HeightMap:
    """Read "sample:NAME" or a file, as measured: not levelled, NaN where pixels are missing.

    size_um    width of a picture in micrometres; None for any other source
    height_nm  height of white over black of a picture in nanometres; None for any other source
    channel    one of an instrument's channels by its label or the beginning of the label, in any case; None for the
               topography, for a picture and for a sample

    Raises GratingError with one line that names the source, the fault and the remedy, also where a value is given
    that the source does not need, and where pixels or relief are beyond reason.
    """
    if source.startswith(SAMPLE_PREFIX):
        _refuse(source, "a sample", size_um=size_um, height_nm=height_nm, channel=channel)
        return make_sample(source.removeprefix(SAMPLE_PREFIX))
    reader = reader_of(source)
    if reader.needs_size:
        _refuse(source, f"a {reader.name} file", channel=channel)
    else:
        _refuse(source, f"a {reader.name} file", size_um=size_um, height_nm=height_nm)
    try:
        height_map = reader.read(source, size_um=size_um, height_nm=height_nm, channel=channel)
    except OSError as error:
        raise _unreadable(source, error) from error
    except MemoryError as error:
        raise GratingError(source, "larger than the memory that is free", "crop or reduce the scan") from error
    _refuse_beyond_reason(height_map)
    return height_map


def read_other_way(height_map: HeightMap) -> HeightMap | None:
    """The scan of the same quantity on the other way over the lines, out of the same file; None where the file holds
    none.

    Both lie alike: a place of the surface is at the same row and column. So do the real files of Nanosurf, NanoScope,
    Asylum and JPK, and a reader turns back what its format stores mirrored (nanonis.py). Raises GratingError as
    `read_height_map` does."""
    label = other_way(height_map.channel, height_map.channels)
    return None if label is None else read_height_map(height_map.source, channel=label)


def reader_of(source: str) -> Reader:
    """The reader of a file, chosen by the file's first bytes.

    Raises GratingError where no reader knows these bytes, where the extension is that of another format, and where the
    file is empty, a directory, no file at all (a fifo would be waited for) or cannot be opened."""
    path = Path(source)
    try:
        kind = path.stat().st_mode
        if stat.S_ISDIR(kind):
            raise GratingError(source, "is a directory", "name one file in it")
        if not stat.S_ISREG(kind):
            raise GratingError(source, "is no file", "name a file of heights")
        with path.open("rb") as file:
            beginning = file.read(BEGINNING_BYTES)
    except (OSError, ValueError) as error:  # ValueError: a name with a zero byte
        raise _unreadable(source, error) from error
    if not beginning:
        raise GratingError(source, "the file is empty", "copy it again")
    held = next((reader for reader in READERS if reader.can_read(beginning)), None)
    named = [reader for reader in READERS if path.suffix.lower() in reader.extensions]
    if held is None and (fault := known_fault(beginning)):
        raise GratingError(source, *fault)
    if held is None and not named:
        raise GratingError(
            source, "not a format that is read here", f"{CONVERT}, or export it as one of {', '.join(extensions())}"
        )
    if held is None:
        raise GratingError(
            source,
            f"named {path.suffix} but does not begin like {' or '.join(reader.name for reader in named)}: damaged, "
            "misnamed or of another program",
            f"export it again, or {CONVERT}",
        )
    if named and held not in named:
        raise GratingError(
            source, f"named {path.suffix} but holds {held.name} data", f"rename it to {held.extensions[0]}"
        )
    return held


def extensions() -> tuple[str, ...]:
    """The extensions of all formats with their dots, each once, in the order of READERS; of numbers that count files
    (.000 to .999) only the first."""
    found = dict.fromkeys(extension for reader in READERS for extension in reader.extensions)
    return tuple(extension for extension in found if not extension[1:].isdigit() or extension == ".000")


def file_filter() -> str:
    """The filter of a file dialog: "*.png;*.tif;...", every extension once, and a pattern for all that count files."""
    return ";".join(f"*{extension}" for extension in extensions()).replace("*.000", "*.[0-9][0-9][0-9]")


def dropped() -> str:
    """The extensions of files that may be dropped: ".nid;.gwy;...", those of formats that carry their sizes.

    Files that are counted are named up to .019. An extension that formats without sizes have too is left to others who
    take dropped files: a .tif is a texture more often than a scan."""
    bare = {extension for reader in READERS if reader.needs_size for extension in reader.extensions}
    sized = dict.fromkeys(extension for reader in READERS if not reader.needs_size for extension in reader.extensions)
    return ";".join(each for each in sized if each not in bare and (not each[1:].isdigit() or int(each[1:]) < 20))


def described() -> str:
    """The formats in words, those that carry sizes first: "Nanosurf .nid, ...; and, with a size given, PNG .png"."""
    sized, bare = (
        ", ".join(f"{reader.name} {reader.extensions[0]}" for reader in READERS if reader.needs_size is needs)
        for needs in (False, True)
    )
    return f"{sized}; and, with a size given, {bare}"


def _refuse(source: str, what: str, **options: object) -> None:
    """Refuse a value that would be ignored: the user believes that it counts."""
    given = [Setting[name.upper()] for name, value in options.items() if value is not None]
    if given:
        remedy = ["leave out ", given[0], *(part for setting in given[1:] for part in (" and ", setting))]
        raise GratingError(source, f"{what} tells this by itself", remedy)


def _refuse_beyond_reason(height_map: HeightMap) -> None:
    """Raise GratingError where pixels or relief are of a size that no scan of a diffracting surface has.

    Such sizes are the wrong unit or damage, and would cost gigabytes or overflow later on. Files of a few rows or
    columns are refused too: they are profiles."""
    source = height_map.source
    if min(height_map.height_m.shape) < _SIDE_MIN:
        raise GratingError(
            source,
            f"{height_map.rows} x {height_map.cols} points are a profile or a part of a scan, not a map",
            f"give a scan of at least {_SIDE_MIN} rows and {_SIDE_MIN} columns",
        )
    for side in height_map.pixel_size_m:
        if not _PIXEL_M[0] <= side <= _PIXEL_M[1]:
            raise GratingError(
                source, f"a pixel of {side:.3g} m is not between 1 pm and 1 mm", "give the real size of the scan"
            )
    low, high = float(np.nanmin(height_map.height_m)), float(np.nanmax(height_map.height_m))
    if not high - low <= _RELIEF_MAX_M:
        raise GratingError(
            source, f"a relief of {high - low:.3g} m is higher than 1 mm", "give the real heights, or export them again"
        )
    if max(-low, high) > _FARTHEST_M:
        raise GratingError(
            source,
            f"heights of {high:.3g} m lie more than 1 m above or below 0",
            "export them as heights over the surface's mean",
        )


def _unreadable(source: str, error: OSError | ValueError) -> GratingError:
    what = getattr(error, "strerror", None) or error
    return GratingError(source, f"cannot be read ({what})", "check path and permissions")

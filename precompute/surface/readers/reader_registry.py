# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of all readers, and functions that read any supported file.

Format detection, error messages, and the filter and formats of the import dialog all derive from READERS."""

from __future__ import annotations

import stat
from pathlib import Path

import numpy as np

from ...base.failure import GratingError, Setting
from ..generated.catalogue import make_grating
from ..height_map import GRATING_PREFIX, SAMPLE_PREFIX, HeightMap, is_synthetic
from ..samples.catalogue import make_sample
from .agilent import AGILENT
from .asd import ASD
from .digital_surf import DIGITAL_SURF
from .gwyddion import GSF, GWYDDION, GWYDDION_TEXT
from .hdf5 import HDF5
from .ibw import ASYLUM
from .iso_25178 import SDF, X3P
from .nanonis import NANONIS
from .nanoscope import NANOSCOPE
from .nid import NANOSURF
from .ntmdt import NT_MDT
from .pictures import BMP, EXR, NPY, PNG, TIFF
from .scan_file import BEGINNING_BYTES, CONVERT, Reader, other_way
from .text_tables import MATRIX, XYZ
from .tiff_scans import JPK, PARK
from .unread_formats import known_fault
from .wsxm import WSXM

# The first reader that recognises a file reads it: instrument TIFFs before pictures, headed texts before bare numbers.
READERS: tuple[Reader, ...] = (
    NANOSURF, GWYDDION, GSF, NANOSCOPE, ASYLUM, JPK, PARK, WSXM, AGILENT, NT_MDT, NANONIS, HDF5, ASD, DIGITAL_SURF, SDF,
    X3P, GWYDDION_TEXT, PNG, TIFF, BMP, EXR, NPY, XYZ, MATRIX,
)  # fmt: skip

# The fewest rows and columns. A smaller map is a profile, or an interrupted scan.
_SIDE_MIN = 8
# The limits of a pixel's side in metres: a picometre is a hundredth of an atom, a millimetre too coarse for a scan.
_PIXEL_M = (1e-12, 1e-3)
# The highest relief in metres: a thousand wavelengths, far beyond scalar diffraction.
_RELIEF_MAX_M = 1e-3
# The largest distance of a height from 0, in metres, where double precision resolves a femtometre.
_FARTHEST_M = 1.0


def read_height_map(
    source: str, size_um: float | None = None, height_nm: float | None = None, *, channel: str | None = None
) -> HeightMap:
    """Read "sample:NAME", "grating:KIND?PARAMETERS" or a file, as measured: not levelled, NaN for missing pixels.

    size_um    width in micrometres: of a picture, or in place of a file's own; None for synthetic surfaces
    height_nm  height of white over black of a picture in nanometres; None for other sources
    channel    label of an instrument's channel, or the label's beginning, in any case; None for the topography, and for
               pictures and synthetic surfaces

    Raises GratingError, also for a value that the source does not need, and for implausible pixels or relief.

    >>> scan = read_height_map("sample:blazed")
    >>> scan.height_m.shape, f"{scan.size_m[1] * 1e6:.0f} um wide"
    ((832, 832), '65 um wide')"""
    if is_synthetic(source):
        what = "a grating by its parameters" if source.startswith(GRATING_PREFIX) else "a sample"
        _refuse(source, what, size_um=size_um, height_nm=height_nm, channel=channel)
        if source.startswith(GRATING_PREFIX):
            return make_grating(source)
        return make_sample(source.removeprefix(SAMPLE_PREFIX))
    reader = reader_of(source)
    if reader.needs_size:
        _refuse(source, f"a {reader.name} file", channel=channel)
    else:
        _refuse(source, f"a {reader.name} file", height_nm=height_nm)
    try:
        height_map = reader.read(source, size_um=size_um, height_nm=height_nm, channel=channel)
    except OSError as error:
        raise _unreadable(source, error) from error
    except MemoryError as error:
        raise GratingError(source, "larger than the free memory", "crop or reduce the scan") from error
    _refuse_beyond_reason(height_map)
    return height_map


def read_other_way(height_map: HeightMap) -> HeightMap | None:
    """Read the same quantity's scan in the opposite direction (trace or retrace); None if the file has none.

    A place of the surface has the same row and column in both scans, as in real files of Nanosurf, NanoScope, Asylum
    and JPK. Readers of mirrored formats turn them back (nanonis.py). Raises GratingError as `read_height_map` does."""
    label = other_way(height_map.channel, height_map.channels)
    if label is None:
        return None
    width_um = None if height_map.stored_width_m is None else height_map.size_m[1] * 1e6
    return read_height_map(height_map.source, width_um, channel=label)


def reader_of(source: str) -> Reader:
    """Choose a file's reader by the file's first bytes.

    Raises GratingError for unknown bytes, another format's extension, and empty, unreadable or irregular files."""
    path = Path(source)
    try:
        kind = path.stat().st_mode
        if stat.S_ISDIR(kind):
            raise GratingError(source, "is a directory", "name one file in it")
        if not stat.S_ISREG(kind):
            raise GratingError(source, "is not a file", "name a file of heights")
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
    """List the extensions of all formats in the order of READERS; .000 stands for .000 to .999."""
    found = dict.fromkeys(extension for reader in READERS for extension in reader.extensions)
    return tuple(extension for extension in found if not extension[1:].isdigit() or extension == ".000")


def file_filter() -> str:
    """Return the filter of a file dialog: "*.png;*.tif;...", with one pattern for .000 to .999."""
    return ";".join(f"*{extension}" for extension in extensions()).replace("*.000", "*.[0-9][0-9][0-9]")


def dropped() -> str:
    """Return the extensions for drag and drop, ".nid;.gwy;...": formats that hold their sizes.

    It excludes extensions shared with formats without sizes (a .tif is usually a texture), and .020 to .999."""
    bare = {extension for reader in READERS if reader.needs_size for extension in reader.extensions}
    sized = dict.fromkeys(extension for reader in READERS if not reader.needs_size for extension in reader.extensions)
    return ";".join(each for each in sized if each not in bare and (not each[1:].isdigit() or int(each[1:]) < 20))


def described() -> str:
    """Describe the formats, those that hold sizes first: "Nanosurf .nid, ...; and, with a size given, PNG .png"."""
    sized, bare = (
        ", ".join(f"{reader.name} {reader.extensions[0]}" for reader in READERS if reader.needs_size is needs)
        for needs in (False, True)
    )
    return f"{sized}; and, with a size given, {bare}"


def _refuse(source: str, what: str, **options: object) -> None:
    """Raise GratingError for values that would be ignored, since the user expects them to count."""
    given = [Setting[name.upper()] for name, value in options.items() if value is not None]
    if given:
        remedy = ["leave out ", given[0], *(part for setting in given[1:] for part in (" and ", setting))]
        raise GratingError(source, f"{what} does not need it", remedy)


def _refuse_beyond_reason(height_map: HeightMap) -> None:
    """Raise GratingError for implausible pixels or relief, and for profiles of a few rows or columns.

    Implausible sizes mean a wrong unit or damage, and would cost gigabytes or overflow later."""
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
                source,
                f"a pixel of {side:.3g} m is not between 1 pm and 1 mm",
                ("give ", Setting.SIZE_UM, ", the real width of the scan in micrometres"),
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

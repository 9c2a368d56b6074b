# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a surface: the list of all readers, and what follows from the list.

Detection, error messages, the filter of the import dialog and the formats that it names all come from READERS.
"""

from __future__ import annotations

from pathlib import Path

from ...base.failure import GratingError
from ..height_map import SAMPLE_PREFIX, HeightMap
from ..samples.catalogue import make_sample
from .gwy import GWYDDION
from .image import BMP, PNG, TIFF
from .nid import NANOSURF
from .reader import BEGINNING_BYTES, Reader

READERS: tuple[Reader, ...] = (PNG, TIFF, BMP, NANOSURF, GWYDDION)


def read_height_map(
    source: str, size_um: float | None = None, height_nm: float | None = None, *, channel: str | None = None
) -> HeightMap:
    """Read "sample:NAME" or a file, as measured: not levelled, NaN where pixels are missing.

    size_um    width of a picture in micrometres; None for any other source
    height_nm  height of white over black of a picture in nanometres; None for any other source
    channel    one of an instrument's channels by its label or the beginning of the label, in any case; None for the
               topography, for a picture and for a sample

    Raises GratingError with one line that names the source, the fault and the remedy, also where a value is given
    that the source does not need.
    """
    if source.startswith(SAMPLE_PREFIX):
        _refuse(source, "a sample", size_um=size_um, height_nm=height_nm, channel=channel)
        return make_sample(source.removeprefix(SAMPLE_PREFIX))
    reader = reader_of(source)
    if reader.needs_size:
        _refuse(source, "a picture", channel=channel)
    else:
        _refuse(source, f"a {reader.name} file", size_um=size_um, height_nm=height_nm)
    try:
        return reader.read(source, size_um=size_um, height_nm=height_nm, channel=channel)
    except OSError as error:
        raise _unreadable(source, error) from error


def reader_of(source: str) -> Reader:
    """The reader of a file, chosen by the file's first bytes.

    Raises GratingError where no reader knows these bytes, where the extension is that of another format, and where the
    file is empty, a directory or cannot be opened."""
    path = Path(source)
    if path.is_dir():
        raise GratingError(f"{source}: is a directory; name one file in it")
    try:
        with path.open("rb") as file:
            beginning = file.read(BEGINNING_BYTES)
    except OSError as error:
        raise _unreadable(source, error) from error
    if not beginning:
        raise GratingError(f"{source}: the file is empty; copy it again")
    held = next((reader for reader in READERS if reader.can_read(beginning)), None)
    named = next((reader for reader in READERS if path.suffix.lower() in reader.extensions), None)
    if held is None and named is None:
        raise GratingError(f"{source}: not a format that is read here; export it as one of {', '.join(extensions())}")
    if held is None:
        raise GratingError(
            f"{source}: named {path.suffix} but does not begin like {named.name}; "
            "the file is damaged or misnamed, export it again"
        )
    if named is not None and named is not held:
        raise GratingError(
            f"{source}: named {path.suffix} but holds {held.name} data; rename it to {held.extensions[0]}"
        )
    return held


def extensions() -> tuple[str, ...]:
    """The extensions of all formats with their dots, in the order of READERS."""
    return tuple(extension for reader in READERS for extension in reader.extensions)


def file_filter() -> str:
    """The filter of a file dialog: "*.png;*.tif;...", every extension once."""
    return ";".join(f"*{extension}" for extension in extensions())


def described() -> str:
    """The formats in words, files of instruments first: "Nanosurf .nid, ..., or a grey PNG, TIFF or BMP picture"."""
    instruments = [f"{reader.name} {reader.extensions[0]}" for reader in READERS if not reader.needs_size]
    *pictures, last = (reader.name for reader in READERS if reader.needs_size)
    return f"{', '.join(instruments)}, or a grey {', '.join(pictures)} or {last} picture"


def _refuse(source: str, what: str, **options: object) -> None:
    """Refuse a value that would be ignored: the user believes that it counts."""
    given = ["--" + name.replace("_", "-") for name, value in options.items() if value is not None]
    if given:
        raise GratingError(f"{source}: {what} tells this by itself; leave out {' and '.join(given)}")


def _unreadable(source: str, error: OSError) -> GratingError:
    return GratingError(f"{source}: cannot be read ({error.strerror or error}); check path and permissions")

# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a surface: one registry of file formats, by the bytes that begin a file and by its extension."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ...base.failure import GratingError
from ..height_map import HeightMap
from ..samples.catalogue import make_sample
from . import gwy, image, nid

SAMPLE_PREFIX = "sample:"


@dataclass(frozen=True)
class Format:
    """A file format.

    magic     beginnings of a file of this format
    measured  the file carries its own size and units: read(source, channel);
              else they are asked for: read(source, size_um, height_nm)
    """

    name: str
    extensions: tuple[str, ...]
    magic: tuple[bytes, ...]
    measured: bool
    read: Callable[..., HeightMap]


FORMATS = (
    Format("PNG", (".png",), (b"\x89PNG\r\n\x1a\n",), False, image.read),
    Format("TIFF", (".tif", ".tiff"), (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"), False, image.read),
    Format("BMP", (".bmp",), (b"BM",), False, image.read),
    Format("Nanosurf", (".nid",), (nid.MAGIC,), True, nid.read),
    Format("Gwyddion", (".gwy",), (gwy.MAGIC,), True, gwy.read),
)


_LONGEST_MAGIC = max(len(magic) for format_ in FORMATS for magic in format_.magic)


def read_height_map(
    source: str, size_um: float | None = None, height_nm: float | None = None, channel: str | None = None
) -> HeightMap:
    """Read "sample:NAME" or a file, as measured: not levelled, NaN where pixels are missing.

    size_um and height_nm are what a picture cannot tell (see image.read) and are refused where a source has
    its own; channel names one of an instrument's channels, by default the topography. Raises GratingError
    with one line that names the source, the fault and the remedy.
    """
    if source.startswith(SAMPLE_PREFIX):
        _refuse(source, "a sample", size_um=size_um, height_nm=height_nm, channel=channel)
        return make_sample(source.removeprefix(SAMPLE_PREFIX))
    format_ = _format(source)
    try:
        if format_.measured:
            _refuse(source, f"a {format_.name} file", size_um=size_um, height_nm=height_nm)
            return format_.read(source, channel)
        _refuse(source, "a picture", channel=channel)
        return format_.read(source, size_um, height_nm)
    except OSError as error:
        raise _unreadable(source, error) from error


def _format(source: str) -> Format:
    """The format that the file's first bytes tell; an extension that says otherwise is an error, no hint."""
    path = Path(source)
    if path.is_dir():
        raise GratingError(f"{source}: is a directory; name one file in it")
    try:
        with path.open("rb") as file:
            beginning = file.read(_LONGEST_MAGIC)
    except OSError as error:
        raise _unreadable(source, error) from error
    if not beginning:
        raise GratingError(f"{source}: the file is empty; copy it again")
    held = next((each for each in FORMATS if beginning.startswith(each.magic)), None)
    named = next((each for each in FORMATS if path.suffix.lower() in each.extensions), None)
    if held is None and named is None:
        known = ", ".join(extension for each in FORMATS for extension in each.extensions)
        raise GratingError(f"{source}: not a format that is read here; export it as one of {known}")
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


def _refuse(source: str, what: str, **options: object) -> None:
    """A value that would be ignored is an error: the user believes that it counts."""
    given = ["--" + name.replace("_", "-") for name, value in options.items() if value is not None]
    if given:
        raise GratingError(f"{source}: {what} tells this by itself; leave out {' and '.join(given)}")


def _unreadable(source: str, error: OSError) -> GratingError:
    return GratingError(f"{source}: cannot be read ({error.strerror or error}); check path and permissions")

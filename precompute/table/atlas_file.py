# SPDX-License-Identifier: GPL-3.0-or-later
"""The OpenEXR files that hold a table or a sample set.

Files are written completely or not at all (base/files.py). A header must fit the picture and have values that a bake
can have.
"""

import json
from collections.abc import Mapping
from dataclasses import Field, asdict, fields
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from ..base import files
from ..base.exr import Picture, open_picture
from ..base.failure import GratingError
from ..base.packages import bundled
from ..base.strict_json import LARGEST_BYTES, parse_json
from ..reflectance.matter import DIELECTRIC, MIRROR, Matter
from ..reflectance.matter_text import parse as parse_matter
from .atlas import Layout, unpack
from .table import Table

# The version of the files. A reader refuses all others.
FORMAT = 14
# The header's attribute that holds the record.
HEADER_KEY = "natural_gratings"
# The types of a record's optional values beside `format` and `layout` (bake/bake_folder.py).
_PROVENANCE = {
    "source": str, "channel": str, "model": str, "precision": str, "height_range_m": float, "coherence_um": float,
    "coherence_areas": float, "asked_delta_e": float, "heights_sha256": list, "pixel_size_m": list, "shape": list,
    "request": dict, "delta_e": dict, "extrema": list,
}  # fmt: skip


class AnyLayout(Protocol):
    """The protocol of all pictures' layouts: dataclasses whose fields go into the header."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __init__(self, **values: Any) -> None: ...

    @property
    def height(self) -> int: ...

    @property
    def width(self) -> int: ...

    @property
    def is_valid(self) -> bool: ...


_Layout = TypeVar("_Layout", bound=AnyLayout)


def write_together(pictures: Mapping[Path, tuple[np.ndarray, AnyLayout]], provenance: Mapping[str, Any]) -> None:
    """Write images (height, width, 3 or 4), row 0 at the bottom, each with its layout, by path; all or none.

    The header's attribute `natural_gratings` is JSON: format, layout, and the keys of `provenance`. Raises
    GratingError, with the path, if a file cannot be written or its header is too long to be read."""
    writers = {}
    for path, (image, layout) in pictures.items():
        record = json.dumps({"format": FORMAT, "layout": asdict(layout), **provenance}, sort_keys=True)
        if len(record) > LARGEST_BYTES:
            raise GratingError(path, "its header would be longer than is read", "bake fewer scans together")
        writers[path] = partial(write_exr, image=image, attributes={HEADER_KEY: record})
    files.write_together(writers)


def write_exr(path: Path, image: np.ndarray, attributes: Mapping[str, str]) -> None:
    """Write an image (height, width, 3 or 4), row 0 at the bottom, as OpenEXR with attributes in its header.

    Raises OSError if it cannot be written, GratingError if OpenEXR cannot be loaded."""
    OpenEXR = bundled("OpenEXR")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    channels = {"RGBA"[: image.shape[2]]: np.ascontiguousarray(image[::-1])}
    # Given a path, OpenEXR fails outside UTF-8 and hides the system's error messages.
    with OpenEXR.File(header, channels) as picture, path.open("wb") as file:
        picture.write(file)


def check_can_write() -> None:
    """Raises GratingError if no picture can be written, before a bake starts."""
    bundled("OpenEXR")


def read_header(path: Path) -> tuple[Layout, dict[str, Any]]:
    """Layout and header record of an atlas. Raises GratingError if the file is not an atlas."""
    return _parse(open_picture(path))


def read_sound_header(path: Path) -> tuple[Layout, dict[str, Any]]:
    """read_header for a file that Blender is going to read: checks every pixel too.

    Raises GratingError if the file is not an atlas, its picture is damaged or a pixel is not a number."""
    picture = open_picture(path)
    found = _parse(picture)
    picture.check_pixels()
    return found


def read(path: Path) -> tuple[Table, dict[str, Any]]:
    """Read the bake in an atlas file, and its header record. Raises GratingError as read_sound_header does."""
    picture = open_picture(path)
    layout, record = _parse(picture)
    return unpack(picture.pixels(), layout), record


def parse(
    picture: Picture, layout_type: type[_Layout], *, channels: str = "RGB",
    expected: tuple[str, str] = ("bake", "give the .exr that `bake` wrote"),
) -> tuple[_Layout, dict[str, Any]]:  # fmt: skip
    """Layout and record of a picture's header.

    Raises GratingError, naming what was `expected`, if the header's layout is missing or does not fit the picture."""
    path = picture.path
    record = _record_in(picture, expected)
    if record["format"] != FORMAT:
        raise GratingError(path, f"made by another version (format {record['format']!r:.20})", "bake it again")
    kinds, values = {field.name: field.type for field in fields(layout_type)}, record.get("layout")
    if not isinstance(values, dict) or set(values) != set(kinds):
        raise GratingError(path, f"not a Natural Gratings {expected[0]}", expected[1])
    told = {name: kind for name, kind in _PROVENANCE.items() if name in record}
    for name, kind in (kinds | told).items():
        value = values[name] if name in kinds else record[name]
        # JSON may write 2.0 as 2; bool is no number here.
        if type(value) is not kind and (kind, type(value)) != (float, int):
            raise GratingError(path, f"its header's {name} is {value!r:.40}", "bake it again")
    layout = layout_type(**values)
    if not layout.is_valid:
        raise GratingError(path, "its header says what no picture of this kind can have", "bake it again")
    if picture.shape != (layout.height, layout.width, len(channels)):
        raise GratingError(path, "the picture is not the size that its header says", "bake it again")
    return layout, record


def read_record(path: Path) -> dict[str, Any]:
    """The header record of a table or a sample set, whose values are not checked. Raises GratingError if there is
    none."""
    return _record_in(open_picture(path), ("bake", "give the .exr that `bake` wrote"))


def _record_in(picture: Picture, expected: tuple[str, str]) -> dict[str, Any]:
    if HEADER_KEY in picture.texts:
        record = parse_json(picture.texts[HEADER_KEY], picture.path, "bake it again", part="its header: ")
        if isinstance(record, dict) and "format" in record:
            return record
    raise GratingError(picture.path, f"not a Natural Gratings {expected[0]}", expected[1])


def _parse(picture: Picture) -> tuple[Layout, dict[str, Any]]:
    """Layout and record of an atlas. The record must match the pixels' precision, for a sample set as well."""
    layout, record = parse(picture, Layout)
    precision = np.dtype(picture.precision).name
    if record.get("precision", precision) != precision:
        told = f"holds {precision}, not its header's {record['precision']!r:.20}"
        raise GratingError(picture.path, told, "bake it again")
    matter = matter_in(layout, record, picture.path)
    if (matter.ratio_ior, matter.plate_ior) != (layout.ratio_ior, layout.plate_ior):
        raise GratingError(picture.path, "its header's matter does not fit its picture", "bake it again")
    return layout, record


def matter_in(layout: Layout, record: dict[str, Any], path: Path) -> Matter:
    """The matter in the header record of an atlas. If the record names none, it is a mirror for a table that holds a
    reflectance, else a dielectric. Raises GratingError if the record's text is no matter."""
    unnamed = MIRROR if layout.holds_reflectance else DIELECTRIC
    text = record.get("request", {}).get("matter", unnamed)
    if not isinstance(text, str):
        raise GratingError(path, f"its header's matter is {text!r:.40}", "bake it again")
    try:
        return parse_matter(text)
    except GratingError as error:
        raise GratingError(path, f"its header's matter is {text!r:.40}", "bake it again") from error

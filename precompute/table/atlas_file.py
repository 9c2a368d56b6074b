# SPDX-License-Identifier: GPL-3.0-or-later
"""The OpenEXR files that hold a table or a sample set.

They are written whole or not at all. Their headers are believed only if they fit the picture.
"""

import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import numpy as np
import OpenEXR

from ..base.failure import GratingError
from .atlas import Layout, unpack
from .table import Table

# The version of the files. A reader refuses every other.
FORMAT = 6
# The header's attribute that holds the record.
HEADER_KEY = "natural_gratings"


def write_together(pictures: Mapping[Path, tuple[np.ndarray, object]], provenance: dict) -> None:
    """Write images (height, width, 3 or 4), row 0 at the bottom, each with its layout, by path.

    They are written under temporary names and renamed once all of them are whole, so that a broken run leaves no half
    file behind. The header's attribute `natural_gratings` is JSON: format, layout, and the keys of `provenance`.

    Raises GratingError if OpenEXR cannot write one of them, OSError if one cannot be renamed."""
    # Blender and OpenEXR tell the kind of a file by its ending, so the temporary name keeps it.
    temporary = {path: path.with_name(f".{path.stem}.{os.getpid()}.partial.exr") for path in pictures}
    try:
        for path, (image, layout) in pictures.items():
            _write(temporary[path], image, {"format": FORMAT, "layout": asdict(layout), **provenance})
        for path in pictures:
            os.replace(temporary[path], path)
    except RuntimeError as error:  # OpenEXR raises this for every error of the system
        raise GratingError(f"{path}: cannot be written ({error}); check the folder and its space") from error
    finally:
        for left in temporary.values():
            left.unlink(missing_ok=True)


def _write(path: Path, image: np.ndarray, record: dict) -> None:
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        HEADER_KEY: json.dumps(record, sort_keys=True),
    }
    with OpenEXR.File(header, {"RGBA"[: image.shape[2]]: np.ascontiguousarray(image[::-1])}) as file:
        file.write(str(path))


def read_header(path: Path) -> tuple[Layout, dict]:
    """Layout and whole header record of an atlas. Raises GratingError if the file is not an atlas."""
    return parse(path, open_file(path, header_only=True)[0])


def read(path: Path) -> tuple[Table, dict]:
    """The bake in an atlas file, and its header record. Raises GratingError if the file is not an atlas."""
    header, channels = open_file(path, header_only=False)
    layout, record = parse(path, header)
    return unpack(image_of(path, channels, (layout.height, layout.width, 3)), layout), record


def open_file(path: Path, header_only: bool) -> tuple[dict, dict]:
    """Header and channels of an OpenEXR file; no channels if header_only. Raises GratingError if it is not one."""
    if not Path(path).is_file():
        raise GratingError(f"{path}: there is no such file; give the .exr that `bake` wrote")
    try:
        file = OpenEXR.File(str(path), header_only=header_only)
        return file.header(), {} if header_only else file.channels()
    except Exception as error:  # OpenEXR's own type differs by version
        raise GratingError(f"{path}: not a readable OpenEXR file; bake it again") from error


def image_of(path: Path, channels: dict, shape: tuple[int, int, int]) -> np.ndarray:
    """The image of the given shape, row 0 at the bottom, among a file's channels.

    Raises GratingError if the file's image has another shape."""
    name = "RGBA"[: shape[2]]
    image = channels[name].pixels[::-1] if name in channels else np.empty(0)
    if image.shape != shape:
        raise GratingError(f"{path}: the picture is not the size that its header says; bake it again")
    return image


def parse(path: Path, header: dict, layout_type: type = Layout, *, expected="bake; give the .exr that `bake` wrote"):
    """Layout and record of a header.

    Raises GratingError, which says what was `expected`, if the header holds no such layout."""
    try:
        record = json.loads(header[HEADER_KEY])
        if record["format"] != FORMAT:
            raise GratingError(f"{path}: made by another version (format {record['format']}); bake it again")
        layout = layout_type(**record["layout"])
        if not layout.is_valid:
            raise ValueError(record["layout"])
        return layout, record
    except (KeyError, TypeError, ValueError) as error:
        raise GratingError(f"{path}: not a Natural Gratings {expected}") from error

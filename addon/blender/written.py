# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that Blender writes, checked: it reports success for a picture or a compressed .blend that a full disk has
cut, and other faults without the file."""

import contextlib
import os
import re
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy

from ...precompute.base.files import told_of

# The first bytes of a compressed .blend, and the last ones: its table of frames (the seekable format of Zstandard).
_COMPRESSED, _TABLE_ENDS = b"\x28\xb5\x2f\xfd", b"\xb1\xea\x92\x8f"
# The name of an unfinished copy. Blender adds the @ while it writes.
_PARTIAL = re.compile(r"\.grating\.[0-9a-f]{16}\.blend@?")
_CUT = "Blender wrote only a part of it"


def fault_of(error: Exception) -> str:
    """What an error of Blender's operators says, as one line."""
    return " ".join(str(error).split()).removeprefix("Error: ")


@contextlib.contextmanager
def written_by_blender() -> Iterator[None]:
    """Turn an error of Blender's writers, which names no file, into an OSError."""
    try:
        yield
    except RuntimeError as error:
        raise OSError(fault_of(error)) from error


def check_picture(path: Path, size: tuple[int, int] | None, *, alpha: bool) -> tuple[int, int]:
    """Read a picture back. `size` is its width and height in pixels, None if it may have any. Returns its size. Raises
    OSError if it cannot be decoded, or has another size or other channels than RGB or, with alpha, RGBA."""
    image = bpy.data.images.load(str(path))
    try:
        found = image.size[0], image.size[1]
        bits = image.depth // (32 if image.is_float else 8)
        if not image.has_data or 0 in found or size not in (None, found) or (bits == 4) != alpha:
            raise OSError(_CUT)
        return found
    finally:
        bpy.data.images.remove(image)


def rendered_size(render: bpy.types.RenderSettings) -> tuple[int, int] | None:
    """Width and height of a render in pixels; None for a cropped one, whose sides Blender rounds."""
    if render.use_border and render.use_crop_to_border:
        return None
    share = render.resolution_percentage
    return render.resolution_x * share // 100, render.resolution_y * share // 100


def save_copy(path: Path, *, keep: bool = False, **options: Any) -> None:
    """Save the open file at a path, whole or not at all: under another name in its folder, so that relative paths are
    right. `keep`: a file that was there gets the ending .blend1. `options` are those of Blender's operator. Raises
    GratingError if it cannot be written."""
    partial = path.with_name(f".grating.{secrets.token_hex(8)}.blend")
    try:
        with told_of(path), written_by_blender():
            bpy.ops.wm.save_as_mainfile(filepath=str(partial), copy=True, **options)
            check_blend(partial)
            if keep and path.exists():
                path.replace(f"{path}1")
            partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def remove_partial_copies(folder: Path) -> None:
    """Remove what killed processes left of save_copy in a folder, into which no other process may save."""
    for left in folder.glob(".grating.*"):
        if _PARTIAL.fullmatch(left.name):
            left.unlink(missing_ok=True)


def check_blend(path: Path) -> None:
    """Raise OSError if a compressed .blend lacks its end. Blender itself reports an uncompressed one that is cut."""
    with path.open("rb") as file:
        is_compressed = file.read(4) == _COMPRESSED
        file.seek(-4, os.SEEK_END)
        if is_compressed and file.read(4) != _TABLE_ENDS:
            raise OSError(_CUT)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The protocol that every reader of a file format follows.

A new format is a new module that holds a reader, and one line in the READERS of reader_registry.py. The registry is
loaded at Blender's start, so a reader's module imports its decoder (Pillow) only inside the functions that decode.
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from ..height_map import HeightMap
from .channels import Channel

# `can_read` is given this number of bytes from the start of a file: a TIFF's tags and a text's first rows are there.
BEGINNING_BYTES = 4096


@runtime_checkable
class Reader(Protocol):
    """A reader of one file format.

    name        name of the format in messages: "Gwyddion"
    extensions  file extensions in lower case with their dots, the usual one first: (".tif", ".tiff")
    needs_size  True for pictures, which carry neither their width nor the height of white over black, and which hold
                one map of heights; False for files of instruments, which carry both and may hold several channels
    """

    @property
    def name(self) -> str: ...

    @property
    def extensions(self) -> tuple[str, ...]: ...

    @property
    def needs_size(self) -> bool: ...

    def can_read(self, beginning: bytes) -> bool:
        """Whether a file that begins with these bytes (at most BEGINNING_BYTES) is of this format."""
        ...

    def channels(self, source: str) -> tuple[Channel, ...]:
        """The channels of a file in the file's order; empty for a picture. No heights are computed.

        Raises GratingError where the file is damaged, OSError where it cannot be opened."""
        ...

    def read(
        self,
        source: str,
        *,
        size_um: float | None = None,
        height_nm: float | None = None,
        channel: str | None = None,
    ) -> HeightMap:
        """Read a file as measured: not levelled, NaN where a pixel is missing.

        A reader that needs sizes takes `size_um` and `height_nm` and ignores `channel`; any other reader takes
        `channel`, None for the topography, and ignores the sizes. Raises GratingError where the file is damaged or a
        value is missing, OSError where the file cannot be opened."""
        ...

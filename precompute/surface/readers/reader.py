# SPDX-License-Identifier: GPL-3.0-or-later
"""The protocol of file readers.

A new format needs a module with a reader, and a line in READERS of reader_registry.py. Blender loads the registry at
startup, so a reader imports its decoder (Pillow) only in the functions that decode."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from ..height_map import HeightMap
from .channels import Channel

# The bytes from a file's start that `can_read` gets. They hold a TIFF's tags and a text's first rows.
BEGINNING_BYTES = 4096


class KnownFault(Exception):
    """Raised for a file whose fault is known, such as another format with the same first bytes, with the remedy."""

    def __init__(self, fault: str, remedy: str) -> None:
        super().__init__(fault, remedy)
        self.fault, self.remedy = fault, remedy


@runtime_checkable
class Reader(Protocol):
    """A reader of one file format.

    name        name of the format in messages: "Gwyddion"
    extensions  lower-case file extensions, the usual one first: (".tif", ".tiff")
    needs_size  True for pictures: they hold one map, without its width and the height of white over black. False for
                instrument files: they hold both sizes, and may hold several channels"""

    @property
    def name(self) -> str: ...

    @property
    def extensions(self) -> tuple[str, ...]: ...

    @property
    def needs_size(self) -> bool: ...

    def can_read(self, beginning: bytes) -> bool:
        """Whether a file is of this format, by its first bytes (at most BEGINNING_BYTES)."""
        ...

    def channels(self, source: str) -> tuple[Channel, ...]:
        """List the channels in the file's order, without reading heights; () for a picture.

        Raises GratingError if the file is damaged, OSError if it cannot be opened."""
        ...

    def read(
        self,
        source: str,
        *,
        size_um: float | None = None,
        height_nm: float | None = None,
        channel: str | None = None,
    ) -> HeightMap:
        """Read a file as measured: not levelled, NaN for missing pixels.

        A reader that needs sizes ignores `channel`. Other readers ignore `height_nm`, take `size_um` in place of the
        file's own width, and read the topography if `channel` is None. Raises GratingError if the file is damaged or a
        value is missing, OSError if the file cannot be opened."""
        ...

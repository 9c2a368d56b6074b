# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of this project's OpenEXR files, which may come from untrusted sources.

It reads only the layout that table/atlas.py writes: scan lines from the top, in blocks of 16 compressed by ZIP,
and one float type for all channels. It checks the header before it reads pixels, and limits memory and time to those
of a picture of TEXELS_MAX. The OpenEXR library guarantees neither, and prints errors to the terminal. (Format: "OpenEXR
File Layout", openexr.com.)"""

import contextlib
import math
import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .failure import GratingError
from .strict import LARGEST_BYTES

# Blender stores a texel in 16 bytes. A picture above 1 GiB leaves an artist's scene too little graphics memory.
TEXELS_MAX = 1 << 26
# The largest half float. The writer scales values into this range, also in 32-bit pictures.
_LARGEST = 65504.0
# A bake's header has about 2 KB and ten attributes. One of them is JSON of at most LARGEST_BYTES.
_HEAD_BYTES_MAX, _ATTRIBUTES_MAX = LARGEST_BYTES + (1 << 12), 64
_MAGIC, _SCAN_LINES_OF_VERSION_2 = b"v/1\x01", b"\2\0\0\0"
_ZIP, _FROM_THE_TOP, _ROWS_IN_BLOCK = b"\3", b"\0", 16
_KINDS: dict[int, type[np.floating]] = {1: np.float16, 2: np.float32}
_OF_ANOTHER_KIND = "not a bake, but another OpenEXR file", "give the .exr that a bake or `dft` wrote"


@dataclass(frozen=True)
class Picture:
    """The header of a file.

    channels    "RGB" or "RGBA"
    precision   np.float16 or np.float32
    texts       the text attributes
    table_at    file position of the table of block offsets"""

    path: Path
    width: int
    height: int
    channels: str
    precision: type[np.floating]
    texts: dict[str, bytes]
    table_at: int

    @property
    def shape(self) -> tuple[int, int, int]:
        """Rows, columns and channels."""
        return self.height, self.width, len(self.channels)

    def check_pixels(self) -> None:
        """Raise GratingError for a damaged block or a non-finite pixel. Holds one block in memory at a time."""
        with _faults_told(self.path):
            for _ in self._blocks():
                pass

    def pixels(self) -> np.ndarray:
        """The picture (height, width, channels), row 0 at the bottom. Raises GratingError as check_pixels does."""
        image = np.empty(self.shape, self.precision)
        with _faults_told(self.path):
            for top, rows in self._blocks():
                image[self.height - top - len(rows) : self.height - top] = rows[::-1]
        return image

    def _blocks(self) -> Iterator[tuple[int, np.ndarray]]:
        """Yield each block's first row, counted from the top, and its pixels (rows, width, channels)."""
        with self.path.open("rb") as file:
            file.seek(self.table_at)
            places = struct.unpack(f"<{self._block_count}q", file.read(8 * self._block_count))
            for block, place in enumerate(places):
                top = block * _ROWS_IN_BLOCK
                rows = min(_ROWS_IN_BLOCK, self.height - top)
                size = rows * self.width * len(self.channels) * np.dtype(self.precision).itemsize
                file.seek(place)
                row, packed = struct.unpack("<2i", file.read(8))
                if row != top or not 0 < packed <= size:
                    raise ValueError(f"block {block} is not where it should be")
                values = unpacked(file.read(packed), size).view(self.precision)
                if not _all_in_range(values):
                    raise GratingError(self.path, "some of its pixels are not numbers", "bake it again")
                # A file stores its channels in alphabetical order: (A,) B, G, R.
                yield top, values.reshape(rows, len(self.channels), self.width).transpose(0, 2, 1)[..., ::-1]

    @property
    def _block_count(self) -> int:
        return math.ceil(self.height / _ROWS_IN_BLOCK)


def open_picture(path: Path) -> Picture:
    """Read a file's header. Raises GratingError unless the file has the layout that this program writes."""
    path = Path(path)
    if not path.is_file():
        raise GratingError(path, "there is no such file", "give the .exr that `bake` wrote")
    with _faults_told(path), path.open("rb") as file:
        head, length = file.read(_HEAD_BYTES_MAX), os.fstat(file.fileno()).st_size
        picture = _picture(path, head)
        if picture.table_at + 8 * picture._block_count > length:
            raise ValueError("the file ends before its blocks")
        return picture


def _picture(path: Path, head: bytes) -> Picture:
    if head[:4] != _MAGIC:
        raise ValueError("no OpenEXR")
    facts, end = attributes(head)
    window = facts["dataWindow"]
    if (head[4:8], facts["compression"], facts["lineOrder"], window) != (
        _SCAN_LINES_OF_VERSION_2, ("compression", _ZIP), ("lineOrder", _FROM_THE_TOP), facts["displayWindow"]
    ):  # fmt: skip
        raise GratingError(path, *_OF_ANOTHER_KIND)
    left, top, right, bottom = struct.unpack("<4i", window[1])
    names, kinds = _channels(facts["channels"][1])
    if (left, top) != (0, 0) or names not in ("BGR", "ABGR") or len(kinds) != 1 or not kinds <= set(_KINDS):
        raise GratingError(path, *_OF_ANOTHER_KIND)
    width, height = right + 1, bottom + 1
    if min(width, height) < 1 or width * height > TEXELS_MAX:
        raise GratingError(path, f"a picture of {width} x {height} texels is impossible", "bake it again")
    texts = {name: value for name, (kind, value) in facts.items() if kind == "string"}
    return Picture(path, width, height, "RGBA"[: len(names)], _KINDS[kinds.pop()], texts, end)


def attributes(head: bytes) -> tuple[dict[str, tuple[str, bytes]], int]:
    """Read type and bytes of each header attribute by name, and the end of the header. Raises ValueError if damaged."""
    found: dict[str, tuple[str, bytes]] = {}
    at = 8
    while head[at : at + 1] != b"\0":
        name, at = _word(head, at)
        kind, at = _word(head, at)
        (size,) = struct.unpack_from("<i", head, at)
        at += 4 + size
        if size < 0 or at > len(head) or name in found or len(found) == _ATTRIBUTES_MAX:
            raise ValueError(f"attribute {len(found)} of the head")
        found[name] = kind, head[at - size : at]
    return found, at + 1


def _channels(value: bytes) -> tuple[str, set[int]]:
    """Read the channels' names in file order, and their number types. Raises ValueError for a subsampled channel."""
    names, kinds, at = "", set(), 0
    while value[at : at + 1] != b"\0":
        name, at = _word(value, at)
        kind, _, x_step, y_step = struct.unpack_from("<4i", value, at)
        if (x_step, y_step) != (1, 1):
            raise ValueError("a channel of fewer texels")
        at += 16
        names += name
        kinds.add(kind)
    return names, kinds


def _word(text: bytes, at: int) -> tuple[str, int]:
    end = text.index(b"\0", at, at + 256)
    return text[at:end].decode("ascii"), end + 1


def _all_in_range(values: np.ndarray) -> bool:
    """Whether every value is finite and within the range of half floats."""
    if values.dtype == np.float16:
        return bool(np.isfinite(values).all())
    return bool(np.abs(values).max() <= _LARGEST)


def unpacked(packed: bytes, size: int) -> np.ndarray:
    """Unpack a block of `size` bytes. A block that ZIP cannot shrink is stored unpacked.

    ZIP packs the block's even bytes, then its odd bytes, as differences from byte to byte plus 128."""
    if len(packed) == size:
        return np.frombuffer(packed, np.uint8)
    plain = zlib.decompressobj().decompress(packed, size + 1)  # one more byte reveals a block that is too long
    if len(plain) != size:
        raise ValueError("a block of another size")
    differences = np.frombuffer(plain, np.uint8)
    halves = np.cumsum(differences, dtype=np.uint8)
    halves[1::2] -= 128
    block = np.empty(size, np.uint8)
    block[::2], block[1::2] = halves[: (size + 1) // 2], halves[(size + 1) // 2 :]
    return block


@contextlib.contextmanager
def _faults_told(path: Path) -> Iterator[None]:
    try:
        yield
    except (ValueError, KeyError, struct.error, zlib.error) as error:
        raise GratingError(path, "not a readable OpenEXR file", "bake it again") from error
    except OSError as error:
        raise GratingError(path, error.strerror or str(error), "check the path and its permissions") from error

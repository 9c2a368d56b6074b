# SPDX-License-Identifier: GPL-3.0-or-later
"""Small valid files of the formats that are mutated, and expensive files (bombs)."""

import io
import struct
import zlib

import numpy as np
from gwyfile.objects import GwyContainer, GwyDataField
from PIL import Image

# Heights from 0 to 1 of a tilted grating, which looks different after any flip or turn.
_ROWS, _COLS = 24, 40
_TILTED = (np.arange(_ROWS)[:, None] * 0.07 + np.arange(_COLS) * 0.13) % 1
PIXEL_M, _HEIGHT_M = 25e-9, 200e-9
# The same heights in metres, centred on zero.
HEIGHTS = (_TILTED - 0.5) * _HEIGHT_M


def nid() -> bytes:
    """A Nanosurf file with one channel, forward and backward."""
    header = ["[DataSet]", "Version=2", "GroupCount=2", "Gr0-Count=1", "Gr1-Count=1"]
    header += ["Gr0-Ch0=DataSet-0", "Gr1-Ch0=DataSet-1"]
    for number, frame in enumerate(("forward", "backward")):
        header += ["", f"[DataSet-{number}]", f"Points={_COLS}", f"Lines={_ROWS}", f"Frame=Scan {frame}"]
        header += ["Dim0Unit=m", f"Dim0Range={_COLS * PIXEL_M!r}", "Dim1Unit=m", f"Dim1Range={_ROWS * PIXEL_M!r}"]
        header += ["Dim2Name=Z-Axis", "Dim2Unit=m", f"Dim2Range={2 * _HEIGHT_M!r}", f"Dim2Min={-_HEIGHT_M!r}"]
        header += ["SaveMode=Binary", "SaveBits=16", "SaveSign=Signed", "SaveOrder=Intel"]
    data = np.round(_TILTED * 2**15).astype("<i2").tobytes()
    return "\r\n".join([*header, "", "#!"]).encode() + 2 * data


def gwy() -> bytes:
    """A Gwyddion file of one channel with a title and a mask."""
    sides = {"xreal": _COLS * PIXEL_M, "yreal": _ROWS * PIXEL_M, "si_unit_xy": "m"}
    container = GwyContainer()
    container["/0/data"] = GwyDataField(_TILTED * _HEIGHT_M, **sides, si_unit_z="m")
    container["/0/data/title"] = "Topography"
    container["/0/mask"] = GwyDataField((_TILTED > 0.9).astype(float), **sides, si_unit_z="")
    return b"GWYP" + container.serialize()


def png() -> bytes:
    return _saved(_grey(np.uint8), "PNG")


def png_16() -> bytes:
    return _saved(_grey(np.uint16), "PNG")


def png_alpha() -> bytes:
    """A grey picture with transparent pixels."""
    grey = _grey(np.uint8)
    return _saved(np.stack([grey, grey, grey, np.where(grey > 240, 0, 255).astype(np.uint8)], axis=-1), "PNG")


def tiff() -> bytes:
    """An uncompressed grey picture, 16 bits."""
    return _saved(_grey(np.uint16), "TIFF")


def tiff_lzw() -> bytes:
    """A grey picture, 8 bits, compressed by libtiff."""
    return _saved(_grey(np.uint8), "TIFF", compression="tiff_lzw")


def tiff_of_floats() -> bytes:
    """A picture of floats with one missing pixel."""
    values = _TILTED.astype(np.float32)
    values[2, 7] = np.nan
    return _saved(values, "TIFF")


def bmp() -> bytes:
    return _saved(_grey(np.uint8), "BMP")


def png_bomb() -> bytes:
    """A black picture of 9000 x 9000 pixels in 80 KB; reading it takes 1.2 GiB."""
    side = 9000
    packer = zlib.compressobj(9)
    rows = [packer.compress(bytes(side + 1)) for _ in range(side)]
    header = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
    data = b"".join([*rows, packer.flush()])
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def png_text_bomb() -> bytes:
    """The 8-bit picture with 200 MB of text packed into 200 KB."""
    text = chunk(b"zTXt", b"key\0\0" + zlib.compress(bytes(200 << 20), 9))
    whole = png()
    return whole[:33] + text + whole[33:]


def tiff_of_many_pages() -> bytes:
    """100,000 pages of one directory entry each."""
    entry = struct.pack("<HHHII", 1, 256, 3, 1, 2)
    size = len(entry) + 4
    pages = (entry + struct.pack("<I", 8 + size * (page + 1)) for page in range(100_000))
    return b"II*\0" + struct.pack("<I", 8) + b"".join(pages)


def tiff_of_shared_tags() -> bytes:
    """60,000 tags of a megabyte each, which all point to the same megabyte."""
    tags = b"".join(struct.pack("<HHII", 40_000 + tag % 20_000, 1, 1 << 20, 8) for tag in range(60_000))
    return b"II*\0" + struct.pack("<IH", 8, 60_000) + tags + bytes(4 + (1 << 20))


def bmp_of_long_skips() -> bytes:
    """A compressed picture, 80 million pixels wide and one row high, that consists of skip commands."""
    skips = b"\0\2\xff\xff" * 5000
    head = struct.pack("<IiiHHIIiiII", 40, 80_000_000, 1, 1, 8, 1, len(skips), 1, 1, 256, 0)
    palette = b"".join(bytes((grey, grey, grey, 0)) for grey in range(256))
    offset = 14 + len(head) + len(palette)
    return b"BM" + struct.pack("<IHHI", offset + len(skips), 0, 0, offset) + head + palette + skips


def gwy_of_many_components() -> bytes:
    """A container of three million components."""
    data = b"\0b\0" * 3_000_000
    return b"GWYPGwyContainer\0" + struct.pack("<I", len(data)) + data


def chunk(kind: bytes, data: bytes) -> bytes:
    """A PNG chunk with its checksum."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _grey(kind: type) -> np.ndarray:
    return np.round(_TILTED * np.iinfo(kind).max).astype(kind)


def _saved(array: np.ndarray, form: str, **options: object) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(array).save(buffer, form, **options)
    return buffer.getvalue()

# SPDX-License-Identifier: GPL-3.0-or-later
"""Small files of instruments' formats that are expensive to read."""

import io
import struct
import zipfile
import zlib

from . import instruments
from .scans import HEIGHTS, PIXEL_M

_SIDE = 9000
_ROW = bytes(2 * _SIDE)


def x3p_of_zeros() -> bytes:
    """9000 x 9000 heights of zero in 160 KB; reading them takes 1.2 GiB."""
    whole = zipfile.ZipFile(io.BytesIO(instruments.x3p(HEIGHTS, PIXEL_M)))
    rows, cols = HEIGHTS.shape
    xml = whole.read("main.xml").decode().replace(f"SizeX>{cols}<", f"SizeX>{_SIDE}<")
    xml = xml.replace(f"SizeY>{rows}<", f"SizeY>{_SIDE}<").replace(">D</DataType></CZ>", ">I</DataType></CZ>")
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("main.xml", xml)
        with archive.open("bindata/data.bin", "w") as data:
            for _ in range(_SIDE):
                data.write(_ROW)
    return out.getvalue()


def _zipped_xml(xml: bytes) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("main.xml", xml)
    return out.getvalue()


def x3p_of_entities() -> bytes:
    """Nine nested entities, each ten times the one before, in UTF-16: 3 GB of text."""
    pairs = zip("abcdefgh", "bcdefghi", strict=True)
    declared = "".join(f'<!ENTITY {name} "{10 * f"&{before};"}">' for before, name in pairs)
    xml = f'<?xml version="1.0" encoding="UTF-16"?><!DOCTYPE p [<!ENTITY a "lol">{declared}]><p>&i;</p>'
    return _zipped_xml(xml.encode("utf-16"))


def x3p_of_elements() -> bytes:
    """Ten million elements in 40 KB."""
    return _zipped_xml(b"<p>" + b"<a/>" * 10_000_000 + b"</p>")


def npy_of_zeros() -> bytes:
    """15000 x 15000 small integers, which become 1.8 GB of heights."""
    header = b"{'descr': '|i1', 'fortran_order': False, 'shape': (15000, 15000), }".ljust(117) + b"\n"
    return b"\x93NUMPY\1\0" + struct.pack("<H", len(header)) + header + bytes(15000**2)


def sur_of_zeros() -> bytes:
    """9000 x 9000 heights of zero in 160 KB; reading them takes 1.2 GiB."""
    packer = zlib.compressobj()
    packed = b"".join([*(packer.compress(_ROW) for _ in range(_SIDE)), packer.flush()])
    header = bytearray(instruments.digital_surf(HEIGHTS, PIXEL_M, packed=True, bits=16)[:519])
    struct.pack_into("<2iI", header, 108, _SIDE, _SIDE, _SIDE * _SIDE)
    return bytes(header) + struct.pack("<3I", 1, _SIDE * len(_ROW), len(packed)) + packed


def text_of_one_row() -> bytes:
    """A matrix with one row of 30 million numbers."""
    return b"1 " * 30_000_000


def text_of_many_rows() -> bytes:
    """A matrix with one column of 30 million numbers."""
    return b"1\n" * 30_000_000


def points_far_apart() -> bytes:
    """Five points on a grid of 10^9 columns and rows."""
    return b"0 0 1\n0 1 1\n1 0 1\n1 1 1\n1000000000 1000000000 1\n"


def jpk_in_a_circle() -> bytes:
    """A JPK file whose first page links to itself."""
    whole = bytearray(instruments.tiff([{256: 1, 257: 1, 32768: "2.0"}]))
    struct.pack_into(">I", whole, 8 + 2 + 12 * 3, 8)
    return bytes(whole)


def jpk_of_long_strips() -> bytes:
    """A JPK file that declares 2^30 strips and strip lengths."""
    page = {256: 10**9, 257: 10**9, 258: 32, 273: 8, 279: 8, 339: 2, 32848: "height", 32896: 1, 32897: "raw"}
    whole = bytearray(instruments.tiff([{32768: "2.0", 32834: 1e-6, 32835: 1e-6}, page]))
    for tag in (273, 279):
        at = whole.index(struct.pack(">HHI", tag, 4, 1))
        struct.pack_into(">I", whole, at + 4, 1 << 30)
    return bytes(whole)

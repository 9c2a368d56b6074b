# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways to damage a file's bytes: each function takes a random generator and bytes, and returns other bytes."""

import io
import lzma
import random
import re
import struct
import zipfile
import zlib
from collections.abc import Callable

from .scans import chunk

Mutation = Callable[[random.Random, bytes], bytes]

# Texts that a reader may parse as numbers.
WORDS = (b"0", b"-1", b"1e9", b"1000000000", b"nan", b"inf", b"-inf", b"1e308", b"1e-308", b"9" * 400, b"", b"x")
_INTEGERS = (0, 1, 2, 255, 256, 65535, 10**9, 2**31 - 1, 2**31, 2**32 - 1)
_FLOATS = (0.0, -1.0, 1e9, 1e308, 1e-308, 5e-324, float("nan"), float("inf"), -float("inf"))
_NUMBER = re.compile(rb"(?<![\w.])-?\d[\d.]*(?:e[-+]?\d+)?")


def truncated(draw: random.Random, data: bytes) -> bytes:
    return data[: draw.randrange(len(data))]


def flipped(draw: random.Random, data: bytes) -> bytes:
    spoiled = bytearray(data)
    for _ in range(draw.randint(1, 8)):
        spoiled[draw.randrange(len(spoiled))] ^= 1 << draw.randrange(8)
    return bytes(spoiled)


def overwritten(draw: random.Random, data: bytes) -> bytes:
    """Overwrite a run of bytes with 0, 255 or random values."""
    start, stop = _span(draw, data)
    length = stop - start
    run = draw.choice((bytes(length), b"\xff" * length, draw.randbytes(length)))
    return data[:start] + run + data[stop:]


def without_block(draw: random.Random, data: bytes) -> bytes:
    start, stop = _span(draw, data)
    return data[:start] + data[stop:]


def with_block_twice(draw: random.Random, data: bytes) -> bytes:
    """Repeat a block of the middle."""
    start, stop = _span(draw, data)
    return data[:stop] + data[start:]


def with_tail(draw: random.Random, data: bytes) -> bytes:
    """Append zeros, random bytes or the file itself."""
    length = draw.randint(1, 1 << 16)
    return data + draw.choice((bytes(length), draw.randbytes(length), data))


def with_integer(draw: random.Random, data: bytes) -> bytes:
    """Write a 2-byte or 4-byte integer into the first or last kilobyte, where headers are."""
    form = draw.choice(("<I", ">I", "<H", ">H"))
    value = draw.choice(_INTEGERS) % (1 << 8 * struct.calcsize(form))
    return _with(draw, data, struct.pack(form, value))


def with_float(draw: random.Random, data: bytes) -> bytes:
    """Write an 8-byte float into the first or last kilobyte."""
    return _with(draw, data, struct.pack("<d", draw.choice(_FLOATS)))


def with_number(draw: random.Random, data: bytes) -> bytes:
    """Replace a number that is written in digits by another word of WORDS; flip bits if the file has no such number."""
    found = list(_NUMBER.finditer(data[: 1 << 14]))
    if not found:
        return flipped(draw, data)
    one = draw.choice(found)
    return data[: one.start()] + draw.choice(WORDS) + data[one.end() :]


def with_chunk(draw: random.Random, data: bytes) -> bytes:
    """Damage one chunk of a PNG and renew its checksum, so that a decoder accepts it; flip bits in other files."""
    if not data.startswith(b"\x89PNG"):
        return flipped(draw, data)
    places = [8]
    while places[-1] + 12 <= len(data):
        places.append(places[-1] + 12 + struct.unpack_from(">I", data, places[-1])[0])
    at = draw.choice(places[:-1] or [8])
    (length,) = struct.unpack_from(">I", data.ljust(at + 8, b"\0"), at)
    kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
    way = draw.choice((truncated, flipped, overwritten, with_integer)) if body else with_tail
    return data[:at] + chunk(kind, way(draw, body)) + data[at + 12 + length :]


def with_member(draw: random.Random, data: bytes) -> bytes:
    """Damage one file of a zip archive and pack it again, so that a reader accepts it; flip bits in other files."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
    except (
        zipfile.BadZipFile,
        zlib.error,
        lzma.LZMAError,
        OSError,
        struct.error,
        ValueError,
        EOFError,
        NotImplementedError,
        RuntimeError,
    ):
        return flipped(draw, data)
    name = draw.choice(sorted(members))
    way = draw.choice((truncated, flipped, overwritten, with_integer, with_number)) if members[name] else with_tail
    members[name] = way(draw, members[name])
    out = io.BytesIO()
    # The last two are refused unread, so they are chosen rarely.
    packings = (*3 * (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED), zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
    with zipfile.ZipFile(out, "w", draw.choice(packings)) as archive:
        for each, content in members.items():
            archive.writestr(each, content)
    return out.getvalue()


ANY: tuple[Mutation, ...] = (
    truncated, flipped, overwritten, without_block, with_block_twice, with_tail, with_integer, with_float, with_number,
    with_chunk, with_member,
)  # fmt: skip


def mutated(draw: random.Random, data: bytes, ways: tuple[Mutation, ...] = ANY) -> tuple[str, bytes]:
    """Damage bytes in one to three ways; return the names of the ways and the bytes."""
    chosen = draw.choices(ways, k=draw.choice((1, 1, 1, 2, 3)))
    for way in chosen:
        data = way(draw, data) if data else b""
    return ", ".join(way.__name__.replace("_", " ") for way in chosen), data


def _span(draw: random.Random, data: bytes) -> tuple[int, int]:
    start = draw.randrange(len(data))
    return start, min(len(data), start + draw.choice((1, 4, 16, 64, 256, 1024)))


def _with(draw: random.Random, data: bytes, value: bytes) -> bytes:
    """Overwrite bytes with `value` in the first or the last kilobyte."""
    reach = max(1, min(1024, len(data) - len(value)))
    at = draw.randrange(reach)
    if draw.random() < 0.25:
        at = max(0, len(data) - len(value) - at)
    return data[:at] + value + data[at + len(value) :]

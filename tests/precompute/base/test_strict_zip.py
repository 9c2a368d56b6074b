# SPDX-License-Identifier: GPL-3.0-or-later
"""Forged zip archives: each raises ValueError, and none is expensive to read."""

import io
import random
import struct
import tracemalloc
import zipfile

import pytest

from precompute.base.strict import NAMES_MAX, Archive
from tests.hostile.mutations import mutated

TEXT = b"one two three four " * 50
# Offsets of the flags, the method and the length in a file's directory entry.
FLAGS, METHOD, LENGTH = 8, 10, 24


def archive(method=zipfile.ZIP_DEFLATED, **files) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as packed:
        for name, data in (files or {"a": TEXT}).items():
            packed.writestr(name, data)
    return out.getvalue()


def with_entry(data: bytes, at: int, form: str, value: int) -> bytes:
    """The archive with another number in the first entry of its directory."""
    changed = bytearray(data)
    struct.pack_into(form, changed, data.index(b"PK\1\2") + at, value)
    return bytes(changed)


def read(data: bytes, most: int = 1 << 20) -> bytes:
    return Archive(io.BytesIO(data)).read("a", most)


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_what_is_whole_is_read(method):
    found = Archive(io.BytesIO(archive(method, a=TEXT, b=b"")))
    assert found.names == ("a", "b")
    assert (found.size("a"), found.read("a", len(TEXT)), found.read("b", 0)) == (len(TEXT), TEXT, b"")
    with pytest.raises(KeyError):
        found.read("c", 1)


def test_a_comment_at_the_end_is_no_fault():
    out = io.BytesIO(archive())
    with zipfile.ZipFile(out, "a") as packed:
        packed.comment = b"x" * 60_000
    assert read(out.getvalue()) == TEXT


@pytest.mark.parametrize(("data", "told"), [
    (b"", "not a zip file"), (b"PK\3\4 and no more", "not a zip file"), (archive()[:-1], "not a zip file"),
    (archive(zipfile.ZIP_LZMA), "method 14, not by deflate"), (archive(zipfile.ZIP_BZIP2), "method 12, not by deflate"),
    (with_entry(archive(), METHOD, "<H", 9), "method 9, not by deflate"),
    (with_entry(archive(), FLAGS, "<H", 1), "a is encrypted"),
    (with_entry(archive(), LENGTH, "<I", 10**9), "a has 1000000000 bytes"),
    (with_entry(archive(zipfile.ZIP_STORED), LENGTH, "<I", 2000), "a has 2000 bytes"),
    (with_entry(archive(), LENGTH, "<I", 2000), "a is not as long as it says|a: "),
    (archive()[:31] + b"\xff" * 8 + archive()[39:], "a: Error -3 while decompressing"),
    (archive(a=bytes(2 << 20)), "a has 2097152 bytes"),
    (archive().replace(b"PK\5\6", b"PK\6\7" + bytes(16) + b"PK\5\6"), "more than 4 GiB"),
    (with_entry(archive(), 42, "<I", 10**9), "a: |overlap"),
    (archive(zipfile.ZIP_STORED).replace(b"one", b"two", 1), "a: Bad CRC-32"),
])  # fmt: skip
def test_every_lie_is_a_value_error(data, told):
    with pytest.raises(ValueError, match=told):
        read(data)


def test_too_many_files_are_refused_before_they_are_listed():
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as packed:
        for number in range(NAMES_MAX + 1):
            packed.writestr(str(number), b"")
    with pytest.raises(ValueError, match="more than 10000 files"):
        Archive(io.BytesIO(out.getvalue()))
    # Repeating the directory of 10,001 files 50 times costs zipfile half a gigabyte.
    whole = out.getvalue()
    start, end = whole.index(b"PK\1\2"), whole.rindex(b"PK\5\6")
    directory = whole[start:end] * 50
    record = struct.pack("<4s4HIIH", b"PK\5\6", 0, 0, 0xFFFE, 0xFFFE, len(directory), start, 0)
    long = io.BytesIO(whole[:start] + directory + record)
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match="a directory of"):
            Archive(long)
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


def test_spoiled_archives_raise_nothing_else():
    whole = archive(a=TEXT, b=bytes(300))
    for number in range(400):
        _, data = mutated(random.Random(number), whole)
        try:
            found = Archive(io.BytesIO(data))
            for name in found.names:
                assert len(found.read(name, 1 << 16)) <= 1 << 16
        except ValueError:
            pass

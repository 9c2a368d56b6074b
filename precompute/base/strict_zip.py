# SPDX-License-Identifier: GPL-3.0-or-later
"""Strict reader of zip archives from untrusted files.

It accepts files that are stored or deflated, not encrypted, and exactly as long as the directory says. Faults raise
ValueError, and missing files KeyError; the caller adds the path and the remedy."""

from __future__ import annotations

import os
import struct
import zlib
from typing import TYPE_CHECKING, BinaryIO

if TYPE_CHECKING:
    from zipfile import ZipFile

# The most bytes and files in a directory.
_DIRECTORY_MAX, NAMES_MAX = 2 << 20, 10_000
# Deflate packs at most this many bytes into one.
MOST_PACKED = 1032
# The archive's end record, before its comment of up to 64 KiB; the locator before it marks 64-bit archives (PKWARE,
# "APPNOTE.TXT", sections 4.3.15 and 4.3.16).
_END, _END_BYTES, _COMMENT_MAX = b"PK\5\6", 22, (1 << 16) - 1
_LOCATOR, _LOCATOR_BYTES = b"PK\6\7", 20
_ENCRYPTED = 1
_METHODS = {0: "stored", 8: "deflate"}


class Archive:
    """A zip archive in an open file. Only `read` unpacks."""

    def __init__(self, file: BinaryIO) -> None:
        """Read the directory. Raises ValueError if it is damaged, or holds more than NAMES_MAX files."""
        _refuse_long_directory(file)
        self._zip = _opened(file)
        self.names = tuple(self._zip.namelist())
        """The names of the files, in the archive's order."""
        if len(self.names) > NAMES_MAX:
            raise ValueError(f"an archive of more than {NAMES_MAX} files")

    def size(self, name: str) -> int:
        """Return a file's unpacked size in bytes, from the directory.

        Raises KeyError if there is no such file, ValueError if its packed bytes cannot unpack to this size."""
        info = self._zip.getinfo(name)
        packed_at_most = info.file_size if info.compress_type == 0 else MOST_PACKED * (info.compress_size + 1)
        if info.file_size > packed_at_most or (info.compress_type == 0 and info.file_size > info.compress_size):
            raise ValueError(f"{_shown(name)} has {info.file_size} bytes")
        return info.file_size

    def read(self, name: str, most: int) -> bytes:
        """Unpack a file of at most `most` bytes.

        Raises KeyError if there is no such file; ValueError if it is longer, encrypted, damaged, or not deflated."""
        from zipfile import BadZipFile

        size = self.size(name)
        if size > most:
            raise ValueError(f"{_shown(name)} has {size} bytes")
        info = self._zip.getinfo(name)
        if info.flag_bits & _ENCRYPTED:
            raise ValueError(f"{_shown(name)} is encrypted")
        if info.compress_type not in _METHODS:
            raise ValueError(f"{_shown(name)} is packed by method {info.compress_type}, not by deflate")
        try:
            with self._zip.open(info) as member:
                data = member.read(size + 1)
        except (BadZipFile, NotImplementedError, RuntimeError, OSError, EOFError, zlib.error, struct.error) as error:
            raise ValueError(f"{_shown(name)}: {error}") from error
        if len(data) != size:
            raise ValueError(f"{_shown(name)} is not as long as it says")
        return data


def _refuse_long_directory(file: BinaryIO) -> None:
    """Raise ValueError for a directory that would take too much memory: zipfile spends half a kilobyte on each file."""
    end = file.seek(0, os.SEEK_END)
    file.seek(max(0, end - _END_BYTES - _COMMENT_MAX - _LOCATOR_BYTES))
    tail = file.read()
    at = tail.rfind(_END)
    if at < 0 or at + _END_BYTES > len(tail):
        raise ValueError("File is not a zip file")
    if tail[:at][-_LOCATOR_BYTES:].startswith(_LOCATOR):
        raise ValueError("an archive of more than 4 GiB")
    (length,) = struct.unpack_from("<I", tail, at + 12)
    if length > _DIRECTORY_MAX:
        raise ValueError(f"an archive with a directory of {length} bytes")


def _opened(file: BinaryIO) -> ZipFile:
    from zipfile import BadZipFile, ZipFile

    try:
        return ZipFile(file)
    except (BadZipFile, NotImplementedError, RuntimeError, OSError, EOFError, struct.error, OverflowError) as error:
        raise ValueError(str(error)) from error


def _shown(name: str) -> str:
    return name if len(name) <= 40 else f"{name[:40]}..."

# SPDX-License-Identifier: GPL-3.0-or-later
"""Zip archives from files that anyone may have written: read strictly, within bounds, or refused.

What passes is packed by deflate or not at all, is not encrypted, and unpacks to no more than its directory says. Every
fault is a ValueError; a file that is not there is a KeyError. The caller adds the path and the remedy.
"""

from __future__ import annotations

import os
import struct
import zlib
from typing import TYPE_CHECKING, BinaryIO

if TYPE_CHECKING:
    from zipfile import ZipFile

# A directory's length in bytes, and its files.
_DIRECTORY_MAX, NAMES_MAX = 2 << 20, 10_000
# Deflate packs at most this many bytes into one.
MOST_PACKED = 1032
# The record at an archive's end, without its comment of up to 64 KiB, and what stands before it where sizes need 64
# bits (PKWARE, "APPNOTE.TXT", sections 4.3.15 and 4.3.16).
_END, _END_BYTES, _COMMENT_MAX = b"PK\5\6", 22, (1 << 16) - 1
_LOCATOR, _LOCATOR_BYTES = b"PK\6\7", 20
_ENCRYPTED = 1
_METHODS = {0: "stored", 8: "deflate"}


class Archive:
    """The files of a zip archive, which is read from an open file. Nothing is unpacked before `read`."""

    def __init__(self, file: BinaryIO) -> None:
        """Read the directory. Raises ValueError if it is damaged, or holds more than NAMES_MAX files."""
        _refuse_long_directory(file)
        self._zip = _opened(file)
        self.names = tuple(self._zip.namelist())
        """The names of the files, in the archive's order."""
        if len(self.names) > NAMES_MAX:
            raise ValueError(f"an archive of more than {NAMES_MAX} files")

    def size(self, name: str) -> int:
        """The bytes of a file, as the directory says. Raises KeyError if it is not there, ValueError if no file of so
        few packed bytes can be so long."""
        info = self._zip.getinfo(name)
        packed_at_most = info.file_size if info.compress_type == 0 else MOST_PACKED * (info.compress_size + 1)
        if info.file_size > packed_at_most or (info.compress_type == 0 and info.file_size > info.compress_size):
            raise ValueError(f"{_shown(name)} has {info.file_size} bytes")
        return info.file_size

    def read(self, name: str, most: int) -> bytes:
        """The bytes of a file, `most` of them or fewer.

        Raises KeyError if it is not there; ValueError if it is longer, encrypted, packed by a method other than
        deflate, or damaged."""
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
    """Raise ValueError before a directory is read that would cost more than it is worth: zipfile makes an object of
    half a kilobyte for each of its files."""
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

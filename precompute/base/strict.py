# SPDX-License-Identifier: GPL-3.0-or-later
"""Strict readers of JSON and zip archives from untrusted files, and failures as lines of JSON.

JSON may have at most LARGEST_BYTES, nesting up to DEEPEST, finite numbers, integers that double precision holds
exactly, and no repeated keys. Invalid JSON gives a one-line error.

An archive's files must be stored or deflated, not encrypted, and exactly as long as the directory says. Faults raise
ValueError, and missing files KeyError; the caller adds the path and the remedy.

By a line of JSON a process sends its failure to the process that started it. The line is {"error": {"what": WHAT,
"fault": FAULT, "remedy": [TEXT, {"setting": OPTION}, ...]}}."""

from __future__ import annotations

import contextlib
import json
import math
import os
import struct
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from .failure import GratingError, Setting
from .files import read_limited

if TYPE_CHECKING:
    from zipfile import ZipFile


# A header or a request with ten thousand scans is smaller.
LARGEST_BYTES = 1 << 20
# Records of this project are nested 4 deep.
DEEPEST = 32
# Double precision holds every integer up to this one exactly (RFC 8259, section 6).
_LARGEST_INTEGER = 2**53 - 1


def read_json(path: Path, remedy: str) -> Any:
    """Read a JSON file in UTF-8.

    Raises GratingError "PATH: fault; REMEDY" if the file cannot be read or parse_json refuses its content."""
    return parse_json(read_limited(path, LARGEST_BYTES, remedy), path, remedy)


def parse_json(text: str | bytes, source: str | Path, remedy: str, *, part: str = "") -> Any:
    """Parse JSON text, or bytes in UTF-8. `part` says in an error which part of the source it is: "its header: ".

    Raises GratingError "SOURCE: fault; REMEDY" if the text is not JSON or breaks a limit of this module."""
    try:
        if len(text) > LARGEST_BYTES:
            raise ValueError(f"larger than {LARGEST_BYTES >> 10} KiB")
        if isinstance(text, bytes):
            text = text.decode("utf-8-sig")
        found = json.loads(
            text, parse_int=_integer, parse_float=_finite, parse_constant=_finite, object_pairs_hook=_without_doubles
        )
        if _is_deeper(found, DEEPEST):
            raise RecursionError
    except RecursionError as error:
        raise GratingError(source, f"{part}not JSON that can be used (nested too deeply)", remedy) from error
    except ValueError as error:
        raise GratingError(source, f"{part}not JSON that can be used ({error})", remedy) from error
    return found


def number_in(source: str, key: str, value: Any, *, limits: tuple[float, float]) -> float:
    """A number of a record, within limits. Raises GratingError, with `source` and the key, for any other value."""
    low, high = limits
    if type(value) not in (int, float) or not low <= value <= high:
        raise GratingError(source, f"{key}: cannot be {value!r:.30}", f"give a number from {low:g} to {high:g}")
    return float(value)


def _integer(digits: str) -> int:
    # Python's time to parse an integer grows with the square of its digits.
    if len(digits) > 17 or abs(number := int(digits)) > _LARGEST_INTEGER:
        raise ValueError(f"an integer of {len(digits)} digits")
    return number


def _finite(digits: str) -> float:
    number = float(digits)
    if not math.isfinite(number):
        raise ValueError(f"{digits[:20]} is not a finite number")
    return number


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a key appears twice")
    return found


def _is_deeper(value: Any, depth: int) -> bool:
    """Whether a value nests objects and lists more than `depth` deep."""
    level = [value]
    for _ in range(depth + 1):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer if isinstance(outer, list) else ())
        ]
    return bool(level)


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


def failure_line(error: GratingError) -> str:
    """A failure as a line of JSON."""
    remedy = [error.remedy] if isinstance(error.remedy, str) else error.remedy
    parts = [{"setting": part.value} if isinstance(part, Setting) else part for part in remedy]
    return json.dumps({"error": {"what": str(error.what), "fault": error.fault, "remedy": parts}})


def failure_in(lines: Sequence[str]) -> GratingError | None:
    """The failure that the last such line tells; None if no line does. A killed process may leave half a line."""
    for line in reversed(lines):
        if line.startswith("{"):
            with contextlib.suppress(GratingError):
                match parse_json(line, "", ""):
                    case {"error": {"what": str(what), "fault": str(fault), "remedy": list(parts)}}:
                        return GratingError(what, fault, [_part(part) for part in parts])
    return None


def _part(part: object) -> str | Setting:
    """A part of a remedy. A setting that only a newer version has stays an option of the command line."""
    match part:
        case {"setting": str(name)}:
            return Setting(name) if name in {setting.value for setting in Setting} else name
    return part if isinstance(part, str) else ""

# SPDX-License-Identifier: GPL-3.0-or-later
"""The entries of the cache of bakes as a user sees them, and a check of their files."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from ..base.progress import Progress
from .cache import is_of, key_of
from .cache_store import Cache, Entry, fingerprint


class State(StrEnum):
    """The state of an entry."""

    WHOLE = "whole"
    DAMAGED = "damaged"
    IN_USE = "in use"


@dataclass(frozen=True)
class Listed:
    """An entry with the name of its bake ("" if unknown), the 99th percentile of its error dE00 (NaN if unknown) and
    its state."""

    entry: Entry
    name: str
    p99: float
    state: State


def listed(cache: Cache, entry: Entry) -> Listed:
    """An entry as a user sees it. Only the sizes of its files are compared with the record."""
    record = cache.record(entry.key)
    if record is None:
        return Listed(entry, "", math.nan, State.IN_USE if cache.is_held(entry.key) else State.DAMAGED)
    sizes = {name: _size_of(told) for name, told in record.fingerprints.items()}
    state = State.WHOLE if all(_has(cache.file(entry.key, name), sizes[name]) for name in sizes) else State.DAMAGED
    name = next((Path(name).stem for name in record.fingerprints), "")
    return Listed(entry, name, _p99(record.facts), State.IN_USE if cache.is_held(entry.key) else state)


def damaged(cache: Cache, progress: Progress, *, remove: bool) -> Iterator[tuple[Listed, bool]]:
    """Compare the files of all entries with their records, and with the keys. Yields each damaged entry, and whether it
    was removed.

    Entries that another process uses are left out: they may be about to change."""
    entries = list(cache.entries())
    total, done = sum(entry.size_bytes for entry in entries), 0
    for entry in entries:
        progress("verifying", done / total if total else 0.0)
        done += entry.size_bytes
        hold = cache.hold(entry.key)
        if hold is None:
            continue
        found = listed(cache, entry)
        with hold:
            if not _is_whole(cache, entry.key):
                can_remove = remove and hold.fault is None
                if can_remove:
                    cache.clear(entry.key)
                yield Listed(entry, found.name, found.p99, State.DAMAGED), can_remove
    progress("verifying", 1.0)


def _is_whole(cache: Cache, key: str) -> bool:
    record = cache.record(key)
    if record is None or key_of(record.of) != key:
        return False
    files = {cache.file(key, name): told for name, told in record.fingerprints.items()}
    try:
        are_whole = all(not file.is_symlink() and fingerprint(file) == told for file, told in files.items())
        return are_whole and is_of(record.of, list(files))
    except (OSError, ValueError):
        return False


def _has(file: Path, size_bytes: Any) -> bool:
    try:
        return not file.is_symlink() and file.is_file() and file.stat().st_size == size_bytes
    except (OSError, ValueError):
        return False


def _size_of(told: Any) -> Any:
    return told.get("bytes") if isinstance(told, dict) else None


def _p99(facts: dict[str, Any]) -> float:
    errors = facts.get("delta_e")
    found = errors.get("p99") if isinstance(errors, dict) else None
    return float(found) if isinstance(found, (int, float)) and not isinstance(found, bool) else math.nan

# SPDX-License-Identifier: GPL-3.0-or-later
"""The folder of the cache of bakes:

    entries/KEY/record.json   all that the bake depends on, its facts, and size and SHA-256 of each of its files; its
                              modification time is the time of last use, by the clock of the file server
    entries/KEY/files/        the files that the bake wrote
    partial/KEY.MACHINE.*/    an unfinished entry; it is renamed into entries/ when it is complete
    locks/KEY.lock            locked by the process that bakes or removes KEY (base/shared_folder.py)

An entry is used only if its record is valid, each copied file matches the record, and what the files say of themselves
is of this key. So a process may read an entry
without the lock: if another process removes the entry meanwhile, the bake is only made again. The first complete entry
of a key stays, and whoever comes second uses that entry too.
"""

import contextlib
import hashlib
import json
import math
import re
import secrets
import shutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from os import utime
from pathlib import Path
from typing import Any

from ..base.failure import GratingError
from ..base.files import told_of
from ..base.shared_folder import Hold, hold_later, hold_now, is_left_behind, machine_name, server_now_ns
from ..base.strict_json import read_json

_KEY = re.compile(r"[0-9a-f]{64}")
_CHUNK_BYTES = 1 << 20
# Whether the facts of a bake, with the names of its files under `files`, and these files in a folder are of a key.
Believed = Callable[[Mapping[str, Any], Path], bool]


@dataclass(frozen=True)
class Entry:
    """An entry: its key, its bytes, and the time since its last use in nanoseconds. The time is negative if the
    server's clock was set back since."""

    key: str
    size_bytes: int
    unused_ns: int


@dataclass(frozen=True)
class Limits:
    """The limits of a cache: the bytes of all entries, and the time in nanoseconds that an entry may be unused."""

    size_bytes: float = math.inf
    unused_ns: float = math.inf


@dataclass(frozen=True)
class Record:
    """The record of an entry: all that the bake depends on, the facts of the bake, with the names of its files under
    `files`, and for each file its fingerprint."""

    of: Any
    facts: dict[str, Any]
    fingerprints: dict[str, Any]


@dataclass(frozen=True)
class Cache:
    """The cache in a folder, which is created at the first use."""

    folder: Path

    def hold(self, key: str) -> Hold | None:
        """Take the lock of a key now. Returns None if another process has it."""
        return hold_now(self._lock_path(key))

    def wait(self, key: str, waiting: Callable[[], None]) -> Hold:
        """Wait for the lock of a key. `waiting` is called repeatedly."""
        return hold_later(self._lock_path(key), waiting)

    def take(self, key: str, folder: Path, believed: Believed) -> dict[str, Any] | None:
        """Copy an entry's files into a folder. Returns the entry's facts, or None if it is missing, damaged or not
        believed; then the folder may hold some files.

        Raises GratingError if the folder cannot be written into."""
        record = self.record(key)
        if record is None:
            return None
        for name, expected in record.fingerprints.items():
            if not _is_copied(self.file(key, name), folder / name, expected):
                return None
        if not believed(record.facts, folder):
            return None
        with contextlib.suppress(OSError):  # a cache that only others may change
            self._used_at(key, server_now_ns(self.folder))
        return record.facts

    def record(self, key: str) -> Record | None:
        """The record of an entry; None if it is missing or damaged."""
        try:
            kept = read_json(self._record_path(key), "bake it again")
            fingerprints = dict(kept["files"])
            facts = {**kept["facts"], "files": list(kept["files"])}
        except (GratingError, KeyError, TypeError, ValueError):
            return None
        return Record(kept.get("of"), facts, fingerprints) if all(map(_is_plain, fingerprints)) else None

    def file(self, key: str, name: str) -> Path:
        """The path of an entry's file."""
        return self._entry(key) / "files" / name

    def put(self, key: str, folder: Path, facts: dict[str, Any], *, of: Mapping[str, Any]) -> bool:
        """Store a bake's files from a folder. Returns whether they are stored: not if the key has an entry already.

        Raises OSError if the bake cannot be stored."""
        entry = self._entry(key)
        partial = self._partials / f"{key}.{machine_name()}.{secrets.token_hex(8)}"
        names = [Path(file).name for file in facts["files"]]
        (partial / "files").mkdir(parents=True)
        try:
            for name in names:
                shutil.copyfile(folder / name, partial / "files" / name)
            kept = {
                "of": of,
                "facts": {fact: value for fact, value in facts.items() if fact != "files"},
                "files": {name: fingerprint(folder / name) for name in names},
            }
            (partial / "record.json").write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
            entry.parent.mkdir(exist_ok=True)
            try:
                partial.rename(entry)
            except OSError:
                if not entry.exists():
                    raise
                return False
        finally:
            remove_folder(partial)
        return True

    def clear(self, key: str) -> None:
        """Remove the entry of a key, whose Hold the caller has."""
        remove_folder(self._entry(key))

    def tidy(self, used: str, hold: Hold, limits: Limits) -> None:
        """Remove leftovers of killed processes, then the least recently used entries until the rest fits the limits.

        `hold` is this process's Hold of the key `used`, whose entry stays. Entries locked by other processes stay too.
        Raises OSError if the folder is unreadable."""
        self._sweep(used, hold)
        entries, locks = (self._keys(name) for name in ("entries", "locks"))
        for key in (self._keys("partial") | locks - entries) - {used}:
            self._discard(key, entry=False)
        if limits != Limits():
            for _ in self.evict(limits, spared=used):
                pass

    def evict(self, limits: Limits, *, spared: str = "", dry_run: bool = False) -> Iterator[Entry]:
        """Remove the least recently used entries until the rest fits the limits, and yield each.

        The entry of `spared` stays, and so do entries whose lock is held. A dry run removes nothing. Raises OSError if
        the folder is unreadable."""
        entries = sorted(self.entries(), key=lambda entry: -entry.unused_ns)
        excess_bytes = sum(entry.size_bytes for entry in entries) - limits.size_bytes
        for entry in entries:
            if entry.unused_ns < 0 and not dry_run:
                # The server's clock was set back. The entry counts as used now, and not as used for ever.
                with contextlib.suppress(OSError):
                    self._used_at(entry.key, server_now_ns(self.folder))
            # Over NFS a process is not stopped by its own lock, so the entry just used is skipped by its key.
            if entry.key == spared or not (excess_bytes > 0 or entry.unused_ns > limits.unused_ns):
                continue
            if self.is_held(entry.key) if dry_run else not self._discard(entry.key, entry=True):
                continue
            excess_bytes -= entry.size_bytes
            yield entry

    def entries(self) -> Iterator[Entry]:
        """All entries. Raises OSError if the folder is unreadable."""
        keys = sorted(self._keys("entries"))
        now_ns = self._now_ns() if keys else 0
        for key in keys:
            # Another process may be removing this entry.
            with contextlib.suppress(FileNotFoundError):
                folder, record = self._entry(key), self._record_path(key)
                size_bytes = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
                used_ns = (record if record.exists() else folder).stat().st_mtime_ns
                yield Entry(key, size_bytes, now_ns - used_ns)

    def is_held(self, key: str) -> bool:
        """Whether another process holds the lock of a key."""
        if not self._lock_path(key).exists():
            return False
        hold = self.hold(key)
        if hold is None:
            return True
        with hold:
            return False

    def _now_ns(self) -> int:
        """The server's time; if no file can be made, as on a full disk, the time of the last use of any entry."""
        try:
            return server_now_ns(self.folder)
        except OSError:
            records = (self._record_path(key) for key in self._keys("entries"))
            return max((record.stat().st_mtime_ns for record in records if record.exists()), default=0)

    def _used_at(self, key: str, now_ns: int) -> None:
        utime(self._record_path(key), ns=(now_ns, now_ns))

    def _sweep(self, key: str, hold: Hold) -> None:
        left = list(self._partials.glob(f"{key}*"))
        if left:
            now_ns = self._now_ns()
            for partial in left:
                if is_left_behind(partial, hold, now_ns):
                    remove_folder(partial)

    def _discard(self, key: str, *, entry: bool) -> bool:
        """Remove a key's leftovers, and its entry if asked, unless its lock is held. Returns whether it was free."""
        hold = self.hold(key)
        if hold is None or hold.fault is not None:
            return False
        with hold:
            self._sweep(key, hold)
            if entry:
                self.clear(key)
            if hold.is_locked and not self._entry(key).exists():
                # Windows does not remove an open file, so an empty lock file stays there.
                with contextlib.suppress(OSError):
                    hold.path.unlink()
        return True

    def _keys(self, name: str) -> set[str]:
        """The keys in one of the three folders."""
        folder = self.folder / name
        found = folder.iterdir() if folder.is_dir() else ()
        return {key for path in found if _KEY.fullmatch(key := path.name.partition(".")[0])}

    @property
    def _partials(self) -> Path:
        return self.folder / "partial"

    def _entry(self, key: str) -> Path:
        return self.folder / "entries" / key

    def _record_path(self, key: str) -> Path:
        return self._entry(key) / "record.json"

    def _lock_path(self, key: str) -> Path:
        return self.folder / "locks" / f"{key}.lock"


def _is_plain(name: str) -> bool:
    """Whether a name is a plain file name of a picture, without a folder."""
    return Path(name).name == name and name.endswith(".exr")


def _is_copied(source: Path, target: Path, expected: Any) -> bool:
    """Copy a file. Returns whether the copy has the expected fingerprint; if not, the copy may be incomplete.

    Raises GratingError if the target cannot be written: a full disk does not mean that the source is damaged."""
    hashed, size_bytes = hashlib.sha256(), 0
    try:
        if source.is_symlink() or not source.is_file():
            return False
        opened = source.open("rb")
    except (OSError, ValueError):
        return False
    with opened, told_of(target), target.open("wb") as copy:
        while chunk := _read(opened):
            hashed.update(chunk)
            size_bytes += len(chunk)
            copy.write(chunk)
    return {"bytes": size_bytes, "sha256": hashed.hexdigest()} == expected


def _read(file: Any) -> bytes:
    """The next bytes of a file; none if it cannot be read, so that its copy has another fingerprint."""
    try:
        return file.read(_CHUNK_BYTES)
    except OSError:
        return b""


def fingerprint(path: Path) -> dict[str, int | str]:
    """Size and SHA-256 of a file. Raises OSError if it cannot be read."""
    with path.open("rb") as file:
        return {"bytes": path.stat().st_size, "sha256": hashlib.file_digest(file, "sha256").hexdigest()}


def remove_folder(folder: Path) -> None:
    """Remove a folder, or a link in its place but not the link's target."""
    if folder.is_symlink():
        folder.unlink()
    shutil.rmtree(folder, ignore_errors=True)

# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache of bakes, so that the same surface is baked only once, even by two processes at the same time.

The key of a bake is a hash of everything that its result depends on. The cache is a folder:

    entries/KEY/record.json   the facts of the bake, and size and SHA-256 of each of its files; its modification time is
                              the time of last use
    entries/KEY/files/        the files that the bake wrote
    partial/KEY/              an unfinished entry; it is renamed into entries/ when it is complete
    locks/KEY.lock            locked, through the operating system, by the process that bakes or takes KEY; the system
                              releases the lock when this process dies

Only the process that holds a key's lock touches the key's entry and the key's partial folders, here and in outputs.

An entry is used only if its record is valid and each file matches the record. Otherwise the bake is made again.
"""

import contextlib
import hashlib
import json
import math
import os
import platform
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..base.failure import GratingError, printable
from ..base.files import partial_folder, told_of
from ..base.locks import try_lock
from ..base.progress import Progress, silent
from ..base.strict_json import read_json
from ..surface.height_map import HeightMap
from ..table.atlas_file import FORMAT
from .request import BakeRequest

# Part of every key. Raise it with every change of the bake's results that leaves atlas_file.FORMAT unchanged. Older
# entries are then never used again, and the eviction removes them in time.
BAKE_VERSION = 15
# The environment variables that set the cache's folder and its size limit in MiB.
FOLDER_VARIABLE = "NATURAL_GRATINGS_CACHE"
LIMIT_VARIABLE = "NATURAL_GRATINGS_CACHE_MB"
# The size limit in MiB if none is set.
_LIMIT_MIB = 2048
# Time in seconds between two tries to get a lock, too short to notice.
_POLL_SECONDS = 0.1
# The stage that a process reports while another process bakes the same surface.
WAITING = "waiting for another bake of the same surface"


def key_of(height_maps: Sequence[HeightMap], request: BakeRequest) -> str:
    """The key of a bake: the SHA-256, in hexadecimal, of heights, pixel size, request, versions and the processor.

    The key includes the names of source and channel, because the bake's header holds them, but not the folder."""
    surfaces = [
        {
            "heights_sha256": hashlib.sha256(np.ascontiguousarray(one.height_m, dtype="<f8").data).hexdigest(),
            "shape": one.height_m.shape,
            "pixel_size_m": one.pixel_size_m,
            "periodic": one.periodic,
            "source": [one.source_name, one.channel],
        }
        for one in height_maps
    ]
    parameters = {key: value for key, value in request.as_dict().items() if key != "scans"}
    versions = [FORMAT, BAKE_VERSION, np.__version__, *_processor()]
    content = {"versions": versions, "surfaces": surfaces, "parameters": parameters}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _processor() -> list[str]:
    """The kind of processor, and the vector instructions that NumPy found on it. They choose the code of NumPy and its
    BLAS, and other code rounds sums in another order."""
    return [platform.machine(), *np.show_config(mode="dicts").get("SIMD Extensions", {}).get("found", ())]


def bake_once(
    key: str,
    output: Path,
    make: Callable[[Path], dict[str, Any]],
    *,
    believed: Callable[[Mapping[str, Any]], bool],
    progress: Progress = silent,
) -> dict[str, Any]:
    """Bring the bake of a key into the folder `output`, from the cache or by `make`. The folder is created if missing.

    make      writes the bake's files into a folder; returns the bake's facts, with the files' paths under `files`
    believed  whether facts, with file names under `files`, are valid results of `make` for this key
    progress  called with the stage WAITING while this process waits for another one that bakes the same surface

    Returns the facts, and under `cached` whether they came from the cache. An unusable cache only causes a warning.

    Raises GratingError for an invalid size limit or if the files cannot be written, and whatever `make` raises."""
    limit_bytes = size_limit()
    try:
        cache = Cache(default_folder(), limit_bytes)
        lock = cache.lock(key, lambda: progress(WAITING, 0.0))
    except OSError as error:
        _warn(error)
        return {**make(output), "cached": False}
    with lock, _staging(output, key) as staging:
        taken = cache.take(key, staging, believed)
        if taken is None:
            for left in staging.iterdir():  # of a damaged entry
                left.unlink()
        facts = make(staging) if taken is None else taken
        try:
            if taken is None:
                cache.put(key, staging, facts)
            cache.tidy(key)
        except OSError as error:
            _warn(error)
        names = [Path(file).name for file in facts["files"]]
        for name in names:
            (staging / name).replace(output / name)
    return {**facts, "files": [str(output / name) for name in names], "cached": taken is not None}


def default_folder() -> Path:
    """The cache's folder: $NATURAL_GRATINGS_CACHE, or else `~/.cache/natural-gratings`.

    Blender sets the variable for its jobs to the folder that addon/gratings/cache_folder.py names.
    Raises OSError if the variable is not set and the user has no home folder."""
    chosen = os.environ.get(FOLDER_VARIABLE)
    if chosen:
        return Path(chosen)
    try:
        return Path.home() / ".cache" / "natural-gratings"
    except RuntimeError as error:
        raise OSError(f"no home folder; set {FOLDER_VARIABLE}") from error


def size_limit() -> int:
    """The cache's size limit in bytes: $NATURAL_GRATINGS_CACHE_MB in MiB, or else 2 GiB.

    Raises GratingError if the variable does not hold a size."""
    text = os.environ.get(LIMIT_VARIABLE) or str(_LIMIT_MIB)
    try:
        limit_mib = float(text)
    except ValueError:
        limit_mib = math.nan
    if not 0 <= limit_mib < math.inf:
        raise GratingError(f"{LIMIT_VARIABLE} {text}", "not a size", f"give a number of MiB, such as {_LIMIT_MIB}")
    return int(limit_mib * 2**20)


@dataclass(frozen=True)
class Entry:
    """An entry for the eviction: its key, its bytes, and the time of its last use in nanoseconds."""

    key: str
    size_bytes: int
    used_ns: int


@dataclass(frozen=True)
class Cache:
    """The cache in a folder, which is created at the first use.

    It holds at most `limit_bytes`, or a single larger entry."""

    folder: Path
    limit_bytes: int

    def lock(self, key: str, waiting: Callable[[], None]) -> BinaryIO:
        """Take the lock of a key. It is released when it is closed or when the process ends.

        `waiting` is called repeatedly while another process has the lock. Raises OSError if the folder cannot be
        used."""
        self._lock_path(key).parent.mkdir(parents=True, exist_ok=True)
        while (lock := try_lock(self._lock_path(key))) is None:
            waiting()
            time.sleep(_POLL_SECONDS)
        return lock

    def take(self, key: str, folder: Path, believed: Callable[[Mapping[str, Any]], bool]) -> dict[str, Any] | None:
        """Copy an entry's files into a folder. Returns the entry's facts, or None if it is missing or damaged.

        The caller must hold the key's lock. Raises GratingError if the folder cannot be written into."""
        entry = self._entry(key)
        record = entry / "record.json"
        try:
            kept = read_json(record, "bake it again")
            facts, fingerprints = {**kept["facts"], "files": list(kept["files"])}, dict(kept["files"])
        except (GratingError, KeyError, TypeError, ValueError):
            return None
        if not (all(map(_is_plain, fingerprints)) and believed(facts)):
            return None
        for name, expected in fingerprints.items():
            if not _is_copied(entry / "files" / name, folder / name, expected):
                return None
        with contextlib.suppress(OSError):
            os.utime(record)
        return facts

    def put(self, key: str, folder: Path, facts: dict[str, Any]) -> None:
        """Store a bake's files from a folder, in place of an older entry.

        The caller must hold the key's lock. Raises OSError if the bake cannot be stored."""
        partial, entry = self._partial(key), self._entry(key)
        names = [Path(file).name for file in facts["files"]]
        partial.parent.mkdir(exist_ok=True)
        _remove(partial)
        partial.mkdir()
        try:
            (partial / "files").mkdir()
            for name in names:
                shutil.copyfile(folder / name, partial / "files" / name)
            kept = {
                "facts": {fact: value for fact, value in facts.items() if fact != "files"},
                "files": {name: _fingerprint(folder / name) for name in names},
            }
            (partial / "record.json").write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
            entry.parent.mkdir(exist_ok=True)
            _remove(entry)
            partial.rename(entry)
        finally:
            _remove(partial)

    def tidy(self, used: str) -> None:
        """Remove leftovers of killed processes, then the least recently used entries until the rest fits the limit.

        The entry of `used` and entries locked by other processes stay. Raises OSError if the folder is unreadable."""
        left = {path.name for path in _listed(self.folder / "partial")}
        locked = {path.stem for path in _listed(self.folder / "locks")}
        for key in (left | locked) - {used}:
            if key in left or not self._entry(key).exists():
                self._discard(key, entry=False)
        entries = sorted(self._entries(), key=lambda entry: entry.used_ns)
        excess_bytes = sum(entry.size_bytes for entry in entries) - self.limit_bytes
        for entry in entries:
            # Over NFS a process is not stopped by its own lock, so the entry just used is skipped by its key.
            if excess_bytes > 0 and entry.key != used and self._discard(entry.key, entry=True):
                excess_bytes -= entry.size_bytes

    def _discard(self, key: str, entry: bool) -> bool:
        """Remove a key's leftovers, and its entry if asked, unless its lock is held. Returns whether it was free."""
        lock = try_lock(self._lock_path(key))
        if lock is None:
            return False
        with lock:
            _remove(self._partial(key))
            if entry:
                _remove(self._entry(key))
            if not self._entry(key).exists():
                # Windows does not remove an open file, so an empty lock file stays there.
                with contextlib.suppress(OSError):
                    self._lock_path(key).unlink()
        return True

    def _entries(self) -> Iterator[Entry]:
        for folder in _listed(self.folder / "entries"):
            # Another process may be removing this entry.
            with contextlib.suppress(FileNotFoundError):
                size_bytes = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
                record = folder / "record.json"
                used_ns = (record if record.exists() else folder).stat().st_mtime_ns
                yield Entry(folder.name, size_bytes, used_ns)

    def _entry(self, key: str) -> Path:
        return self.folder / "entries" / key

    def _partial(self, key: str) -> Path:
        return self.folder / "partial" / key

    def _lock_path(self, key: str) -> Path:
        return self.folder / "locks" / f"{key}.lock"


@contextlib.contextmanager
def _staging(output: Path, key: str) -> Iterator[Path]:
    """Create a partial folder in `output` for the files of a bake.

    Leftovers of killed processes for the same key are removed, and so is `output` if it was created here and stays
    empty. Raises GratingError if the folder cannot be created."""
    is_new = not output.exists()
    label = f"bake.{key[:16]}"
    try:
        with told_of(output):
            output.mkdir(parents=True, exist_ok=True)
            for left in output.glob(f".{label}.*.partial"):
                _remove(left)
            with partial_folder(output, label) as folder:
                yield folder
    finally:
        if is_new:
            with contextlib.suppress(OSError):
                output.rmdir()


def _is_plain(name: str) -> bool:
    """Whether a name is a plain file name of a picture, without a folder."""
    return Path(name).name == name and name.endswith(".exr")


def _is_copied(source: Path, target: Path, expected: Any) -> bool:
    """Copy a file if it has the expected fingerprint. Returns whether it has.

    Raises GratingError if the target cannot be written: a full disk does not mean that the source is damaged."""
    try:
        if source.is_symlink() or not source.is_file() or _fingerprint(source) != expected:
            return False
    except (OSError, ValueError):
        return False
    with told_of(target):
        shutil.copyfile(source, target)
    return True


def _fingerprint(path: Path) -> dict[str, int | str]:
    with path.open("rb") as file:
        return {"bytes": path.stat().st_size, "sha256": hashlib.file_digest(file, "sha256").hexdigest()}


def _listed(folder: Path) -> list[Path]:
    return list(folder.iterdir()) if folder.is_dir() else []


def _remove(folder: Path) -> None:
    """Remove a folder, or a link in its place but not the link's target."""
    if folder.is_symlink():
        folder.unlink()
    shutil.rmtree(folder, ignore_errors=True)


def _warn(error: OSError) -> None:
    what = f"{default_folder()}: {error.strerror}" if error.filename else error
    print(printable(f"warning: the cache of bakes cannot be used ({what}); set {FOLDER_VARIABLE}"), file=sys.stderr)

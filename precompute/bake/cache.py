# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes kept by what they are made from: the same surface is baked once, by two processes at once as well.

    entries/KEY/record.json   the facts of the bake, size and SHA-256 of each of its files; its time is the last use
    entries/KEY/files/        what the bake wrote
    partial/KEY/              an entry in the making, renamed into entries/ once it is whole
    locks/KEY.lock            held, through the operating system, by whoever bakes or takes KEY: dying releases it

Only the holder of a key's lock touches its entry, its partial folder, and that key's partial folders in an output.
"""

import contextlib
import hashlib
import json
import math
import os
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..base.failure import GratingError
from ..base.progress import Progress, silent
from ..surface.height_map import HeightMap
from ..table.atlas_file import FORMAT
from .request import BakeRequest

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None
    import msvcrt


# To be raised with every change of the bake's results that leaves atlas.FORMAT as it is: older entries are then left
# to the eviction.
BAKE_VERSION = 4


FOLDER_VARIABLE = "NATURAL_GRATINGS_CACHE"


LIMIT_VARIABLE = "NATURAL_GRATINGS_CACHE_MB"


_LIMIT_MIB = 2048


_POLL_SECONDS = 0.1


WAITING = "waiting for another bake of the same surface"


def key_of(height_maps: Sequence[HeightMap], request: BakeRequest) -> str:
    """The key of a bake: SHA-256, in hexadecimal, of heights, pixel size, what is asked of the bake, and versions.

    The source's name and channel are part of it, as they are of the file that a bake writes; its folder is not."""
    surfaces = [
        {
            "heights_sha256": hashlib.sha256(np.ascontiguousarray(one.height_m, dtype="<f8")).hexdigest(),
            "shape": one.height_m.shape,
            "pixel_size_m": one.pixel_size_m,
            "periodic": one.periodic,
            "source": [one.source_name, one.channel],
        }
        for one in height_maps
    ]
    parameters = {key: value for key, value in request.as_dict().items() if key != "scans"}
    content = {"versions": [FORMAT, BAKE_VERSION], "surfaces": surfaces, "parameters": parameters}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def bake_once(
    key: str,
    output: Path,
    make: Callable[[Path], dict],
    progress: Progress = silent,
) -> dict:
    """Bring the bake of a key into the folder `output`, from the cache or else by `make`; its facts, and `cached`.

    make      writes the bake's files into the folder that it is given; its facts, with the paths under `files`
    progress  hears if another process is at the same bake: this one then waits, and takes what that one made

    A cache that cannot be used costs a line of warning and nothing else. Raises GratingError if the size limit in the
    environment is none, and whatever `make` raises."""
    limit_bytes = size_limit()
    try:
        cache = Cache(default_folder(), limit_bytes)
        lock = cache.lock(key, lambda: progress(WAITING, 0.0))
    except OSError as error:
        _warn(error)
        return {**make(output), "cached": False}
    with lock, _staging(output, key) as staging:
        facts = cache.take(key, staging)
        cached = facts is not None
        if not cached:
            # Of a damaged entry something may have come.
            _remove(staging)
            facts = make(staging)
        try:
            if not cached:
                cache.put(key, staging, facts)
            cache.tidy(key)
        except OSError as error:
            _warn(error)
        names = [Path(file).name for file in facts["files"]]
        for name in names:
            (staging / name).replace(output / name)
    return {**facts, "files": [str(output / name) for name in names], "cached": cached}


def default_folder() -> Path:
    """$NATURAL_GRATINGS_CACHE, else `~/.cache/natural-gratings`. Raises OSError if the user has no home."""
    chosen = os.environ.get(FOLDER_VARIABLE)
    if chosen:
        return Path(chosen)
    try:
        return Path.home() / ".cache" / "natural-gratings"
    except RuntimeError as error:
        raise OSError(f"no home folder; set {FOLDER_VARIABLE}") from error


def size_limit() -> int:
    """Bytes that the cache may take: $NATURAL_GRATINGS_CACHE_MB in MiB, else 2 GiB. Raises GratingError if that is
    not a size."""
    text = os.environ.get(LIMIT_VARIABLE) or str(_LIMIT_MIB)
    try:
        limit_mib = float(text)
    except ValueError:
        limit_mib = math.nan
    if not 0 <= limit_mib < math.inf:
        raise GratingError(f"{LIMIT_VARIABLE} {text}: not a size; give a number of MiB, such as {_LIMIT_MIB}")
    return int(limit_mib * 2**20)


@dataclass(frozen=True)
class Entry:
    """What the eviction must know of an entry."""

    key: str
    size_bytes: int
    used_ns: int


@dataclass(frozen=True)
class Cache:
    """The cache in a folder, made when first used, of `limit_bytes` at most (or one entry, if that is larger)."""

    folder: Path
    limit_bytes: int

    def lock(self, key: str, waiting: Callable[[], None]) -> BinaryIO:
        """The lock of a key, free when closed or when the process ends; `waiting` is called while another has it.
        Raises OSError if the folder cannot be used."""
        self._lock_path(key).parent.mkdir(parents=True, exist_ok=True)
        while (lock := self._try_lock(key)) is None:
            waiting()
            time.sleep(_POLL_SECONDS)
        return lock

    def take(self, key: str, folder: Path) -> dict | None:
        """Copy an entry's files into a folder; its facts, or None if there is no entry or it is damaged. For the
        holder of the key's lock."""
        entry = self._entry(key)
        record = entry / "record.json"
        try:
            kept = json.loads(record.read_text(encoding="utf-8"))
            folder.mkdir(parents=True, exist_ok=True)
            for name, expected in kept["files"].items():
                shutil.copyfile(entry / "files" / name, folder / name)
                if _fingerprint(folder / name) != expected:
                    return None
            with contextlib.suppress(OSError):
                os.utime(record)
            return {**kept["facts"], "files": list(kept["files"])}
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return None

    def put(self, key: str, folder: Path, facts: dict) -> None:
        """Keep what a bake wrote into a folder, in place of any entry there was. For the holder of the key's lock.
        Raises OSError if it cannot be kept."""
        partial, entry = self._partial(key), self._entry(key)
        names = [Path(file).name for file in facts["files"]]
        _remove(partial)
        try:
            (partial / "files").mkdir(parents=True)
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
        """Remove what killed runs left, then the entries longest unused until the rest fits the limit; never the one
        just used. What another process is at stays. Raises OSError if the folder cannot be read."""
        left = {path.name for path in _listed(self.folder / "partial")}
        locked = {path.stem for path in _listed(self.folder / "locks")}
        for key in (left | locked) - {used}:
            if key in left or not self._entry(key).exists():
                self._discard(key, entry=False)
        entries = sorted(self._entries(), key=lambda entry: entry.used_ns)
        excess_bytes = sum(entry.size_bytes for entry in entries) - self.limit_bytes
        for entry in entries:
            # Over NFS a process is not stopped by its own lock: the one just used is left out by name.
            if excess_bytes > 0 and entry.key != used and self._discard(entry.key, entry=True):
                excess_bytes -= entry.size_bytes

    def _discard(self, key: str, entry: bool) -> bool:
        """Remove a key's leftovers, and its entry if asked, unless its lock is held; whether it was free."""
        lock = self._try_lock(key)
        if lock is None:
            return False
        with lock:
            _remove(self._partial(key))
            if entry:
                _remove(self._entry(key))
            if not self._entry(key).exists():
                # Windows keeps an open file: an empty one stays.
                with contextlib.suppress(OSError):
                    self._lock_path(key).unlink()
        return True

    def _entries(self) -> Iterator[Entry]:
        for folder in _listed(self.folder / "entries"):
            # Another process may be removing it.
            with contextlib.suppress(FileNotFoundError):
                size_bytes = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
                record = folder / "record.json"
                used_ns = (record if record.exists() else folder).stat().st_mtime_ns
                yield Entry(folder.name, size_bytes, used_ns)

    def _try_lock(self, key: str) -> BinaryIO | None:
        path = self._lock_path(key)
        lock = path.open("a+b")
        try:
            if _locked(lock, path):
                return lock
        except BaseException:
            lock.close()
            raise
        lock.close()
        return None

    def _entry(self, key: str) -> Path:
        return self.folder / "entries" / key

    def _partial(self, key: str) -> Path:
        return self.folder / "partial" / key

    def _lock_path(self, key: str) -> Path:
        return self.folder / "locks" / f"{key}.lock"


@contextlib.contextmanager
def _staging(output: Path, key: str) -> Iterator[Path]:
    """A folder in `output`, not made yet, gone afterwards; what killed runs of the same key left goes as well. Its
    name ends like every temporary one, with the process by which a cancelled bake finds its own."""
    prefix = f".bake.{key[:16]}"
    for left in output.glob(f"{prefix}.*.partial"):
        _remove(left)
    folder = output / f"{prefix}.{os.getpid()}.partial"
    try:
        yield folder
    finally:
        _remove(folder)


def _locked(lock: BinaryIO, path: Path) -> bool:
    """Try to lock an open file, without waiting."""
    if fcntl is None:
        try:
            lock.seek(0)
            msvcrt.locking(lock.fileno(), msvcrt.LK_NBLCK, 1)
        except PermissionError:
            return False
        return True
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        # Its last holder may have removed the file since we opened it: the next to come would lock another.
        return os.path.samestat(os.fstat(lock.fileno()), path.stat())
    except (BlockingIOError, FileNotFoundError):
        return False


def _fingerprint(path: Path) -> dict:
    with path.open("rb") as file:
        return {"bytes": path.stat().st_size, "sha256": hashlib.file_digest(file, "sha256").hexdigest()}


def _listed(folder: Path) -> list[Path]:
    return list(folder.iterdir()) if folder.is_dir() else []


def _remove(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)


def _warn(error: OSError) -> None:
    what = f"{error.filename}: {error.strerror}" if error.filename else error
    print(f"warning: the cache of bakes cannot be used ({what}); set {FOLDER_VARIABLE}", file=sys.stderr)

# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache of bakes, so that the same surface is baked only once, even by two processes at the same time.

The key of a bake is a hash of everything that its result depends on. The cache is a folder:

    entries/KEY/record.json   the facts of the bake, and size and SHA-256 of each of its files; the record's time of
                              modification is the time of last use
    entries/KEY/files/        the files that the bake wrote
    partial/KEY/              an entry in the making; it is renamed into entries/ once it is whole
    locks/KEY.lock            locked, through the operating system, by the process that bakes or takes KEY; the system
                              releases the lock when this process dies

Only the process that holds a key's lock touches the key's entry, its partial folder, and the partial folders that the
key has in an output folder.

An entry is believed only if its record is such as a bake leaves and each file is what the record says. Else the entry
is damaged, and the bake is made again.
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

# Part of every key. Raise it with every change of the bake's results that leaves atlas_file.FORMAT as it is. The keys
# of older entries are then never asked for again, and the eviction removes these entries in time.
BAKE_VERSION = 10
# The environment variables that set the cache's folder and its size limit in MiB.
FOLDER_VARIABLE = "NATURAL_GRATINGS_CACHE"
LIMIT_VARIABLE = "NATURAL_GRATINGS_CACHE_MB"
# The size limit in MiB if none is set.
_LIMIT_MIB = 2048
# Time in seconds between two tries to get a lock: a person does not notice this wait.
_POLL_SECONDS = 0.1
# The stage that a process reports while another process bakes the same surface.
WAITING = "waiting for another bake of the same surface"


def key_of(height_maps: Sequence[HeightMap], request: BakeRequest) -> str:
    """The key of a bake: the SHA-256, in hexadecimal, of heights, pixel size, request, versions and the processor.

    The names of the source and of its channel are part of the key, because the header of the bake holds them. The
    folder of the source is no part of it."""
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
    """The kind of processor, and the vector instructions that NumPy found on it. NumPy chooses its code by them, as
    does its library of matrix products, and other code rounds sums in another order."""
    return [platform.machine(), *np.show_config(mode="dicts").get("SIMD Extensions", {}).get("found", ())]


def bake_once(
    key: str,
    output: Path,
    make: Callable[[Path], dict[str, Any]],
    *,
    believed: Callable[[Mapping[str, Any]], bool],
    progress: Progress = silent,
) -> dict[str, Any]:
    """Bring the bake of a key into the folder `output`, which is made if need be, from the cache or else by `make`.

    make      writes the bake's files into the folder that it is given; returns the bake's facts, with the paths of its
              files under `files`
    believed  whether facts, with the names of the files under `files`, are such as `make` returns for this key
    progress  called with the stage WAITING while another process bakes the same surface: this process waits, and then
              takes the other process's result

    Returns the facts, and under `cached` whether they came from the cache. A cache that cannot be used costs one line
    of warning and nothing else.

    Raises GratingError if the environment sets a size limit that is not a size, or if the files cannot be written, and
    whatever `make` raises."""
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

    Raises OSError if the variable is not set and the user has no home folder."""
    chosen = os.environ.get(FOLDER_VARIABLE)
    if chosen:
        return Path(chosen)
    try:
        return Path.home() / ".cache" / "natural-gratings"
    except RuntimeError as error:
        raise OSError(f"no home folder; set {FOLDER_VARIABLE}") from error


def size_limit() -> int:
    """Bytes that the cache may take: $NATURAL_GRATINGS_CACHE_MB in MiB, or else 2 GiB.

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
    """What the eviction must know of an entry: its key, its bytes, and the time of its last use in nanoseconds."""

    key: str
    size_bytes: int
    used_ns: int


@dataclass(frozen=True)
class Cache:
    """The cache in a folder. The folder is made at the first use.

    It holds at most `limit_bytes`, or one entry if this entry alone is larger."""

    folder: Path
    limit_bytes: int

    def lock(self, key: str, waiting: Callable[[], None]) -> BinaryIO:
        """The lock of a key. It is released when it is closed or when the process ends.

        `waiting` is called again and again while another process has the lock. Raises OSError if the folder cannot be
        used."""
        self._lock_path(key).parent.mkdir(parents=True, exist_ok=True)
        while (lock := try_lock(self._lock_path(key))) is None:
            waiting()
            time.sleep(_POLL_SECONDS)
        return lock

    def take(self, key: str, folder: Path, believed: Callable[[Mapping[str, Any]], bool]) -> dict[str, Any] | None:
        """Copy an entry's files into a folder; the facts of the entry, or None if there is none or it is damaged.

        Only the holder of the key's lock may call this. Raises GratingError if the folder cannot be written into."""
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
        """Keep what a bake wrote into a folder, in place of an older entry.

        Only the holder of the key's lock may call this. Raises OSError if the bake cannot be kept."""
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
        """Remove what killed processes left, and then the entries that have not been used for the longest time.

        Entries go until the rest fits the limit. The entry of the key `used` always stays, and so does whatever another
        process has locked. Raises OSError if the folder cannot be read."""
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
    """A partial folder in `output` for the files of a bake in the making.

    What killed processes left in `output` for the same key is removed as well, and so is `output` itself if it was not
    there before and nothing comes into it. Raises GratingError if the folder cannot be made."""
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
    """Whether a name is that of a picture in the folder where it is looked for, and nowhere else."""
    return Path(name).name == name and name.endswith(".exr")


def _is_copied(source: Path, target: Path, expected: Any) -> bool:
    """Copy a file that should have the expected fingerprint; whether it has.

    Raises GratingError if the target cannot be written: a full disk is no damage of the source."""
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
    """Remove a folder, or the link in its place; not what the link leads to."""
    if folder.is_symlink():
        folder.unlink()
    shutil.rmtree(folder, ignore_errors=True)


def _warn(error: OSError) -> None:
    what = f"{default_folder()}: {error.strerror}" if error.filename else error
    print(printable(f"warning: the cache of bakes cannot be used ({what}); set {FOLDER_VARIABLE}"), file=sys.stderr)

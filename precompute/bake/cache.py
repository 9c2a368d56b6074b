# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache of bakes, so that the same surface is baked only once, even by two processes or two machines at a time.

The key of a bake is a hash of everything that its result depends on. Several machines may share the cache's folder
(base/shared_folder.py). It holds

    entries/KEY/record.json   all that the bake depends on, its facts, and size and SHA-256 of each of its files; its
                              modification time is the time of last use, by the clock of the file server
    entries/KEY/files/        the files that the bake wrote
    partial/KEY.MACHINE.*/    an unfinished entry; it is renamed into entries/ when it is complete
    locks/KEY.lock            locked by the process that bakes or removes KEY (base/shared_folder.py)

An entry is used only if its record is valid, each copied file matches the record, and what the files say of themselves
is of this key. So a process may read an entry without the lock: if another process removes the entry meanwhile, the
bake is only made again. The first complete entry of a key stays, and whoever comes second uses that entry too."""

import contextlib
import hashlib
import json
import math
import os
import platform
import re
import secrets
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from os import utime
from pathlib import Path
from typing import Any

import numpy as np

from ..base.failure import GratingError, printable
from ..base.files import partial_folder, told_of
from ..base.progress import Progress, silent
from ..base.shared_folder import Hold, beating, hold_later, hold_now, is_left_behind, machine_name, server_now_ns
from ..base.strict import read_json
from ..surface.height_map import HeightMap
from ..table.atlas import FORMAT, read_record
from .make import are_facts, bake_to_folder, heights_sha256
from .request import BakeRequest

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

    of: dict[str, Any]
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
            of, fingerprints = dict(kept["of"]), dict(kept["files"])
            facts = {**kept["facts"], "files": list(kept["files"])}
        except (GratingError, KeyError, TypeError, ValueError):
            return None
        return Record(of, facts, fingerprints) if all(map(_is_plain, fingerprints)) else None

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


# Part of every key. Raise it with every change of the bake's results that leaves atlas.FORMAT unchanged. Older
# entries are then never used again, and the eviction removes them in time.
BAKE_VERSION = 17
# The environment variables that set the cache's folder, its limits of size in MiB and of unused days, and whether bakes
# of other kinds of processor count.
FOLDER_VARIABLE = "NATURAL_GRATINGS_CACHE"
LIMIT_VARIABLE = "NATURAL_GRATINGS_CACHE_MB"
DAYS_VARIABLE = "NATURAL_GRATINGS_CACHE_DAYS"
SHARED_VARIABLE = "NATURAL_GRATINGS_CACHE_SHARED"
# The size limit in MiB if none is set.
_LIMIT_MIB = 2048
# Heights that differ by less than about this count as the same for a farm: it shifts light of 380 nm by 0.02 degrees of
# phase. The steps begin off the round values, which rounding errors would move to either side.
_SAME_HEIGHT_M, _STEP_BEGIN = 1e-11, 0.381966
NS_OF_A_DAY = 24 * 3600 * 10**9
# The stage that a process reports while another process bakes the same surface.
WAITING = "waiting for another bake of the same surface"


def content_of(height_maps: Sequence[HeightMap], request: BakeRequest) -> dict[str, Any]:
    """All that a bake's result depends on, as of JSON: heights, pixel size, request, versions and processor.

    It includes the names of source and channel, because the bake's header holds them, but not the folder.

    By default a machine takes no bake of another kind of processor, so that a bake has the same bytes with and without
    the cache. If $NATURAL_GRATINGS_CACHE_SHARED is 1, the content leaves out the processor and the last digits of the
    heights, which for a synthetic surface depend on it too: a farm of mixed machines bakes once, and all its machines
    use the bytes of the first bake. Bakes of two kinds of processor differ far less than the error of a bake.

    Raises GratingError if the variable holds another text than 0 or 1."""
    is_shared = _is_shared()
    surfaces = [
        {
            **(_steps_of(one.height_m) if is_shared else {"heights_sha256": heights_sha256(one)}),
            "shape": one.height_m.shape,
            "pixel_size_m": one.pixel_size_m,
            "periodic": one.periodic,
            "source": [one.source_name, one.channel],
        }
        for one in height_maps
    ]
    parameters = {key: value for key, value in request.as_dict().items() if key != "scans"}
    versions = [FORMAT, BAKE_VERSION, np.__version__, *(() if is_shared else _processor())]
    content = {"versions": versions, "surfaces": surfaces, "parameters": parameters}
    return dict(json.loads(json.dumps(content)))


def key_of(content: Any) -> str:
    """The key of a bake: the SHA-256, in hexadecimal, of all that its result depends on."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def is_of(content: Any, pictures: Sequence[Path]) -> bool:
    """Whether the headers of a bake's pictures have the request and the surfaces of a content. Other bakes' files may
    have been copied into an entry. Heights that leave out their last digits are not compared."""
    try:
        surfaces = content["surfaces"]
        told = {
            "heights_sha256": [each.get("heights_sha256") for each in surfaces],
            "source": ", ".join(each["source"][0] for each in surfaces),
            "channel": surfaces[0]["source"][1], "shape": surfaces[0]["shape"],
            "pixel_size_m": surfaces[0]["pixel_size_m"],
        }  # fmt: skip
        if None in told["heights_sha256"]:
            del told["heights_sha256"]
        for record in map(read_record, pictures):
            parameters = {key: value for key, value in record["request"].items() if key != "scans"}
            if parameters != content["parameters"] or any(record[key] != value for key, value in told.items()):
                return False
    except (GratingError, AttributeError, KeyError, IndexError, TypeError):
        return False
    return True


def _processor() -> list[str]:
    """The kind of processor, and the vector instructions that NumPy found on it. They choose the code of NumPy and its
    BLAS, and other code rounds sums in another order."""
    return [platform.machine(), *np.show_config(mode="dicts").get("SIMD Extensions", {}).get("found", ())]


def _steps_of(height_m: np.ndarray) -> dict[str, str]:
    """The SHA-256 of heights in steps that count as the same for a farm."""
    steps = np.floor(height_m / _SAME_HEIGHT_M + _STEP_BEGIN) + 0.0  # without negative zeros
    return {"steps_sha256": hashlib.sha256(np.ascontiguousarray(steps, dtype="<f8").data).hexdigest()}


def _is_shared() -> bool:
    text = os.environ.get(SHARED_VARIABLE) or "0"
    if text not in ("0", "1"):
        raise GratingError(f"{SHARED_VARIABLE} {text}", "neither 0 nor 1", "give 1 to share bakes between processors")
    return text == "1"


def cached_bake(
    height_maps: Sequence[HeightMap], request: BakeRequest, output: Path, *, progress: Progress = silent
) -> dict[str, Any]:
    """Bring the bake of height maps into the folder `output`, from the cache or by bake_to_folder. Returns the facts of
    bake_once, and raises as it does."""
    content = content_of(height_maps, request)

    def make(folder: Path, progress: Progress) -> dict[str, Any]:
        return bake_to_folder(height_maps, request, folder, progress=progress)

    def believed(facts: Mapping[str, Any], folder: Path) -> bool:
        return are_facts(facts, height_maps) and is_of(content, [folder / name for name in facts["files"]])

    return bake_once(key_of(content), output, make, of=content, believed=believed, progress=progress)


def bake_once(
    key: str,
    output: Path,
    make: Callable[[Path, Progress], dict[str, Any]],
    *,
    of: Mapping[str, Any],
    believed: Believed,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Bring the bake of a key into the folder `output`, from the cache or by `make`. The folder is created if missing.

    make      writes the bake's files into a folder, and reports its progress, by which other processes know that this
              one lives; returns the bake's facts, with the files' paths under `files`
    of        all that the bake depends on, of which the key is; kept with it, so that a check of the cache can compare
    believed  whether facts, with file names under `files`, and the files in a folder are valid results of `make` for
              this key
    progress  the progress of `make`; the stage is WAITING while another process bakes the same surface

    Returns the facts, and under `cached` whether they came from the cache. An unusable cache only causes a warning.

    Raises GratingError for an invalid limit or if the files cannot be written, and whatever `make` raises."""
    limits = limits_set()
    try:
        cache = Cache(default_folder())
    except OSError as error:
        _warn(error)
        return {**make(output, progress), "cached": False}
    hold = cache.hold(key)
    if hold is None:
        taken = _taken_without_lock(cache, key, output, believed)
        if taken is not None:
            return taken
        hold = cache.wait(key, lambda: progress(WAITING, 0.0))
    with hold, _staging(output, key, is_locked=hold.is_locked) as staging:
        _sweep(staging, hold)
        folder, facts = staging, cache.take(key, staging, believed)
        is_cached = facts is not None
        if facts is None:
            if hold.fault is None:
                cache.clear(key)  # it is damaged
            for left in staging.iterdir():
                left.unlink()
            facts = make(staging, beating(progress, hold.path, staging))
            if not _keep(cache, key, hold, folder=staging, facts=facts, of=of):
                folder = staging / "first"
                folder.mkdir()
                first = cache.take(key, folder, believed)
                folder, facts = (staging, facts) if first is None else (folder, first)
        if hold.fault is None:
            with _warned(hold):
                cache.tidy(key, hold, Limits() if is_cached else limits)
        return _delivered(folder, output, facts, is_cached=is_cached)


def _taken_without_lock(cache: Cache, key: str, output: Path, believed: Believed) -> dict[str, Any] | None:
    """Bring an entry into the output while another process has the lock: the copies are compared with the record, so
    reading needs no lock. Returns None if there is no whole entry."""
    if cache.record(key) is None:
        return None
    with _staging(output, key, is_locked=False) as staging:
        facts = cache.take(key, staging, believed)
        return None if facts is None else _delivered(staging, output, facts, is_cached=True)


def _delivered(folder: Path, output: Path, facts: dict[str, Any], *, is_cached: bool) -> dict[str, Any]:
    """Move a bake's files into the output. Returns the facts with their new paths."""
    names = [Path(file).name for file in facts["files"]]
    for name in names:
        with told_of(output / name):
            (folder / name).replace(output / name)
    return {**facts, "files": [str(output / name) for name in names], "cached": is_cached}


def _keep(
    cache: Cache, key: str, hold: Hold, *, folder: Path, facts: dict[str, Any], of: Mapping[str, Any]
) -> bool:  # fmt: skip
    """Store a bake's files. Returns False if another process stored its bake first, for example another machine that
    does not see the lock: then all machines use the bytes of that bake. A failure only causes a warning."""
    with _warned(hold):
        if hold.fault is not None:
            raise hold.fault
        return cache.put(key, folder, facts, of=of)
    return True


@contextlib.contextmanager
def _warned(hold: Hold) -> Iterator[None]:
    """Turn an error of the cache in the `with` block into a warning, the only one for this Hold."""
    try:
        yield
    except OSError as error:
        hold.fault = error
        _warn(error)


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


def limits_set() -> Limits:
    """The cache's limits: $NATURAL_GRATINGS_CACHE_MB in MiB, or else 2 GiB, and $NATURAL_GRATINGS_CACHE_DAYS, or else
    no limit of age.

    Raises GratingError if a variable does not hold a number."""
    size_mib = _number_set(LIMIT_VARIABLE, _LIMIT_MIB, f"give a number of MiB, such as {_LIMIT_MIB}")
    days = _number_set(DAYS_VARIABLE, math.inf, "give a number of days, such as 30")
    return Limits(size_mib * 2**20, days * NS_OF_A_DAY)


def _number_set(variable: str, default: float, remedy: str) -> float:
    text = os.environ.get(variable)
    if not text:
        return default
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not 0 <= found < math.inf:
        raise GratingError(f"{variable} {text}", "not a number from 0 up", remedy)
    return found


@contextlib.contextmanager
def _staging(output: Path, key: str, *, is_locked: bool) -> Iterator[Path]:
    """Create a partial folder in `output` for the files of a bake. `output` is removed if it was created here and stays
    empty. Raises GratingError if the folder cannot be created.

    Only with the key's lock, which one process has at a time, does the folder's name have this machine's name: then the
    next process with the lock knows that the folder is left behind."""
    is_new = not output.exists()
    owner = machine_name() if is_locked else "unlocked"
    try:
        with contextlib.ExitStack() as stack:
            with told_of(output):
                output.mkdir(parents=True, exist_ok=True)
                folder = stack.enter_context(partial_folder(output, f"bake.{key[:16]}.{owner}"))
            yield folder
    finally:
        if is_new:
            with contextlib.suppress(OSError):
                output.rmdir()


def _sweep(staging: Path, hold: Hold) -> None:
    """Remove what killed processes left of the same bake, beside this process's own partial folder."""
    label = ".".join(staging.name.split(".")[:3])  # .bake.KEY
    others = [left for left in staging.parent.glob(f"{label}.*.partial") if left != staging]
    if others:
        now_ns = server_now_ns(staging.parent)
        for left in others:
            if is_left_behind(left, hold, now_ns):
                remove_folder(left)


def _warn(error: OSError) -> None:
    what = f"{default_folder()}: {error.strerror}" if error.filename else error
    print(printable(f"warning: the cache of bakes cannot be used ({what}); set {FOLDER_VARIABLE}"), file=sys.stderr)


class State(StrEnum):
    """The state of an entry."""

    WHOLE = "whole"
    DAMAGED = "damaged"
    OTHER_VERSION = "of another version"
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
    if cache.is_held(entry.key):
        state = State.IN_USE
    elif not all(_has(cache.file(entry.key, name), size) for name, size in sizes.items()):
        state = State.DAMAGED
    else:
        state = State.OTHER_VERSION if _is_of_other_version(record) else State.WHOLE
    name = next((Path(name).stem for name in record.fingerprints), "")
    return Listed(entry, name, _p99(record.facts), state)


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
        return are_whole and (_is_of_other_version(record) or is_of(record.of, list(files)))
    except (OSError, ValueError):
        return False


def _is_of_other_version(record: Record) -> bool:
    """Whether another version of the extension made a bake, whose headers this one may not read."""
    versions = record.of.get("versions")
    return isinstance(versions, list) and versions[:2] != [FORMAT, BAKE_VERSION]


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

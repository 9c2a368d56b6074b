# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache of bakes, so that the same surface is baked only once, even by two processes or two machines at a time.

The key of a bake is a hash of everything that its result depends on. cache_store.py keeps the bakes by their keys, and
base/shared_folder.py tells what it does about a folder that several machines share.
"""

import contextlib
import hashlib
import json
import math
import os
import platform
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base.failure import GratingError, printable
from ..base.files import partial_folder, told_of
from ..base.progress import Progress, silent
from ..base.shared_folder import Hold, beating, is_left_behind, machine_name, server_now_ns
from ..surface.height_map import HeightMap
from ..table.atlas_file import FORMAT, read_record
from .bake_folder import are_facts, bake_to_folder, heights_sha256
from .cache_store import Believed, Cache, Limits, remove_folder
from .request import BakeRequest

# Part of every key. Raise it with every change of the bake's results that leaves atlas_file.FORMAT unchanged. Older
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

# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the pictures of a plan (precompute/render_job/plan.py), each as EXR and PNG with a record beside it.

The extension imports this file. In the bundle of a farm's job, start_worker.py runs it in a Blender without
the extension.

It skips pictures whose record says that they are finished, and tries a failed picture once again. A picture's files
appear whole, the record last, so a process may be killed at any moment. Exit statuses: 0 if every picture is there, 1
if the plan or the scene cannot be used, 3 if pictures failed twice, 130 if it was interrupted."""

import contextlib
import hashlib
import json
import platform
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.base.files import partial_folder, told_of
from ...precompute.base.locks import has_no_locks, try_lock
from ...precompute.base.shared_folder import machine_name
from ...precompute.render_job.plan import PICTURES, read_plan
from ..blender import compat, mesa
from ..blender.written import check_picture, fault_of, rendered_size
from .picture_setup import Base, set_up

# Is called with a line after each picture, and with how many are done and wanted.
Tell = Callable[[str, int, int], None]

# Exit statuses. A shell gives 130 for a program that an interrupt ends.
FAILED, STOPPED = 3, 130
_TRIES = 2
# Blender's limit.
THREADS_MAX = 1024
# Begins the names of the folders of pictures that are not whole yet; each holds a file that its process locks.
_PARTIAL, _LOCK = "picture", ".lock"
# Blender keeps at most 767 characters of a note.
_NOTE = "natural_gratings {version}, picture {id}, scene {scene_sha256}"
_STAMPS = (
    "date", "time", "render_time", "frame", "frame_range", "memory", "hostname", "camera", "lens", "scene", "marker",
    "filename", "sequencer_strip", "labels",
)  # fmt: skip


@dataclass
class Outcome:
    """The names of the pictures that were rendered, that were there already, and that failed twice."""

    rendered: list[str] = field(default_factory=list)
    finished: list[str] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)

    def __add__(self, other: "Outcome") -> "Outcome":
        return Outcome(self.rendered + other.rendered, self.finished + other.finished, self.failed + other.failed)

    def __str__(self) -> str:
        return f"{len(self.rendered)} rendered, {len(self.finished)} there already, {len(self.failed)} failed"


def part_of(pictures: list[dict[str, Any]], task: int, per_task: int) -> list[dict[str, Any]]:
    """The pictures of a task, which are counted from 1. Raises GratingError for other numbers."""
    if task < 1 or per_task < 1:
        raise GratingError(f"task {task} of {per_task} pictures", "no such task", "give numbers from 1 on")
    return pictures[(task - 1) * per_task : task * per_task]


def render_plan(
    path: Path,
    part: Callable[[list[dict[str, Any]]], list[dict[str, Any]]] = lambda pictures: pictures,
    *,
    again: bool = False,
    threads: int = 0,
    tell: Tell = lambda line, done, total: None,
    log: Callable[..., None] = lambda event, **facts: None,
) -> Outcome:
    """Render the pictures of a plan that are not finished, or with `again` all of them, into the folder `pictures`
    beside the plan's folder.

    part     chooses among the plan's pictures
    threads  for rendering; 0: the scene's setting. With several, Cycles rounds a few pixels differently from run to run
    tell     is called with a line after each picture, and with how many are done and wanted
    log      is called with events and facts, for a log

    Raises GratingError if the plan or its scene cannot be used."""
    plan = read_plan(path)
    wanted = part(plan["pictures"])
    folder = path.parent.parent / PICTURES
    with told_of(folder):
        folder.mkdir(parents=True, exist_ok=True)
    remove_partial(folder, machine_name())
    outcome, scene = Outcome(), path.parent / plan["scene"]
    todo = []
    for picture in wanted:
        if not again and is_finished(folder, picture):
            outcome.finished.append(picture["name"])
            log("finished before", picture=picture["name"])
        else:
            todo.append(picture)
    if not todo:
        return outcome
    mesa.filter_as_cards_do()
    scene_sha256 = open_scene(scene)
    if threads:
        bpy.context.scene.render.threads_mode, bpy.context.scene.render.threads = "FIXED", threads
    base = Base.now()
    facts = {"scene_sha256": scene_sha256, "scene": plan["scene"], "made_by": plan["made_by"]}
    for picture in todo:
        start = time.monotonic()
        failure = _try(picture, base, folder, facts=facts, log=log)
        seconds = time.monotonic() - start
        (outcome.failed if failure else outcome.rendered).append(picture["name"])
        done = len(outcome.finished) + len(outcome.rendered) + len(outcome.failed)
        tell(f"{picture['name']}: {failure or f'{seconds:.1f} s'}", done, len(wanted))
    return outcome


def _try(
    picture: Mapping[str, Any], base: Base, folder: Path, *, facts: Mapping[str, Any], log: Callable[..., None]
) -> str:
    """Render a picture, a second time if the first fails. Returns the last failure, or an empty text."""
    failure = ""
    for attempt in range(1, _TRIES + 1):
        start = time.monotonic()
        try:
            render(picture, base, folder, facts=facts)
        except (RuntimeError, OSError, GratingError) as error:  # of Blender's operators, files, names in the plan
            failure = fault_of(error)
            log("failed", picture=picture["name"], attempt=attempt, fault=failure)
        else:
            log("rendered", picture=picture["name"], attempt=attempt, seconds=round(time.monotonic() - start, 3))
            return ""
    return failure


def open_scene(path: Path) -> str:
    """Open a scene, and return its file's SHA-256. Raises GratingError if it cannot be opened."""
    try:
        digest = sha256_of(path)
        bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
    except (OSError, RuntimeError) as error:
        raise GratingError(
            path, f"cannot be opened ({fault_of(error)})", "run the job's earlier steps again"
        ) from error
    if bpy.context.scene.camera is None and not any(thing.type == "CAMERA" for thing in bpy.data.objects):
        raise GratingError(path, "it has no camera", "add one to the scene")
    return digest


def render(picture: Mapping[str, Any], base: Base, folder: Path, *, facts: Mapping[str, Any]) -> None:
    """Render a picture into a folder: NAME.exr, NAME.png and its record NAME.json. Raises GratingError, RuntimeError
    or OSError, with no file changed, if it cannot be rendered or written whole."""
    start = time.monotonic()
    set_up(picture, base)
    scene, name = bpy.context.scene, picture["name"]
    note = {"version": facts["made_by"]["natural_gratings"], "scene_sha256": facts["scene_sha256"]}
    _stamp(scene.render, _NOTE.format(id=picture["id"], **note))
    with told_of(folder / f"{name}.exr"), _partial_folder(folder) as partial:
        exr, png = partial / f"{name}.exr", partial / f"{name}.png"
        settings = scene.render.image_settings
        compat.write_pictures(settings, "OPEN_EXR")
        settings.color_mode = "RGBA" if scene.render.film_transparent else "RGB"
        settings.color_depth, settings.exr_codec = "32", "ZIP"
        scene.render.filepath = str(exr)
        scene.render.use_file_extension = False
        if bpy.ops.render.render(write_still=True, scene=scene.name) != {"FINISHED"}:
            raise KeyboardInterrupt  # Blender takes the signal itself, and cancels the render
        compat.write_pictures(settings, "PNG")
        settings.color_depth = "8"
        bpy.data.images["Render Result"].save_render(str(png), scene=scene)
        # Pictures are read back, because Blender reports no full disk.
        size, alpha = rendered_size(scene.render), scene.render.film_transparent
        check_picture(png, check_picture(exr, size, alpha=alpha), alpha=alpha)
        files = {one.name: _fingerprint(one) for one in (exr, png)}
        record = {
            "picture": dict(picture), **facts, "files": files,
            "versions": {"blender": bpy.app.version_string, "python": platform.python_version()},
            "machine": {"host": platform.node(), "system": platform.platform(), "processor": platform.machine()},
            "seconds": round(time.monotonic() - start, 3),
        }  # fmt: skip
        written = partial / f"{name}.json"
        written.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
        # Without its record a picture counts as not there, while its files are exchanged.
        (folder / written.name).unlink(missing_ok=True)
        for one in (exr, png, written):
            one.replace(folder / one.name)


def is_finished(folder: Path, picture: Mapping[str, Any]) -> bool:
    """Whether a picture's record is of the same picture, and its two files are those of the record."""
    try:
        record = json.loads((folder / f"{picture['name']}.json").read_text(encoding="utf-8"))
        files = {name: _fingerprint(folder / name) for name in (f"{picture['name']}.exr", f"{picture['name']}.png")}
        return record["picture"] == picture and record["files"] == files
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


def _fingerprint(path: Path) -> dict[str, int | str]:
    """Size and SHA-256 of a file. Raises OSError if it cannot be read."""
    return {"bytes": path.stat().st_size, "sha256": sha256_of(path)}


def _stamp(render: bpy.types.RenderSettings, note: str) -> None:
    """Write only a note into the files, nothing that differs from one run to the next."""
    for name in _STAMPS:
        if hasattr(render, f"use_stamp_{name}"):
            setattr(render, f"use_stamp_{name}", False)
    render.use_stamp, render.use_stamp_note, render.stamp_note_text = False, True, note


@contextlib.contextmanager
def _partial_folder(folder: Path) -> Iterator[Path]:
    """A folder for files that are not whole yet, with a file that this process locks as long as it renders."""
    with partial_folder(folder, f"{_PARTIAL}.{machine_name()}") as made:
        try:
            lock = try_lock(made / _LOCK)
        except OSError as error:
            if not has_no_locks(error):
                raise
            lock = None
        with lock or contextlib.nullcontext():
            yield made


def remove_partial(folder: Path, machine: str = "*") -> None:
    """Remove what killed processes, of one machine or of all, left of pictures that were not whole. A process that
    lives keeps its folder, unless it is on another machine and the file server forwards no locks."""
    for left in folder.glob(f".{_PARTIAL}.{machine}.*.partial"):
        with contextlib.suppress(OSError):
            if not (left / _LOCK).is_file():
                left.rmdir()  # of a process killed while it removed the folder; one that just made it tries once more
            elif lock := try_lock(left / _LOCK):
                lock.close()
                shutil.rmtree(left)


def sha256_of(path: Path) -> str:
    """The SHA-256 of a file, in hexadecimal. Raises OSError if it cannot be read."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def progress_lines(openjd: bool) -> Tell:
    """A function for `tell` that prints a bar with the time left, or with `openjd` the lines that sessions of Open Job
    Description read."""
    begun, before = time.monotonic(), None

    def tell(line: str, done: int, total: int) -> None:
        nonlocal before
        before = done - 1 if before is None else before
        left = (time.monotonic() - begun) / (done - before) * (total - done)
        if openjd:
            print(f"openjd_progress: {100 * done / total:.1f}\nopenjd_status: {line}", flush=True)
            return
        bar = "#" * round(20 * done / total)
        print(f"[{bar:.<20}] {done} of {total}, {_duration(left)} left; {line}", file=sys.stderr, flush=True)

    return tell


def _duration(seconds: float) -> str:
    minutes = round(seconds / 60)
    return f"{seconds:.0f} s" if seconds < 90 else f"{minutes} min" if minutes < 90 else f"{minutes / 60:.1f} h"


def main(arguments: list[str]) -> int:
    """Render the pictures of the plan that the arguments of start_worker.py name. Returns the exit status."""
    try:
        path, numbers, flags = _options(arguments)

        def part(pictures: list[dict[str, Any]]) -> list[dict[str, Any]]:
            task = numbers["--task"]
            return pictures if task is None else part_of(pictures, task, numbers["--per-task"] or 1)

        outcome = render_plan(
            path.resolve(), part, again="--again" in flags, threads=numbers["--threads"] or 0,
            tell=progress_lines("--openjd" in flags),
        )  # fmt: skip
    except GratingError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return STOPPED
    print(outcome)
    return FAILED if outcome.failed else 0


def _options(arguments: list[str]) -> tuple[Path, dict[str, int | None], set[str]]:
    """The plan, the numbers by their options, and the flags. Raises GratingError for anything else. A worker has no
    other parser: argparse prints several lines for an error."""
    plans: list[Path] = []
    numbers: dict[str, int | None] = dict.fromkeys(("--task", "--per-task", "--threads"))
    flags = set[str]()
    words = iter(arguments)
    for word in words:
        if word in numbers:
            value = next(words, "")
            if not (value.isascii() and value.isdecimal() and len(value) < 8):
                raise GratingError(f"{word} {value!r:.40}", "no whole number", "give one from 0 on")
            numbers[word] = int(value)
        elif word in ("--again", "--openjd"):
            flags.add(word)
        elif word.startswith("-"):
            there = ", ".join((*numbers, "--again", "--openjd"))
            raise GratingError(f"{word:.40}", "no such option", f"there are {there}")
        else:
            plans.append(Path(word))
    if len(plans) != 1 or (numbers["--threads"] or 0) > THREADS_MAX:
        raise GratingError("", f"{len(plans)} plans", f"give one plan, and at most {THREADS_MAX} threads")
    return plans[0], numbers, flags

# SPDX-License-Identifier: GPL-3.0-or-later
"""`job`: render all pictures of a job, or do one step of it."""

import argparse
import contextlib
import os
import platform
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.base.files import told_of
from ...precompute.base.locks import try_lock
from ...precompute.base.progress import Progress
from ...precompute.cli import job_verb, printing
from ...precompute.cli.arguments import count, name_argument
from ...precompute.render_job.job_file import Job
from ...precompute.render_job.pictures import Log, scene_names
from ...precompute.render_job.plan import LOGS, PICTURES, SCENES, read_plan
from ..blender.written import remove_partial_copies
from ..rendering import worker
from .job_scenes import make_scene, needs_of_scene, plan_path

_STEPS = ("needs", "bake", "frames", "sheet")


def job_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `job`: those of `python -m precompute job`, and the steps that need Blender."""
    job_verb.add_arguments(parser)
    parser.add_argument(
        "--step", choices=_STEPS, help="do this step alone: a farm's tasks do one each. Default: all, in this order"
    )
    parser.add_argument("--only", type=name_argument, metavar="NAME", help="the grating that the step is of")
    parser.add_argument("--task", type=count(1, 1 << 20), metavar="N", help="of the step `frames`: the N-th pictures")
    parser.add_argument(
        "--per-task", type=count(1, 1 << 20), default=1, metavar="K", help="pictures of a task; default 1"
    )
    parser.add_argument(
        "--threads", type=count(0, worker.THREADS_MAX), default=0, metavar="N",
        help="for rendering; default: the scene's. With one, Cycles' pictures are the same in every bit",
    )  # fmt: skip
    parser.add_argument("--again", action="store_true", help="render finished pictures too")


def run_job(arguments: argparse.Namespace) -> int:
    """The `job` verb. Returns the exit status."""
    opened = Path(bpy.data.filepath) if bpy.data.filepath else None
    job = job_verb.job_of(arguments, opened)
    if job_verb.needs_no_blender(arguments):
        return job_verb.do(arguments, job)
    names = _chosen(job, arguments.only)
    try:
        return _run(job, names, arguments)
    except KeyboardInterrupt:
        _print("stopped; run the job again to go on")
        return worker.STOPPED


def _run(job: Job, names: list[str], arguments: argparse.Namespace) -> int:
    """Do the steps that were asked for. Returns the exit status."""
    with _alone(job, arguments):
        log = _log_of(job)
        log("begun", job=str(job.path), step=arguments.step or "all", blender=bpy.app.version_string)
        steps = [arguments.step] if arguments.step else list(_STEPS)
        failed = False
        for step in steps:
            if step == "frames":
                failed = _render(job, names, arguments, log)
            elif step == "sheet":
                _join(job, is_asked_for=arguments.step is not None)
            elif step == "bake" or job.needs:
                for name in names:
                    (make_scene if step == "bake" else needs_of_scene)(job, name, _progress_of(name))
                    log("made", what=name, step=step)
        log("ended", failed=failed)
    return worker.FAILED if failed else 0


def _chosen(job: Job, only: str | None) -> list[str]:
    names = scene_names(job)
    if only is not None and only not in names:
        raise GratingError(f"--only {only}", "no such grating in the job", f"there are {', '.join(names)}")
    return names if only is None else [only]


def _render(job: Job, names: list[str], arguments: argparse.Namespace, log: Log) -> bool:
    """Render the pictures of some scenes. Returns whether one failed. Raises GratingError if a scene is missing."""
    tell, whole = worker.progress_lines(False), worker.Outcome()
    paths = [plan_path(job, name) for name in names]
    plans = [(path, len(_part(arguments, read_plan(path)["pictures"]))) for path in paths]
    total, before = sum(wanted for _, wanted in plans), 0
    for path, wanted in plans:
        tell_of_all = partial(_tell_of_all, tell, before=before, total=total)
        outcome = worker.render_plan(
            path, partial(_part, arguments), again=arguments.again, threads=arguments.threads,
            tell=tell_of_all, log=log,
        )  # fmt: skip
        whole, before = whole + outcome, before + wanted
    print(whole)
    if whole.failed:
        told = ", ".join(whole.failed[:5]) + (", ..." if whole.failed[5:] else "")
        print(printable(f"failed twice: {told}; the log in {job.output / LOGS} says why"), file=sys.stderr)
    return bool(whole.failed)


def _tell_of_all(tell: worker.Tell, line: str, done: int, _: int, *, before: int, total: int) -> None:
    """Tell of a picture of one plan as one of all plans."""
    tell(line, before + done, total)


def _part(arguments: argparse.Namespace, pictures: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The pictures of the task, or all."""
    return pictures if arguments.task is None else worker.part_of(pictures, arguments.task, arguments.per_task)


def _join(job: Job, *, is_asked_for: bool) -> None:
    """Write the contact sheet. At the end of a whole job it is an extra, so without Pillow it is left out."""
    try:
        print(job_verb.write_contact_sheet(job))
    except GratingError as error:
        if is_asked_for:
            raise
        _print(f"no contact sheet: {error}")


def _progress_of(name: str) -> Progress:
    """Progress on one of the job's gratings, in lines of text."""
    tell = printing.Progress("text")
    return lambda stage, fraction: tell(f"{name}: {stage}", fraction)


def _print(line: str) -> None:
    print(printable(line), file=sys.stderr, flush=True)


@contextlib.contextmanager
def _alone(job: Job, arguments: argparse.Namespace) -> Iterator[None]:
    """Refuse to run a whole job twice at the same time. Tasks of a farm run side by side."""
    if arguments.step is not None:
        if arguments.step == "sheet":  # a farm's last step: no task bakes or renders any more
            _remove_partial(job)
        yield
        return
    with told_of(job.output):
        job.output.mkdir(parents=True, exist_ok=True)
        lock = try_lock(job.output / ".job.lock")
    if lock is None:
        raise GratingError(job.output, "another process renders this job", "wait for it, or choose another output")
    with lock:
        _remove_partial(job)
        yield


def _remove_partial(job: Job) -> None:
    """Remove what killed processes left. No other process may make the job's scenes."""
    remove_partial_copies(job.output / SCENES)
    worker.remove_partial(job.output / PICTURES)


def _log_of(job: Job) -> Log:
    """The log of this run: a file of its own, as several machines may write at once."""
    began = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    return Log(job.output / LOGS / f"{began}-{platform.node() or 'host'}-{os.getpid()}.jsonl")

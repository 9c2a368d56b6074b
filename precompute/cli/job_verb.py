# SPDX-License-Identifier: GPL-3.0-or-later
"""`job`: what can be done with a render job without Blender: check it, list its pictures, join them, send it to a
farm."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..base.failure import GratingError
from ..render_job.bundle import write_bundle
from ..render_job.job_file import EXAMPLE, Job, read_job
from ..render_job.pictures import SHEET, pictures_of, scene_names, write_sheet
from ..render_job.plan import PICTURES
from .arguments import count, name_argument, path_argument
from .printing import emit


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `job`. The help ends with an example of a job's file, which has every key."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = f"a job's file:\n\n{EXAMPLE}"
    parser.add_argument("job", type=path_argument, metavar="JOB.toml", help="the job's file")
    parser.add_argument("-o", "--output", type=path_argument, metavar="DIR", help="default: what the job's file says")
    parser.add_argument("--list", action="store_true", help="only check the job and list its pictures")
    parser.add_argument("--sheet", action="store_true", help="only write a contact sheet of the finished pictures")
    parser.add_argument(
        "--bundle",
        type=path_argument,
        metavar="DIR",
        help="only write the job for a farm: Open Job Description, Flamenco",
    )
    parser.add_argument(
        "--bundle-per-task",
        type=count(1, 10_000),
        default=1,
        metavar="K",
        help="pictures per task of a farm; default 1",
    )
    parser.add_argument("--json", type=name_argument, metavar="FILE|-", help="write the list as JSON")


def run(arguments: argparse.Namespace) -> int:
    """The `job` verb outside Blender."""
    job = job_of(arguments, None)
    if not needs_no_blender(arguments):
        remedy = "run `blender --background --command grating job JOB.toml`, or ask for --list, --sheet or --bundle"
        raise GratingError(arguments.job, "pictures are rendered by Blender", remedy)
    return do(arguments, job)


def needs_no_blender(arguments: argparse.Namespace) -> bool:
    """Whether the options ask for something that needs no Blender."""
    return bool(arguments.list or arguments.sheet or arguments.bundle)


def job_of(arguments: argparse.Namespace, opened: Path | None) -> Job:
    """The job of the command line. `opened` is the file that is open in Blender, the scene of a job that names none."""
    return read_job(arguments.job, opened=opened, output=arguments.output)


def do(arguments: argparse.Namespace, job: Job) -> int:
    """List the job's pictures, join them, or write it for a farm. Returns the exit status."""
    if arguments.sheet:
        print(write_contact_sheet(job))
    if arguments.bundle:
        for path in write_bundle(job, arguments.bundle, per_task=arguments.bundle_per_task):
            print(path)
    if arguments.list:
        facts = facts_of(job)
        emit(facts, arguments.json, lambda: [*facts["pictures"], f"{len(facts['pictures'])} pictures"])
    return 0


def facts_of(job: Job) -> Mapping[str, Any]:
    """The job's scenes and pictures, by their names, and its output."""
    scenes = {name: [picture.name for picture in pictures_of(job, name)] for name in scene_names(job)}
    pictures = [one for names in scenes.values() for one in names]
    return {"output": str(job.output), "scenes": list(scenes), "pictures": pictures}


def write_contact_sheet(job: Job) -> str:
    """Join the job's pictures. Returns a line about the sheet. Raises GratingError if it cannot be written."""
    folder, path = job.output / PICTURES, job.output / SHEET
    if not folder.is_dir():
        raise GratingError(folder, "no pictures there", "render the job first")
    names = [picture.name for name in scene_names(job) for picture in pictures_of(job, name)]
    missing = write_sheet(path, [folder / f"{name}.png" for name in names])
    return f"{path}: {len(names)} pictures" + (f", {missing} of those shown are missing" if missing else "")

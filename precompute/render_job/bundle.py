# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a job for a farm, as a folder for AWS Deadline Cloud and Flamenco.

The job is a template of Open Job Description, in the layout of a job bundle of AWS Deadline Cloud, and a job type of
Flamenco:

    template.json            steps, their order, parameters with types and limits
    parameter_values.json    the values of this job
    asset_references.json    the files that it reads and the folder that it writes
    scripts/                 the worker, which renders in a Blender without the extension
    flamenco/                the job type

The format is that of https://github.com/OpenJobDescription/openjd-specifications, version jobtemplate-2023-09. JSON is
YAML too, so programs that ask for a template.yaml read it."""

import json
import math
import shutil
from functools import partial
from pathlib import Path
from typing import Any

from ..base.failure import GratingError
from ..base.files import told_of, write_together
from .job_file import Job
from .pictures import pictures_of, scene_names
from .plan import SCENES, plain_name

_ROOT = Path(__file__).resolve().parents[2]
_FLAMENCO = Path(__file__).with_name("flamenco.js")
# What a worker without the extension needs, in the same folders as here: all that start_worker.py imports.
_START = "addon/rendering/start_worker.py"
WORKER_FILES = (
    _START,
    *(f"addon/rendering/{name}.py" for name in ("__init__", "worker", "picture_setup")),
    *(f"addon/blender/{name}.py" for name in ("__init__", "compat", "mesa", "written")),
    "precompute/__init__.py",
    *(f"precompute/base/{name}.py" for name in ("__init__", "failure", "files", "job", "locks", "progress")),
    "precompute/base/shared_folder.py",
    *(f"precompute/render_job/{name}.py" for name in ("__init__", "plan", "tables")),
)
# The specification's limit of a list of values.
_LISTED_MAX = 1024
_HOUR = 3600


def write_bundle(job: Job, folder: Path, *, per_task: int) -> list[Path]:
    """Write a job for a farm, `per_task` pictures a task. Returns the paths. Raises GratingError if the job has more
    gratings than a template can list, or if a file cannot be written."""
    if len(scene_names(job)) > _LISTED_MAX:
        raise GratingError(job.path, f"{len(scene_names(job))} gratings", f"split the job: at most {_LISTED_MAX}")
    texts = {
        "template.json": template(job, per_task),
        "parameter_values.json": parameter_values(job),
        "asset_references.json": asset_references(job),
    }
    writers = {folder / name: partial(_write_json, record) for name, record in texts.items()}
    script = flamenco_job_type(job, folder, per_task)
    writers[folder / "flamenco" / "natural_gratings.js"] = partial(_write_text, script)
    writers |= {folder / "scripts" / name: partial(shutil.copyfile, _ROOT / name) for name in WORKER_FILES}
    for path in writers:
        with told_of(path):
            path.parent.mkdir(parents=True, exist_ok=True)
    write_together(writers)
    return list(writers)


def template(job: Job, per_task: int) -> dict[str, Any]:
    """The template of Open Job Description. The steps wait for each other: needs, bake, frames, contact sheet."""
    steps = [_bake_step("Needs", "needs", job, [])] if job.needs else []
    steps.append(_bake_step("Bake", "bake", job, ["Needs"] if job.needs else []))
    steps += [_frames_step(job, per_task), _sheet_step()]
    return {
        "specificationVersion": "jobtemplate-2023-09",
        "name": f"Natural Gratings: {plain_name(job.path.stem)}"[:128],  # braces would be an expression
        "parameterDefinitions": [
            _path("JobFile", "FILE", "IN", "The job's TOML file."),
            _path("OutputDir", "DIRECTORY", "OUT", "The folder of scenes, pictures and logs."),
            _path("ScriptsDir", "DIRECTORY", "IN", "The folder of the worker.", default="scripts"),
            {
                "name": "Blender", "type": "STRING", "minLength": 1, "maxLength": 1024, "default": "blender",
                "description": "The Blender to run. Needs, Bake and ContactSheet need the extension in it; Frames "
                "does not.",
            },
            {
                "name": "PicturesPerTask", "type": "INT", "minValue": per_task, "maxValue": per_task,
                "default": per_task, "description": "Pictures of a task of Frames; another bundle has another.",
            },
            {
                "name": "Threads", "type": "INT", "minValue": 0, "maxValue": 1024, "default": 0,
                "description": "Threads of one task of Frames; 0 for the scene's setting.",
            },
        ],
        "steps": steps,
    }  # fmt: skip


def parameter_values(job: Job) -> dict[str, Any]:
    """The values of the template's parameters for this job."""
    values = {"JobFile": str(job.path.resolve()), "OutputDir": str(job.output)}
    return {"parameterValues": [{"name": name, "value": value} for name, value in values.items()]}


def asset_references(job: Job) -> dict[str, Any]:
    """The files that the job reads, and the folder that it writes."""
    return {
        "assetReferences": {
            "inputs": {"filenames": list(map(str, job.inputs)), "directories": []},
            "outputs": {"directories": [str(job.output)]},
        }
    }


def flamenco_job_type(job: Job, folder: Path, per_task: int) -> str:
    """The job type of Flamenco, with this job's values as defaults."""
    defaults = {
        "job_file": str(job.path.resolve()), "output_dir": str(job.output), "gratings": scene_names(job),
        "scripts_dir": str(folder.resolve() / "scripts"), "parts": parts_of(job, per_task),
        "pictures_per_task": per_task, "needs": job.needs,
    }  # fmt: skip
    return f"const DEFAULTS = {json.dumps(defaults, indent=4)};\n\n{_FLAMENCO.read_text(encoding='utf-8')}"


def parts_of(job: Job, per_task: int) -> int:
    """The number of tasks for each scene. All scenes of a job have equally many pictures."""
    return math.ceil(len(pictures_of(job, scene_names(job)[0])) / per_task)


def _path(name: str, kind: str, flow: str, description: str, *, default: str | None = None) -> dict[str, Any]:
    record = {"name": name, "type": "PATH", "objectType": kind, "dataFlow": flow, "description": description}
    return record if default is None else record | {"default": default}


def _bake_step(name: str, step: str, job: Job, after: list[str]) -> dict[str, Any]:
    """A step in a Blender with the extension, with a task for each grating."""
    words = [*_grating_words(step), "--only", "{{Task.Param.Grating}}"]
    space = {"taskParameterDefinitions": [{"name": "Grating", "type": "STRING", "range": scene_names(job)}]}
    return _step(name, words, after=after, space=space, hours=24)


def _frames_step(job: Job, per_task: int) -> dict[str, Any]:
    """The step that renders, in a Blender with or without the extension: a task for each part of each scene."""
    names = scene_names(job)
    # The names of scenes are plain, so they are the same in paths of every system.
    plan = "{{Param.OutputDir}}/" + SCENES + "/{{Task.Param.Grating}}.json"
    words = [
        "--background", "--factory-startup", "--python-exit-code", "1",
        "--python", "{{Param.ScriptsDir}}/" + _START,
        "--", plan, "--task", "{{Task.Param.Part}}", "--per-task", "{{Param.PicturesPerTask}}",
        "--threads", "{{Param.Threads}}", "--openjd",
    ]  # fmt: skip
    space = {
        "taskParameterDefinitions": [
            {"name": "Grating", "type": "STRING", "range": names},
            {"name": "Part", "type": "INT", "range": f"1-{parts_of(job, per_task)}"},
        ],
        "combination": "Grating * Part",
    }
    return _step("Frames", words, after=["Bake"], space=space, hours=24)


def _sheet_step() -> dict[str, Any]:
    return _step("ContactSheet", _grating_words("sheet"), after=["Frames"], space=None, hours=1)


def _grating_words(step: str) -> list[str]:
    words = ["--background", "--command", "grating", "job", "{{Param.JobFile}}", "-o", "{{Param.OutputDir}}"]
    return [*words, "--step", step]


def _step(
    name: str, words: list[str], *, after: list[str], space: dict[str, Any] | None, hours: int
) -> dict[str, Any]:  # fmt: skip
    action = {"command": "{{Param.Blender}}", "args": words, "timeout": hours * _HOUR}
    # Blender stops at the first interrupt, and the picture in work is lost, no other.
    action["cancelation"] = {"mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": 10}
    step: dict[str, Any] = {"name": name, "script": {"actions": {"onRun": action}}}
    if after:
        step["dependencies"] = [{"dependsOn": one} for one in after]
    if space is not None:
        step["parameterSpace"] = space
    return step


def _write_json(record: dict[str, Any], path: Path) -> None:
    _write_text(json.dumps(record, indent=2) + "\n", path)


def _write_text(text: str, path: Path) -> None:
    path.write_text(text, encoding="utf-8")

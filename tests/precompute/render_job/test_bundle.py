# SPDX-License-Identifier: GPL-3.0-or-later
"""A job as a farm gets it: the template of Open Job Description, its values and assets, and Flamenco's job type."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from devtools.changed import imports
from precompute.render_job.bundle import parts_of, write_bundle
from precompute.render_job.job_file import read_job

ROOT = Path(__file__).resolve().parents[3]
JOB = """
scene = "snake.blend"
needs = true
[pictures]
frames = "1-5"
[[grating]]
preset = "cd"
matters = ["gold", "silver"]
[[grating]]
scans = ["skin.nid"]
"""
# Runs Flamenco's script as its manager does, and prints each task with its command and the tasks before it.
COMPILE = """
const author = {
  Task: (name, kind) => ({ name, kind, after: [], commands: [], addCommand(one) { this.commands.push(one); },
                           addDependency(task) { this.after.push(task.name); } }),
  Command: (name, parameters) => ({ name, parameters }),
};
const tasks = [];
const settings = Object.fromEntries(JOB_TYPE.settings.map((one) => [one.key, one.default]));
compileJob({ settings, addTask: (task) => tasks.push(task) });
console.log(JSON.stringify(tasks));
"""


@pytest.fixture
def bundle(tmp_path):
    """The bundle of a job of three surfaces with five frames, two pictures a task."""
    (tmp_path / "job.toml").write_text(JOB)
    job = read_job(tmp_path / "job.toml")
    assert parts_of(job, 2) == 3
    write_bundle(job, tmp_path / "bundle", per_task=2)
    return tmp_path / "bundle"


def test_steps_wait_for_each_other(bundle):
    template = json.loads((bundle / "template.json").read_text())
    after = {step["name"]: [one["dependsOn"] for one in step.get("dependencies", ())] for step in template["steps"]}
    assert after == {"Needs": [], "Bake": ["Needs"], "Frames": ["Bake"], "ContactSheet": ["Frames"]}
    frames = template["steps"][2]
    grating, part = frames["parameterSpace"]["taskParameterDefinitions"]
    assert (grating["range"], part["range"]) == (["cd_gold", "cd_silver", "skin"], "1-3")
    words = frames["script"]["actions"]["onRun"]["args"]
    assert "--factory-startup" in words and "--command" not in words, "frames need no extension"


def test_parameters_have_types_and_limits(bundle):
    template = json.loads((bundle / "template.json").read_text())
    values = json.loads((bundle / "parameter_values.json").read_text())["parameterValues"]
    known = {one["name"]: one for one in template["parameterDefinitions"]}
    assert {one["type"] for one in known.values()} == {"PATH", "STRING", "INT"}
    assert {one["name"] for one in values} == {name for name, one in known.items() if "default" not in one}


def test_assets_are_all_that_is_read_and_written(bundle, tmp_path):
    assets = json.loads((bundle / "asset_references.json").read_text())["assetReferences"]
    assert assets["inputs"]["filenames"] == [str(tmp_path / name) for name in ("job.toml", "skin.nid", "snake.blend")]
    assert assets["outputs"]["directories"] == [str(tmp_path / "job")]


def test_the_worker_s_files_are_all_that_it_imports(bundle):
    """A Blender without the extension has no others."""
    shipped = {path.relative_to(bundle / "scripts") for path in (bundle / "scripts").rglob("*.py")}
    for file in shipped:
        names = [Path(*name.split(".")) for name in imports(ROOT / file) if name.startswith(("addon.", "precompute."))]
        modules = {path.with_suffix(".py") for name in names for path in (name, name.parent)}
        missing = {path for path in modules - shipped if (ROOT / path).is_file()}
        assert not missing, f"{file} imports {missing}"


def test_a_name_with_braces_makes_no_expression(tmp_path):
    (tmp_path / "a{{b}}.toml").write_text(JOB)
    write_bundle(read_job(tmp_path / "a{{b}}.toml"), tmp_path / "bundle", per_task=2)
    template = json.loads((tmp_path / "bundle" / "template.json").read_text())
    assert template["name"] == "Natural Gratings: a_b"


def test_flamenco_s_tasks_are_those_of_the_template(bundle):
    if shutil.which("node") is None:
        pytest.skip("no node on this machine to run Flamenco's script")
    script = f"const path = require('path');\n{(bundle / 'flamenco' / 'natural_gratings.js').read_text()}\n{COMPILE}"
    answer = subprocess.run(["node", "-e", script], capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr
    tasks = {task["name"]: task for task in json.loads(answer.stdout)}
    assert len(tasks) == 3 + 3 + 3 * 3 + 1
    assert tasks["bake-skin"]["after"] == ["needs-skin"]
    assert tasks["frames-skin-3"]["after"] == ["bake-skin"]
    assert len(tasks["contact-sheet"]["after"]) == 9
    template = json.loads((bundle / "template.json").read_text())
    words = template["steps"][2]["script"]["actions"]["onRun"]["args"]
    told = tasks["frames-skin-3"]["commands"][0]["parameters"]["args"]
    values = {
        "{{Param.ScriptsDir}}": str(bundle / "scripts"), "{{Param.OutputDir}}": str(bundle.parent / "job"),
        "{{Task.Param.Grating}}": "skin", "{{Task.Param.Part}}": "3", "{{Param.PicturesPerTask}}": "2",
        "{{Param.Threads}}": "0",
    }  # fmt: skip
    for text, value in values.items():
        words = [word.replace(text, value) for word in words]
    assert told == [word for word in words if word != "--openjd"]

# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev test` and `./dev mutants`: an interrupt ends all suites, and what the sets and the mutants name exists."""

import ast
import signal
import subprocess
import sys
import time

import pytest

from devtools import ROOT, DevError, mutants, suites
from devtools.changed import affected_tests
from devtools.steps import project_environment

# A test that reports when it begins and when it is cleaned up.
SLOW = """
import os, time
from pathlib import Path

def test_slow():
    here = Path(__file__).parent
    (here / f"began-{os.getpid()}").touch()
    try:
        time.sleep(60)
    finally:
        (here / f"ended-{os.getpid()}").touch()
"""
# `./dev test` with four suites of this one test. A shell's background jobs ignore SIGINT, and would pass this on.
DEV_TEST = """
import signal, sys
from pathlib import Path
from types import SimpleNamespace
from devtools import cli, environments, suites

signal.signal(signal.SIGINT, signal.default_int_handler)
folder = Path(sys.argv[1])
one = SimpleNamespace(python=Path(sys.executable), python_version="3", blender_version="4", name="one")
suites.ENVIRONMENTS, suites.SUITES = folder, tuple((f"suite{number}", one) for number in range(4))
suites.targets_of = lambda *_, **__: [folder / "test_slow.py"]
cli.VERBS["test"] = lambda *_: suites.run([one], ["--all", "-p", "no:cacheprovider"], None)
sys.exit(cli.main(["test"]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows ends a process without asking it")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_suites_end_and_no_other_begins(tmp_path, number):
    (tmp_path / "test_slow.py").write_text(SLOW)
    command = [sys.executable, "-c", DEV_TEST, str(tmp_path)]
    env = project_environment(PYTEST_DISABLE_PLUGIN_AUTOLOAD="1")  # which takes a third of the time
    with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as dev:
        deadline = time.monotonic() + 60
        while len(list(tmp_path.glob("began-*"))) < 2:
            assert dev.poll() is None and time.monotonic() < deadline
            time.sleep(0.05)
        dev.send_signal(number)
        assert dev.wait(30) == 130
    assert len(list(tmp_path.glob("began-*"))) == len(list(tmp_path.glob("ended-*"))) == 2


def test_the_parts_that_an_environment_runs_are_there():
    for (name, _), parts in (suites.AGAIN | suites.SHORT).items():
        for part in parts:
            assert (ROOT / "tests" / name / part).exists(), f"devtools/suites.py: tests/{name}/{part}"


@pytest.mark.parametrize(
    ("file", "rooms"),
    [
        (
            "addon/lamps/brightest_lamps.py",
            {"addon/lamps", "addon/materials", "addon/ui", "addon/workflow", "render/test_plane.py"},
        ),
        ("precompute/surface/readers/nid.py", {"precompute/surface"}),
        ("tests/addon/batch/test_job.py", {"addon/batch/test_job.py"}),
        ("tests/addon/conftest.py", {"addon"}),
        ("README.md", {"precompute/test_project_pages.py"}),
    ],
)
def test_a_change_has_the_tests_of_its_room_and_of_those_that_import_it(file, rooms):
    found = {path.relative_to(ROOT / "tests").as_posix() for path in affected_tests([file])}
    assert found == rooms | {"precompute/test_layering.py"}


def test_a_change_without_tests_is_refused():
    with pytest.raises(DevError, match="no test reads LICENSE; remedy: ./dev test"):
        affected_tests(["LICENSE"])


def marks_of(path):
    """The marks of a file's tests, and of the file itself under "": for each name, the marks' arguments."""
    tree = ast.parse(path.read_text())
    made = {each.name: each.decorator_list for each in ast.walk(tree) if isinstance(each, ast.FunctionDef)}
    made[""] = [each.value for each in tree.body if ast.unparse(each).startswith("pytestmark")]
    return {
        name: {
            each.func.attr: each.args
            for each in decorators
            if ast.unparse(each).startswith(("pytest.mark.night(", "pytest.mark.short("))
        }
        for name, decorators in made.items()
    }


def test_each_test_of_the_night_names_one_of_the_short_run():
    named = 0
    for path in (ROOT / "tests").rglob("test_*.py"):
        marks = marks_of(path)
        for name, own in marks.items():
            if "night" not in own:
                continue
            (cheaper,) = (word.value for word in own["night"])
            assert "short" not in own, f"{path}: {name}"
            there = (ROOT / cheaper).exists() if cheaper.startswith("tests/") else "night" not in marks[cheaper]
            assert there, f"{path}: {name} names {cheaper}"
            named += 1
    assert named


def test_each_mutant_s_text_and_tests_are_there():
    for mutant in mutants.all_mutants():
        text = (ROOT / mutant.file).read_text()
        assert mutants.text_with(mutant, text) != text
        for test in mutant.tests:
            assert (ROOT / "tests" / test).exists(), f"{mutant.name}: tests/{test}"


def test_a_report_s_failed_tests_are_told(tmp_path, capsys):
    report = tmp_path / "report.xml"
    report.write_text(
        '<testsuites><testsuite tests="2" failures="1" errors="0" skipped="0">'
        '<testcase classname="tests.precompute.test_x" name="test_y[1]"><failure message="assert 1 == 2&#10;more"/>'
        '</testcase><testcase classname="tests.precompute.test_x" name="test_z"/></testsuite></testsuites>'
    )
    suites.print_summary([suites.Result("precompute", 1, 2.0, **suites.counts(report))])
    assert "precompute: tests.precompute.test_x::test_y[1]: assert 1 == 2\n" in capsys.readouterr().out

# SPDX-License-Identifier: GPL-3.0-or-later
"""The test suites: each is a folder of tests/ in an environment. Each runs in its own process, two at a time."""

import os
import subprocess
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from . import ENVIRONMENTS, ROOT
from .changed import affected_tests, changed_files
from .environments import BPY45, BPY52, BPY53, Environment
from .packages import make_drafts
from .steps import project_environment, run_together, running, say

NO_TESTS_COLLECTED = 5
# A suite that takes this long hangs: the slowest of the night takes half of it.
LIMIT_SECONDS = 80 * 60
# Folder of tests/ and environment of each suite, the slowest first, so that both workers end at about the same time.
SUITES = (
    ("addon", BPY53),
    ("render", BPY53),
    ("precompute", BPY45),
    ("package", BPY45),
    ("addon", BPY45),
    ("render", BPY45),
    ("addon", BPY52),
    ("render", BPY52),
    ("precompute", BPY53),
)
FOLDERS = tuple(dict.fromkeys(name for name, _ in SUITES))
# Tests of precompute that also run under the newer Python and NumPy, because results may differ between versions. The
# tests of readers and files use Pillow and OpenEXR. Others mix single and double precision, for which NumPy 2 has new
# promotion rules. The golden bake covers all of precompute.
PRECOMPUTE_AGAIN = ("surface", "table", "maths", "colour", "spectra", "bake/test_golden.py", "bake/test_cache.py")
# In a short run: the readers that use packages, the tables, and the golden bake.
PRECOMPUTE_SHORT = (
    "surface/test_hdf5.py", "surface/test_pictures.py", "surface/test_readers.py", "table", "bake/test_golden.py",
    "bake/test_cache.py",
)  # fmt: skip
# What a short run tests in the older Blenders: what differs between versions. One test or more for each kind of node,
# lamp and shader, and what follows. In the oldest Blender the night runs every file, without what is marked for the
# night, which the newest Blender runs; if an older Blender is asked for alone, it runs that too.
RENDER_SHORT = (
    "test_lamps.py", "test_shadows.py", "test_osl_direct.py",
)  # fmt: skip
ADDON_SHORT = (
    "blender/test_guard.py", "blender/test_mesa.py", "blender/test_names.py", "blender/test_removals.py",
    "nodes/test_builder.py", "nodes/test_eevee_constants.py",
    "materials/test_purged.py", "lamps/test_lamps.py", "batch/test_commands.py", "operators/test_registering.py",
    "operators/test_operators.py", "workflow/test_assigning.py", "workflow/test_other_version.py",
    "workflow/test_restoring_bakes.py",
)  # fmt: skip
# Nothing in the extension tells Blender 5.2 from 5.3 (blender/compat.py), so a short run tests in 5.2 what registers,
# builds, bakes and assigns.
ADDON_SMOKE = (
    "nodes/test_builder.py", "lamps/test_lamps.py", "operators/test_registering.py", "operators/test_operators.py",
    "workflow/test_assigning.py",
)  # fmt: skip
# Suites that run only these parts in an environment, always or in a short run.
AGAIN = {
    ("precompute", BPY53): PRECOMPUTE_AGAIN,
    ("render", BPY52): (*RENDER_SHORT, "test_brought_over.py"),
    ("addon", BPY52): ADDON_SHORT,
}
SHORT = {
    ("addon", BPY52): ADDON_SMOKE,
    ("render", BPY52): ("test_lamps.py",),
    ("render", BPY45): RENDER_SHORT,
    ("addon", BPY45): ADDON_SHORT,
    ("precompute", BPY53): PRECOMPUTE_SHORT,
}


@dataclass(frozen=True)
class Result:
    """The result of a suite: pytest's exit status (-N after signal N), the counts of its report, and a line for each
    test that failed."""

    title: str
    status: int
    seconds: float
    passed: int = 0
    failed: int = 0
    skipped: int = 0
    faults: tuple[str, ...] = ()

    @property
    def good(self) -> bool:
        """Whether every test passed or was skipped."""
        return self.status == 0

    @property
    def verdict(self) -> str:
        """One word for the summary."""
        if self.status < 0:
            return f"signal {-self.status}"
        return "ok" if self.good else "FAILED"


def test_files(folder: Path) -> list[Path]:
    return sorted(folder.rglob("test_*.py"))


def split_arguments(arguments: Sequence[str]) -> tuple[list[Path], list[str]]:
    """Split off paths under tests/, which may name a test after `::`. Returns the paths and the other arguments."""
    paths = [argument for argument in arguments if is_test_path(Path(argument.partition("::")[0]))]
    return [Path(path).absolute() for path in paths], [argument for argument in arguments if argument not in paths]


def is_test_path(path: Path) -> bool:
    return path.exists() and path.absolute().is_relative_to(ROOT / "tests")


def counts(report: Path) -> dict[str, Any]:
    """The numbers passed, failed and skipped in a JUnit report, and its failed tests with the first line of each error.
    Empty if the process died before it wrote one."""
    if not report.exists():
        return {}
    suite = ElementTree.parse(report).getroot().find("testsuite")
    tests, failures, errors, skipped = (int(suite.get(name, 0)) for name in ("tests", "failures", "errors", "skipped"))
    failed = failures + errors
    faults = tuple(
        f"{case.get('classname')}::{case.get('name')}: {fault.get('message', '').partition(chr(10))[0]}"
        for case in suite.iter("testcase")
        for fault in (*case.iter("failure"), *case.iter("error"))
    )
    return {"passed": tests - failed - skipped, "failed": failed, "skipped": skipped, "faults": faults}


def run_suite(
    name: str, environment: Environment, targets: list[Path], *, options: list[str], variables: dict[str, str]
) -> Result:
    """Run pytest on the targets in an environment with extra `variables`. The output is printed at the end, in one
    piece."""
    title = f"{name}, Python {environment.python_version}, bpy {environment.blender_version}"
    say(f"tests: {title}")
    report = ENVIRONMENTS / "reports" / f"{name}-{environment.name}.xml"
    report.parent.mkdir(parents=True, exist_ok=True)
    clock_file = report.with_suffix(".clock")
    for old in (report, clock_file):
        old.unlink(missing_ok=True)
    variables = variables | {"NATURAL_GRATINGS_CLOCK": str(clock_file)}
    command = [environment.python, "-m", "pytest", *targets, f"--junitxml={report}", "--durations=12", *options]
    start = time.monotonic()
    with subprocess.Popen(
        command, cwd=ROOT, env=project_environment(**variables), stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, errors="replace",
    ) as process:  # fmt: skip
        running.add(process)
        clock = threading.Timer(LIMIT_SECONDS, process.kill)
        clock.start()
        output, _ = process.communicate()
        clock.cancel()
        running.remove(process)
    print(f"\n{title}\n{output}", flush=True)
    status = process.returncode
    if status == NO_TESTS_COLLECTED and options:
        status = 0  # options such as -k chose tests of another suite
    return Result(title, status, time.monotonic() - start, **counts(report))


def targets_of(name: str, environment: Environment, paths: list[Path], *, short: bool) -> list[Path]:
    """The given paths in the suite's folder. Without given paths, the whole folder, or in some environments a part
    (AGAIN, and in a short run SHORT)."""
    folder = ROOT / "tests" / name
    if paths:
        return [path for path in paths if path.is_relative_to(folder)]
    parts = (AGAIN | SHORT if short else AGAIN).get((name, environment))
    if parts:
        return [folder / part for part in parts]
    return [folder] if test_files(folder) else []


def print_summary(results: list[Result]) -> None:
    """Print a line for each suite and each failed test, and a last line of totals for programs."""
    print(f"\n{'suite':44} {'result':9} {'passed':>7} {'failed':>7} {'skipped':>8} {'seconds':>8}")
    for result in results:
        numbers = f"{result.passed:7} {result.failed:7} {result.skipped:8} {result.seconds:8.1f}"
        print(f"{result.title:44} {result.verdict:9} {numbers}")
    for result in results:
        for fault in result.faults:
            print(f"{result.title}: {fault}")
    totals = [sum(getattr(result, name) for result in results) for name in ("passed", "failed", "skipped")]
    print("\n{} passed, {} failed, {} skipped".format(*totals), flush=True)


def run(environments: Sequence[Environment], arguments: Sequence[str], blender: Path | None) -> int:
    """Run the suites that `arguments` name, by default the short set of each, or with --all everything. Returns 0 if
    every suite passed, else 1."""
    own = {"--all", "--clock", "--changed"} & set(arguments)
    paths, options = split_arguments([argument for argument in arguments if argument not in own])
    if "--changed" in own:
        paths += affected_tests(changed_files())
        print("\n".join(os.path.relpath(path) for path in paths), flush=True)
    paths = [path for path in paths if path != ROOT / "tests"]
    short = "--all" not in own and (not paths or "--changed" in own)
    left_out = (AGAIN | SHORT).keys() if "--changed" in own else ()
    options += ["--short"] * short + ["-p", "devtools.clock"] * ("--clock" in own)
    variables = {"NATURAL_GRATINGS_BLENDER": str(blender)} if blender else {}
    wanted = [
        (name, environment, targets)
        for name, environment in SUITES
        if environment in environments
        and (name, environment) not in left_out
        and (targets := targets_of(name, environment, paths, short=short))
    ]
    if "--all" in own:
        wanted.sort(key=lambda each: each[0] != "package")  # the night's slowest
    both = "--all" in own and len(environments) > 1
    suites = [
        partial(
            run_suite, name, environment, targets, variables=variables,
            options=options + ["--short"] * (both and environment != BPY53 and name in ("addon", "render")),
        )
        for name, environment, targets in wanted
    ]  # fmt: skip
    if not paths and BPY45 in environments:
        make_drafts(BPY45)  # else tests of every suite bake them
    results = run_together(suites, workers=2)
    print_summary(results)
    if not results:
        print(f"error: no tests in {os.path.relpath(ROOT / 'tests')} match; remedy: name a path under tests/")
    return 0 if results and all(result.good for result in results) else 1

# SPDX-License-Identifier: GPL-3.0-or-later
"""A benchmark's table is not buried under what Blender prints from C."""

import subprocess
import sys
from pathlib import Path

from devtools.steps import project_environment

NOISY = """
import os

def main(argv):
    os.write(1, b"Fra:1 Mem:12M Sample 1/32\\n" * 1000)
    os.write(2, b"Saved: timed.exr\\n" * 1000)
    print("the table")
    return 0
"""
RUN = """
import runpy, sys
from laboratory import benchmarks
benchmarks.__path__.append(sys.argv.pop(1))
runpy.run_module("laboratory.benchmarks", run_name="__main__", alter_sys=True)
"""


def test_only_a_benchmarks_own_lines_are_printed(tmp_path: Path):
    (tmp_path / "noisy.py").write_text(NOISY)
    command = [sys.executable, "-c", RUN, str(tmp_path), "noisy"]
    done = subprocess.run(command, env=project_environment(), capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("the table\n", "")

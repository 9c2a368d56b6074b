# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line as a program: its help, its exit status, and signals that stop it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from precompute.bake import ensemble

from .conftest import PICTURE


@pytest.mark.parametrize(("fault", "status"), [
    (KeyboardInterrupt(), 130), (MemoryError(), 1), (PermissionError(13, "Permission denied", "/some/place"), 1),
    (OSError("encoder error -2"), 1),
])  # fmt: skip
def test_what_stops_a_run(refused, scan, tmp_path, monkeypatch, fault, status):
    def stop(*_, **__):
        raise fault

    monkeypatch.setattr(ensemble, "plan", stop)
    told = refused("bake", scan, *PICTURE, "-o", tmp_path / "out", status=status)
    assert "None" not in told
    assert not isinstance(fault, MemoryError) or told.startswith(f"error: {scan}: not enough memory; ")


def test_the_module_runs_as_a_program(scan, tmp_path):
    root = Path(__file__).resolve().parents[3]

    def program(*argv):
        command = [sys.executable, "-m", "precompute", *map(str, argv)]
        return subprocess.run(command, cwd=root, capture_output=True, text=True)

    good = program("info", scan, *PICTURE, "--json", "-")
    assert good.returncode == 0 and json.loads(good.stdout)["rows"] == 48 and good.stderr == ""
    bad = program("info", tmp_path / "missing.nid")
    assert bad.returncode == 1 and bad.stdout == ""
    assert bad.stderr.startswith("error: ") and len(bad.stderr.splitlines()) == 1


@pytest.mark.parametrize("argv", [["--help"], ["info", "--help"], ["bake", "--help"], ["map", "--help"]])
def test_help_is_told(run, argv):
    status, out, err = run(*argv)
    assert (status, err) == (0, "")
    assert out.startswith("usage: grating")

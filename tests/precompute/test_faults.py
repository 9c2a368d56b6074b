# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults of disks, paths, clocks, processes and memory outside Blender, injected for real: none leaves a traceback, an
unfinished file or a changed one. `./dev bench faults` runs them all, with more kills."""

import json

import pytest

from laboratory.benchmarks import faults, faults_bake
from laboratory.benchmarks.faults_case import Case, SkipFault, assert_no_leftovers, run

# Fewer than those of the benchmark, so that a case takes a few seconds.
CASES = faults_bake.cases(kills=2, memories_mib=(faults_bake.MEMORIES_MIB[0], faults_bake.MEMORIES_MIB[-1]))


@pytest.mark.short(
    "output's disk is full", "has the bake", "deleted during", "pulled out", "255 bytes", "too long", "of 2100"
)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_fault_costs_one_line_and_no_data(tmp_path, case):
    row = run(case, tmp_path)
    if row.skipped:
        pytest.skip(row.skipped)
    assert row.failed == () and row.sees
    # Half of the lines of a failure are its remedy.
    assert not row.sees.startswith("error: ") or "; " in row.sees


def harmful(folder):
    (folder / ".bake.1.partial").mkdir()
    assert_no_leftovers(folder)
    return "never"


def missing(folder):
    raise SkipFault("no such disk here")


def test_harm_and_skipped_faults_are_told(tmp_path, monkeypatch, capsys):
    made = [Case("harm", harmful), Case("skipped", missing), Case("well", lambda folder: f"{folder}/a: one line")]
    monkeypatch.setattr(faults_bake, "cases", lambda kills: made)
    monkeypatch.setattr(faults.faults_blender, "CASES", [])
    assert faults.main(["--json", str(tmp_path / "facts.json")]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert "| harm |  | left unfinished: .bake.1.partial |" in lines
    assert "| skipped |  | skipped: no such disk here |" in lines
    assert "| well | a: one line | nothing |" in lines
    rows = json.loads((tmp_path / "facts.json").read_text())["faults"]
    assert [row["fault"] for row in rows] == ["harm", "skipped", "well"]
    assert faults.main(["--only", "well"]) == 0

# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults of disks, paths, clocks, processes and memory outside Blender, injected for real: none leaves a traceback, an
unfinished file or a changed one."""

import pytest

from . import faults_bake

CASES = faults_bake.cases(kills=2, memories_mib=(faults_bake.MEMORIES_MIB[0], faults_bake.MEMORIES_MIB[-1]))


@pytest.mark.short(
    "output's disk is full", "has the bake", "deleted during", "pulled out", "255 bytes", "too long", "of 2100"
)
@pytest.mark.parametrize("name", CASES)
def test_a_fault_costs_one_line_and_no_data(tmp_path, name):
    sees = CASES[name](tmp_path)
    assert sees
    # Half of the lines of a failure are its remedy.
    assert not sees.startswith("error: ") or "; " in sees

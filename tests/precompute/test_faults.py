# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults of disks, paths, clocks, processes and memory outside Blender, injected for real: none leaves a traceback, an
unfinished file or a changed one."""

import pytest

from . import faults_bake

CASES = faults_bake.cases(kills=2, memories_mib=(faults_bake.MEMORIES_MIB[0], faults_bake.MEMORIES_MIB[-1]))


@pytest.mark.short("the output's disk is full", "the cache is deleted during a bake")
@pytest.mark.parametrize("name", CASES)
def test_a_fault_costs_one_line_and_no_data(tmp_path, name):
    sees = CASES[name](tmp_path)
    assert sees
    # Half of the lines of a failure are its remedy.
    assert not sees.startswith("error: ") or "; " in sees

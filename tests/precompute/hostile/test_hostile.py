# SPDX-License-Identifier: GPL-3.0-or-later
"""A few cases of every suite of hostile input; `python -m tests.hostile` runs them in full."""

import pytest

from tests.hostile import SUITES, runner

# Inputs of each group; the readers' suite has a group for each of their many formats.
COUNTS, SEED = {"readers": 6, "verbs": 6, "headers": 20, "meshes": 10, "records": 20, "arguments": 20}, 1


@pytest.mark.parametrize("suite", SUITES)
@pytest.mark.night("tests/precompute/surface/test_finds.py")
def test_hostile_input_is_taken_or_refused_in_one_line(suite, tmp_path):
    outcomes = [runner.run(case) for case in SUITES[suite](COUNTS[suite], SEED, tmp_path)]
    assert len(outcomes) >= COUNTS[suite]
    assert not [f"{each.name}: {each.line}" for each in outcomes if each.verdict == runner.FAILED]

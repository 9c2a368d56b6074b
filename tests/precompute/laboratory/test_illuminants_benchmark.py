# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of bakes for several lamps and of lamps' own bakes."""

import json

import pytest

from laboratory.benchmarks import illuminants


@pytest.mark.night("tests/precompute/bake/test_several_lamps.py")
def test_its_table(monkeypatch, capsys):
    """On a blaze: the own bake keeps its dE00 under a tube and a bulb, and so do six channels under the bulb. Nine
    channels are closer under an LED. Daylight's bake is wrong under each."""
    monkeypatch.setattr(illuminants.rows_of, "__defaults__", (("FL11", "2700K", "LED-B1"),))
    assert illuminants.main(["--surfaces", "sample:blazed", "--pairs", "60", "--json", "-"]) == 0
    printed = capsys.readouterr()
    ((tube, bulb, led),) = json.loads(printed.out).values()
    for lamp, row in (("FL11", tube), ("2700K", bulb), ("LED-B1", led)):
        assert row["lamp"] == lamp and row["own"]["p95"] <= 1 < 3 < row["three"]["p95"]
        assert row["own"]["light"] == pytest.approx(0, abs=0.01)
    assert bulb["six"]["p95"] <= 1 and led["nine"]["p95"] < led["six"]["p95"] < led["three"]["p95"]
    # A tube's bands are in neither set.
    assert 1 < tube["nine"]["p95"] < tube["six"]["p95"] < tube["three"]["p95"]
    table = [line for line in printed.err.splitlines() if line.startswith("|")]
    assert len(table) == 5 and all(line.count("|") == 10 for line in table)

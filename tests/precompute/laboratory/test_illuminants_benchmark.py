# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of lamps' own bakes."""

import json

import pytest

from laboratory.benchmarks import illuminants


def test_its_table(monkeypatch, capsys):
    """On a blaze under a tube: the own bake keeps its dE00, and daylight's bake does not."""
    monkeypatch.setattr(illuminants.rows_of, "__defaults__", (("FL11",),))
    assert illuminants.main(["--surfaces", "sample:blazed", "--pairs", "60", "--json", "-"]) == 0
    printed = capsys.readouterr()
    ((row,),) = json.loads(printed.out).values()
    assert row["lamp"] == "FL11" and row["own"]["p95"] <= 1 < 3 < row["daylight"]["p95"]
    assert row["own"]["light"] == pytest.approx(0, abs=0.01)
    assert "| FL11 |" in printed.err

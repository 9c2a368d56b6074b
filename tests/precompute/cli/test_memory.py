# SPDX-License-Identifier: GPL-3.0-or-later
"""Every verb that transforms a picture refuses work beyond the free memory, in one line."""

import pytest

from precompute.base import machine

from .conftest import PICTURE

WIDE = ("--size-um", "1000", "--height-nm", "250")
OUTPUTS = {
    "bake": ("-o", "OUT/bakes"),
    "dft": ("-o", "OUT/dft"),
    "map": ("-o", "OUT/map.png"),
    "map --method reference": ("-o", "OUT/map.png"),
    "map --method chebyshev": ("-o", "OUT/map.png"),
    "evaluate": ("--period-nm", "800"),
}


@pytest.fixture
def line_of(refused, scan, tmp_path):
    def run(verb, *options):
        name, *more = verb.split()
        own = [each.replace("OUT", str(tmp_path)) for each in (*more, *OUTPUTS[verb], *options)]
        return refused(name, scan, *own, "--progress", "none")

    return run


@pytest.mark.parametrize("verb", OUTPUTS)
def test_a_picture_said_to_be_a_millimetre_wide(line_of, scan, monkeypatch, verb):
    """48 pixels become 10,560: 2.9 GiB, more than half of 4 GiB."""
    monkeypatch.setattr(machine, "free_bytes", lambda: 4 << 30)
    told = line_of(verb, *WIDE)
    assert f"{scan}: " in told and "10560 x 10560" in told and "crop the scan" in told


@pytest.mark.parametrize("verb", OUTPUTS)
def test_work_that_little_memory_does_not_hold(line_of, scan, monkeypatch, verb):
    """The refined relief of 48 x 48 pixels fits into half a MiB; its transforms do not."""
    monkeypatch.setattr(machine, "free_bytes", lambda: 250_000)
    monkeypatch.setattr(machine, "_SMALL", 0)
    monkeypatch.setattr("precompute.surface.readers.pictures.refuse_beyond_memory", lambda *_, **__: None)
    told = line_of(verb, *PICTURE)
    assert f"{scan}: " in told and "more than half of the 0 MiB" in told


def test_a_picture_that_does_not_fit_is_not_decoded(refused, scan, monkeypatch):
    monkeypatch.setattr(machine, "free_bytes", lambda: 10_000)
    monkeypatch.setattr(machine, "_SMALL", 0)
    assert "reading 48 x 48 pixels would take" in refused("info", scan, *PICTURE)


@pytest.mark.night("tests/precompute/cli/test_level.py")
def test_a_bake_says_first_what_it_expects(run, scan, tmp_path):
    options = ("--delta-e", "5", "--coherence-um", "4", "-o", tmp_path / "bakes")
    status, _, err = run("bake", scan, *PICTURE, *options)
    assert status == 0
    told = err.splitlines()
    assert told[0].startswith("expects ") and " and about " in told[0]

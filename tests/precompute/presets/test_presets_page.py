# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of docs/presets.md against the presets' files."""

from precompute.presets.presets import Preset, preset_names, read_preset
from tests.precompute.test_layering import ROOT

PAGE = ROOT / "docs" / "presets.md"


def row(preset: Preset) -> str:
    """A preset's row of the table."""
    scans = "<br>".join(f"`{scan.source}`" for scan in preset.request.scans)
    matter = preset.request.matter
    return f"| {preset.title}<br>`{preset.name}` | {scans} | `{matter.text or matter}` |"


def test_the_table_is_that_of_the_files():
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    start = lines.index("| preset | relief | matter |")
    assert lines[start + 2 : lines.index("", start)] == [row(read_preset(name)) for name in preset_names()]


def test_no_title_of_a_preset_breaks_the_table():
    for name in preset_names():
        assert not any(mark in read_preset(name).title for mark in "|<")


def test_each_preset_names_its_sources():
    assert all(read_preset(name).sources for name in preset_names())

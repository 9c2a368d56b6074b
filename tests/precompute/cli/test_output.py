# SPDX-License-Identifier: GPL-3.0-or-later
"""The JSON that verbs write is standard JSON."""

import json
import math

import numpy as np
import pytest
from PIL import Image

from laboratory.study.colour_comparison import ColourComparison
from precompute.base.failure import GratingError
from precompute.cli.printing import emit
from precompute.measure.errors import Errors
from precompute.table.atlas import write_exr


@pytest.mark.parametrize("figure", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("to_file", [True, False])
def test_json_holds_no_figure_that_is_not_finite(tmp_path, capsys, figure, to_file):
    """NaN and Infinity, as Python writes them, are not JSON."""
    target = tmp_path / "facts.json"
    with pytest.raises(GratingError, match="not finite.*; "):
        emit({"errors": [{"p99": figure}]}, str(target) if to_file else "-", lambda: [])
    assert not target.exists()
    assert capsys.readouterr().out == ""


@pytest.mark.night("tests/precompute/cli/test_memory.py")
def test_a_surface_without_light_around_the_first_order_is_refused(refused):
    """A mirror's spectrum is dark, so there are no colours to compare with the bake's."""
    options = ("--period-nm", "1000", "--methods", "bake", "--progress", "none", "--json", "-")
    assert "dark around the first order of 1000 nm" in refused("evaluate", "sample:flat", *options)


def test_colours_without_a_dominant_wavelength_are_null():
    """Purples have no dominant wavelength, so no error in nanometres."""
    none = ColourComparison(10.0, 10.0, None, 0.01, 1.0)
    assert json.loads(json.dumps(none.as_dict(), allow_nan=False))["dominant_wavelength_rms_nm"] is None
    assert "no dominant wavelength" in none.summary()


def test_an_infinite_error_is_null():
    """A table that returns NaN has infinite errors of colour (`measure`)."""
    found = Errors(math.inf, math.inf, math.inf, math.inf, 0.1, 0.1, 0.0, 7, 0.0).as_dict()
    assert found["p99"] is None and found["relative_dy"] == 0.1


def test_no_verb_replaces_a_file_that_it_reads(refused, tmp_path, monkeypatch):
    """The scan of a bake into its own folder, the picture of a map, a mesh, and facts beside any of them."""
    monkeypatch.chdir(tmp_path)
    heights = np.tile(np.sin(np.arange(16.0)), (16, 1)).astype(np.float32)
    write_exr(tmp_path / "a.exr", np.repeat(heights[..., None], 3, axis=2), {})
    Image.fromarray(np.uint8(127 + 100 * heights)).save(tmp_path / "a.png")
    for name in ("uv.npz", "mesh.npz"):
        (tmp_path / name).write_bytes(b"")
    size = ("--size-um", "2", "--height-nm", "60")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    for line in (
        ("bake", "a.exr", *size, "-o", "."),
        ("map", "a.png", *size, "--method", "reference", "-o", f"{tmp_path}/a.png"),
        ("info", "./a.png", *size, "--json", "a.png"), ("comb", "mesh.npz", "-o", "."), ("unwrap", "uv.npz", "-o", "."),
    ):  # fmt: skip
        assert "would be overwritten, but is an input; write to another folder or file" in refused(*line)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before

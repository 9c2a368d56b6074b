# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of a scene's needs: reading, their effect on the kernel, and refusals."""

import json
import math

import pytest

from precompute.bake.needs import EVERYTHING, Needs, read_needs
from precompute.base.failure import GratingError
from precompute.cli import parser


def written(tmp_path, record):
    """Write a needs file from a record, or from a text that is not JSON; return its path."""
    path = tmp_path / "needs.json"
    path.write_text(record if isinstance(record, str) else json.dumps(record))
    return path


def test_what_is_not_said_is_everything(tmp_path):
    assert read_needs(written(tmp_path, {"format": 1})) == EVERYTHING
    assert EVERYTHING.everything and EVERYTHING.kernel == 0 and EVERYTHING.region.reach == 2


def test_a_file_says_what_a_scene_needs(tmp_path):
    record = {"format": 1, "u": [-0.5, 1], "w": [0.5, 2], "light_radius_deg": 2, "footprint": 0.2}
    needs = read_needs(written(tmp_path, record))
    assert (*needs.region, needs.w) == ((-0.5, 1), (-2, 2), (0.5, 2))
    assert not needs.everything and needs.region.reach == 2
    # Half of a pixel's 0.2 / sqrt(12) is more than half of two degrees, 0.017.
    assert needs.kernel == pytest.approx(0.1 / math.sqrt(12))
    assert read_needs(written(tmp_path, needs.as_dict())).region == needs.region


def test_a_disc_blurs_by_half_its_radius():
    assert Needs(light_radius=0.1).kernel == 0.05


@pytest.mark.parametrize(
    ("record", "fault"),
    [
        ("{", "not JSON that can be used"),
        ("[" * 10**5 + "]" * 10**5, "nested too deeply"),
        ('{"format": 1, "footprint": ' + "1" * 5000 + "}", "integer of 5000 digits"),
        ('{"format": 1, "footprint": 1e999}', "not a finite number"),
        ('{"format": 1, "footprint": NaN}', "not a finite number"),
        ('{"format": 1, "u": [0, 1], "u": [0, 2]}', "a key appears twice"),
        ({"format": True}, "not a needs file of format 1"),
        ({"format": 1, "k" * 10**5: 0}, "kkk: no such key"),
        ({"format": 1, "u": [False, True]}, "u: cannot be .*; give two numbers"),
        ({"format": 1, "w": {"0": 0, "1": 1}}, "w: cannot be .*; give two numbers"),
        ({"format": 1, "footprint": True}, "footprint: cannot be .*; give a number"),
        ({"format": 1, "light_radius_deg": [[[1]]]}, "light_radius_deg: cannot be .*; give a number"),
        ([], "not a needs file of format 1"),
        ({"u": [0, 1]}, "not a needs file of format 1"),
        ({"format": 2}, "not a needs file of format 1"),
        ({"format": 1, "x": 0}, "x: no such key"),
        ({"format": 1, "u": [1, 0]}, "u: cannot be .*; give two numbers"),
        ({"format": 1, "u": [0, 0.001]}, "u: cannot be .*; give two numbers"),
        ({"format": 1, "v": [-3, 0]}, "v: cannot be .*; give two numbers"),
        ({"format": 1, "w": "all"}, "w: cannot be .*; give two numbers"),
        ({"format": 1, "w": [0, None]}, "w: cannot be .*; give two numbers"),
        ({"format": 1, "footprint": -1}, "footprint: cannot be .*; give a number"),
        ({"format": 1, "light_radius_deg": "wide"}, "light_radius_deg: cannot be .*; give a number"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(tmp_path, record, fault):
    with pytest.raises(GratingError, match=fault) as caught:
        read_needs(written(tmp_path, record))
    assert "\n" not in str(caught.value) and "needs.json" in str(caught.value) and len(str(caught.value)) < 500


@pytest.mark.parametrize("content", [b"\xff\xfe{\0}\0", b"\xef\xbb\xbf{]", b"\x80", b"", b" " * (1 << 21)])
def test_bytes_that_are_no_text_are_refused(tmp_path, content):
    path = tmp_path / "needs.json"
    path.write_bytes(content)
    with pytest.raises(GratingError, match=r"needs.json: .*; write one by the verb `needs` inside Blender"):
        read_needs(path)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(GratingError, match="none.json"):
        read_needs(tmp_path / "none.json")


def test_a_region_that_no_directions_reach_is_refused(tmp_path, capsys):
    needs = tmp_path / "needs.json"
    needs.write_text(json.dumps({"format": 1, "u": [1.5, 2], "v": [-2, -1.5]}))
    assert parser.main(["bake", "sample:cd", "--needs", str(needs), "-o", str(tmp_path), "--progress", "none"]) == 1
    assert "no directions of light and view have the u, v and w of its needs" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["needs.json"]

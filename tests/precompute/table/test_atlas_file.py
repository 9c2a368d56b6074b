# SPDX-License-Identifier: GPL-3.0-or-later
"""Table files: a round trip, and refusals of other files."""

import json
import os
from dataclasses import asdict, replace

import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from laboratory.check import table_file
from precompute.base.failure import GratingError
from precompute.reflectance.matter import parse
from precompute.table import atlas
from precompute.table.atlas import FORMAT, HEADER_KEY, read_header
from precompute.table.blur_levels import TERMS_MAX

from .conftest import PROVENANCE, plain_exr, random_bake, refusal


@pytest.fixture
def written(tmp_path):
    """A dielectric's table and its file."""
    table = random_bake()
    path = tmp_path / "table.exr"
    atlas.write_together({path: atlas.pack(table)}, PROVENANCE)
    return table, path


def test_a_file_comes_back(written):
    table, path = written
    again, record = atlas.read(path)
    image, layout = atlas.pack(table)
    expected = atlas.unpack(image, layout)
    np.testing.assert_array_equal(again.terms, expected.terms)
    np.testing.assert_array_equal(again.zero_order, expected.zero_order)
    assert {key: record[key] for key in PROVENANCE} == PROVENANCE
    assert record["format"] == atlas.FORMAT
    assert not read_header(path)[0].holds_reflectance and not again.holds_reflectance
    held = table_file.read_table(path)
    assert held.ratio_ior == 1
    np.testing.assert_array_equal(held.terms, again.terms)


def test_a_metal_comes_back(tmp_path):
    path = tmp_path / "metal.exr"
    of_gold = PROVENANCE | {"request": {"matter": "gold"}}
    atlas.write_together(
        {path: atlas.pack(replace(random_bake(), ratio_ior=parse("gold").ratio_ior, largest_albedo=1.25))}, of_gold
    )
    again, held = atlas.read(path)[0], table_file.read_table(path)
    assert read_header(path)[0].holds_reflectance and again.ratio_ior == held.ratio_ior == parse("gold").ratio_ior
    assert again.largest_albedo == 1.25
    np.testing.assert_allclose(held.terms, 1.25 * again.terms, rtol=1e-6)
    np.testing.assert_allclose(held.zero_order, 1.25 * again.zero_order, rtol=1e-6)


def test_the_header_tells_the_layout_without_the_pixels(written):
    table, path = written
    layout, record = read_header(path)
    assert layout == atlas.layout_of(table)
    assert atlas.Layout(**record["layout"]) == layout


def test_the_file_is_a_plain_half_float_picture(written):
    """Other readers of OpenEXR see R, G, B in half floats, row 0 at the top, and our attribute in JSON."""
    table, path = written
    image, _ = atlas.pack(table)
    file = OpenEXR.File(str(path))
    pixels = file.channels()["RGB"].pixels
    assert pixels.dtype == np.float16
    np.testing.assert_array_equal(pixels, image[::-1])
    assert json.loads(file.header()[HEADER_KEY])["source"] == "sample:test"


def test_writing_replaces_an_older_bake(written):
    _, path = written
    other = random_bake(seed=1)
    atlas.write_together({path: atlas.pack(other)}, PROVENANCE)
    assert np.abs(atlas.read(path)[0].terms - other.terms).max() < 1e-3
    assert os.listdir(path.parent) == ["table.exr"]


@pytest.mark.parametrize("fault", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_an_interrupted_write_leaves_nothing(tmp_path, monkeypatch, fault):
    def fail(*_):
        raise fault

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises((KeyboardInterrupt, GratingError)) as caught:
        atlas.write_together({tmp_path / "table.exr": atlas.pack(random_bake())}, PROVENANCE)
    assert os.listdir(tmp_path) == []
    if isinstance(fault, OSError):
        assert str(caught.value).startswith(f"{tmp_path / 'table.exr'}: cannot be written (No space left on device); ")


def test_an_interrupted_write_keeps_the_older_bake(written, monkeypatch):
    _, path = written
    before = path.read_bytes()

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(GratingError, match="No space left"):
        atlas.write_together({path: atlas.pack(random_bake(seed=1))}, PROVENANCE)
    assert path.read_bytes() == before
    assert os.listdir(path.parent) == ["table.exr"]


def test_a_header_that_would_not_be_read_is_not_written(tmp_path):
    with pytest.raises(GratingError, match="bake fewer scans"):
        atlas.write_together({tmp_path / "table.exr": atlas.pack(random_bake())}, {"source": "s" * (1 << 20)})
    assert os.listdir(tmp_path) == []


def test_a_place_that_cannot_be_written_is_told(tmp_path):
    """For a read-only folder or a full disc OpenEXR raises a RuntimeError, which no caller expects."""
    with pytest.raises(GratingError, match=r"table\.exr: cannot be written \(No such file or directory\); "):
        atlas.write_together({tmp_path / "not there" / "table.exr": atlas.pack(random_bake())}, PROVENANCE)


def refused(path):
    return refusal(path, atlas.read, read_header)


def test_what_is_no_exr_is_refused(tmp_path):
    path = tmp_path / "table.exr"
    assert "no such file" in refused(path)
    path.write_bytes(b"")
    assert "not a readable OpenEXR" in refused(path)
    path.write_bytes(b"\x89PNG\r\n\x1a\n and more of it" * 9)
    assert "not a readable OpenEXR" in refused(path)
    path.unlink()
    path.mkdir()
    refused(path)


def test_another_exr_is_refused(tmp_path):
    path = tmp_path / "render.exr"
    plain_exr(path, np.zeros((4, 4, 3), np.float16))
    assert "not a Natural Gratings bake" in refused(path)


@pytest.mark.parametrize("record", [
    [], None, 3, {}, {"format": FORMAT}, {"format": FORMAT, "layout": {}}, {"format": FORMAT, "layout": 6},
    {"format": FORMAT, "layout": {"terms": 3, "surplus": 4}},
])  # fmt: skip
def test_a_header_that_says_nothing_is_refused(tmp_path, record):
    path = tmp_path / "table.exr"
    plain_exr(path, np.zeros((4, 4, 3), np.float16), {HEADER_KEY: json.dumps(record)})
    assert "not a Natural Gratings bake" in refused(path)


@pytest.mark.parametrize("record", [
    "no JSON", "", "[" * 10**5 + "]" * 10**5, '{"format": 10, "layout": ' + "9" * 5000 + "}", '{"format": NaN}',
    '{"format": 10, "format": 10}', '{"format": 10, "layout": 1e400}', '\xef\xbb\xbf\xef\xbb\xbf{}',
])  # fmt: skip
def test_a_header_that_is_no_json_is_refused(tmp_path, record):
    path = tmp_path / "table.exr"
    plain_exr(path, np.zeros((4, 4, 3), np.float16), {HEADER_KEY: record})
    assert "its header: not JSON" in refused(path)


def test_another_version_is_refused(tmp_path):
    path = tmp_path / "table.exr"
    plain_exr(path, np.zeros((4, 4, 3), np.float16), {HEADER_KEY: '{"format": 99}'})
    assert "format 99" in refused(path)


@pytest.mark.parametrize("lie", [
    {"terms": 10**4}, {"terms": 7}, {"terms": -1}, {"cell_rows": 13}, {"columns": 10**6}, {"rows": 1},
    {"w_max": 0.0}, {"u_first": 9.0}, {"strip_rows": 0}, {"zero_order_samples": 10**4}, {"cell_columns": "12"},
    {"cell_columns": 12.5}, {"scale": "big"}, {"texel": None}, {"levels": 2}, {"levels": 10**9},
    {"inner_rows": 10**6}, {"inner_columns": 3}, {"ratio_ior": 1.2}, {"strip_rows": 6},
    {"largest_albedo": 0.9}, {"largest_albedo": 1.1}, {"ratio_ior": 1.5, "largest_albedo": 99.0},
    {"columns": 5, "rows": 1}, {"level_ratio": 3.0}, {"level_ratio": 0.0}, {"level_ratio": "4"},
    {"level_offset": 0.7}, {"level_offset": None}, {"level_coarser": 0.9}, {"level_coarser": 5.0},
    {"level_coarser": "1"},
    {"terms": True}, {"terms": 20_000, "rows": 10_000}, {"levels": 0}, {"levels": True}, {"illuminant": "moon"},
    {"illuminant": ["D65"]}, {"sigma_b": 0}, {"sigma_b": 1e-300}, {"sigma_b": 50}, {"sigma_b": float("nan")},
    {"scale": 1e300}, {"scale": 5e-324}, {"scale": True}, {"texel": 1e300}, {"texel": 1e-300}, {"texel": 10**400},
    {"u_first": -1.0}, {"v_first": 1.0}, {"u_first": {}}, {"w_min": 2, "w_max": 1}, {"w_min": 1.0, "w_max": 1.0},
    {"w_max": 2.5}, {"strip_rows": 10**9 + 4}, {"rows": 10**15, "columns": 10**15},
    {"inner_rows": 2**53 - 1}, {"surplus": 1},
])  # fmt: skip
def test_a_header_that_lies_about_its_picture_is_refused(tmp_path, lie):
    """Everything is compared with the picture before use, also by the reader of the header. A block of 3 x 2 tiles with
    5 used has no seventh."""
    image, layout = atlas.pack(random_bake())
    path = tmp_path / "table.exr"
    lying = {"format": atlas.FORMAT, "layout": {**asdict(layout), **lie}}
    plain_exr(path, image[::-1], {HEADER_KEY: json.dumps(lying)})
    refused(path)


def test_a_layout_of_another_picture_is_refused(written, tmp_path):
    """This includes layouts that fit another bake: three terms in a block of six tiles."""
    image, layout = atlas.pack(written[0])
    path = tmp_path / "other.exr"
    for other in (atlas.layout_of(random_bake(terms=7)), atlas.layout_of(random_bake(levels=2))):
        record = {"format": atlas.FORMAT, "layout": asdict(other)}
        plain_exr(path, image[::-1], {HEADER_KEY: json.dumps(record)})
        assert "not the size" in refused(path)


@pytest.mark.parametrize("precision", ["float32", "float64", 16, True, ["float16"], {}, "float16" * 10**4])
def test_a_precision_that_the_picture_has_not_is_refused(tmp_path, precision):
    path = tmp_path / "table.exr"
    atlas.write_together({path: atlas.pack(random_bake())}, {"precision": precision})
    assert len(refused(path)) < 400


@pytest.mark.parametrize("provenance", [
    {"source": 1}, {"coherence_um": "12.5"}, {"asked_delta_e": True}, {"delta_e": []}, {"shape": 3}, {"request": None},
    {"channel": None}, {"model": ["ensemble"]}, {"pixel_size_m": "1"}, {"heights_sha256": {}}, {"height_range_m": [1]},
])  # fmt: skip
def test_provenance_of_other_kinds_is_refused(tmp_path, provenance):
    path = tmp_path / "table.exr"
    atlas.write_together({path: atlas.pack(random_bake())}, {**PROVENANCE, **provenance})
    (key,) = provenance
    assert f"its header's {key} is " in refused(path)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_picture_that_is_no_number_is_refused(written, value):
    """Only readers that check the pixels refuse it; the header is valid."""
    table, path = written
    image, layout = atlas.pack(table)
    image[-1, -1, 2] = value
    atlas.write_together({path: (image, layout)}, PROVENANCE)
    assert read_header(path)[0] == layout
    assert "not numbers" in refusal(path, atlas.read, atlas.read_sound_header)


def test_no_bake_has_more_terms_than_are_read():
    assert atlas.layout_of(random_bake(terms=TERMS_MAX)).is_valid
    with pytest.raises(GratingError, match="97 terms.*; ask for a larger --delta-e"):
        atlas.layout_of(random_bake(terms=TERMS_MAX + 1))


@settings(deadline=None, max_examples=60)
@given(st.floats(0.01, 0.99))
def test_a_truncated_file_is_refused(tmp_path_factory, share):
    path = tmp_path_factory.getbasetemp() / "truncated.exr"
    atlas.write_together({path: atlas.pack(random_bake(terms=6, resolution=16))}, PROVENANCE)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(GratingError) as caught:
        atlas.read(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)


def test_a_picture_of_other_channels_is_refused(tmp_path):
    path = tmp_path / "table.exr"
    image, layout = atlas.pack(random_bake())
    record = json.dumps({"format": atlas.FORMAT, "layout": asdict(layout)})
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, HEADER_KEY: record}
    with OpenEXR.File(header, {"Y": np.ascontiguousarray(image[..., 0])}) as file:
        file.write(str(path))
    with pytest.raises(GratingError, match="^.*table.exr: "):
        atlas.read(path)

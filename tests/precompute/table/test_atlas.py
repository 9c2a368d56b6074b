# SPDX-License-Identifier: GPL-3.0-or-later
import json
import math
import os
from dataclasses import replace

import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.bake.resolution import RESOLUTION_MIN
from precompute.base.failure import GratingError
from precompute.table import atlas, atlas_file
from precompute.table.atlas_file import HEADER_KEY, read_header
from precompute.table.table import ZERO_ORDER_SAMPLES, Table

few = settings(deadline=None, max_examples=40)
PROVENANCE = {"source": "sample:test", "coherence_um": 12.5, "delta_e": {"p99": 0.7}, "shape": [3, 4]}


def random_bake(terms=5, resolution=12, samples=20, peak=1.0, seed=0, levels=1):
    """Of tiles of any numbers: resolution x resolution, or (rows, columns), texels on the first of the levels."""
    rng = np.random.default_rng(seed)
    tile = np.broadcast_to(resolution, 2)
    sizes = [[math.ceil((n - 5) / 2**level) + 5 for n in tile] for level in range(levels)]
    tiles, *wider = ((peak * rng.uniform(-1, 1, (terms, *size, 3))).astype(np.float32) for size in sizes)
    texel = 4 / (tile.max() - 5)
    return Table(tiles, rng.uniform(0, 1.1, (samples, 3)), 0.04, texel, "D65", wider=tuple(wider))


@pytest.fixture
def written(tmp_path):
    """A small bake and its file."""
    table = random_bake()
    path = tmp_path / "table.exr"
    atlas_file.write(path, *atlas.pack(table), PROVENANCE)
    return table, path


# Packing


@few
@given(st.integers(2, 30), st.floats(-12, 12), st.integers(0, 2**32), st.integers(1, 4))
def test_what_is_packed_comes_back(terms, decades, seed, levels):
    """A half float rounds to 2^-11 of a value; below 2^-14 its steps are 2^-24, and the scale puts the largest value
    between 4096 and 8192."""
    table = random_bake(terms, 12, 20, 10.0**decades, seed, levels)
    image, layout = atlas.pack(table)
    assert image.dtype == np.float16
    assert np.isfinite(image).all()
    again = atlas.unpack(image, layout)
    assert len(again.levels) == levels
    stored = [(one, other, layout.scale) for one, other in zip(table.levels, again.levels, strict=True)]
    for one, other, scale in (*stored, (table.zero_order, again.zero_order, 1)):
        assert (np.abs(one - other) <= np.abs(one) * 2.0**-11 * 1.0001 + 2.0**-25 * scale).all()
    assert (again.sigma_b, again.texel, again.illuminant) == (table.sigma_b, table.texel, table.illuminant)
    largest = np.abs(image.astype(float)).max()
    assert 4096 * (1 - 2**-11) <= largest <= 8192
    # A power of two loses nothing.
    assert np.log2(layout.scale) == round(np.log2(layout.scale))


def test_what_came_back_packs_to_the_same_image():
    image, layout = atlas.pack(random_bake(levels=3))
    again, same_layout = atlas.pack(atlas.unpack(image, layout))
    np.testing.assert_array_equal(again, image)
    assert same_layout == layout


def test_a_mirror_packs():
    table = random_bake(peak=0.0)
    image, layout = atlas.pack(table)
    assert not atlas.unpack(image, layout).terms.any()
    black = replace(table, zero_order=np.zeros((20, 3)))
    assert not atlas.unpack(*atlas.pack(black)).zero_order.any()


@pytest.mark.parametrize("levels", [1, 3, 6])
@pytest.mark.parametrize("terms", range(2, 50, 3))
@pytest.mark.parametrize("resolution", [6, 15, (41, 70), (300, 33)])
def test_tiles_do_not_overlap(terms, resolution, levels):
    """Every tile of every level lies inside the picture, above the strip, on texels of its own; few places are left
    empty, for every one is memory, and the picture is not much longer than wide."""
    table = random_bake(terms, resolution, 6, levels=levels)
    layout = atlas.layout_of(table)
    taken = np.zeros((layout.height, layout.width), int)
    taken[: layout.strip_rows] += 1
    for level, tiles in enumerate(table.levels):
        rows, columns = layout.tile_stride(level)
        for k in range(terms):
            x, y = layout.tile_origin(k, level)
            assert layout.tile_block(k, level) == (slice(y, y + tiles.shape[1]), slice(x, x + tiles.shape[2]))
            assert tiles.shape[1] <= rows and tiles.shape[2] <= columns
            tile = taken[y : y + rows, x : x + columns]
            assert tile.shape == (rows, columns)
            tile += 1
    assert taken.max() == 1
    assert terms <= layout.columns * layout.rows <= (1.34 * terms if np.ptp(resolution) == 0 else 2 * terms)
    if np.ptp(resolution) == 0:
        short, long = sorted((layout.height - layout.strip_rows, layout.width))
        assert long <= 3 * short


def test_where_a_level_is_read_is_of_closed_form():
    """What a material computes from a level that only the shading knows, in floats."""
    layout = atlas.layout_of(random_bake(7, (70, 101), levels=4))
    taken = [math.ceil(n / 8) * 8 for n in (layout.inner_rows, layout.inner_columns)]
    assert (layout.tile_rows, layout.tile_columns) == (taken[0] + 6, taken[1] + 6)
    for level in range(4):
        small = 2.0**-level
        rows, columns = (n * small + 6 for n in taken)
        x = y = 0
        if level:
            x, y = layout.columns * layout.tile_columns, layout.rows * (taken[0] * (1 - 2 * small) + 6 * (level - 1))
        assert layout.tile_stride(level) == (rows, columns)
        for k in range(7):
            place = x + k % layout.columns * columns, layout.strip_rows + y + k // layout.columns * rows
            assert layout.tile_origin(k, level) == place


def test_the_layout_tells_what_it_covers():
    table = random_bake(2, (9, 21), levels=2)
    layout = atlas.layout_of(table)
    (u_low, u_high), (v_low, v_high) = layout.region
    assert (u_low, u_high) == pytest.approx((-2, 2), abs=1e-12)
    assert (v_low, v_high) == pytest.approx((-0.5, 0.5), abs=1e-12)
    np.testing.assert_allclose(layout.region, table.region, atol=1e-12)
    assert not layout.whole
    assert atlas.layout_of(random_bake(2, 21)).whole
    assert not replace(layout, w_min=0.5).whole


def test_row_zero_of_the_image_is_its_bottom():
    """The strip is at the bottom, Z first; of a tile, row 0 is the least v."""
    table = random_bake(terms=2, resolution=8, samples=16)
    table.terms[:] = 0
    table.terms[1, 0, 3] = 1
    image, layout = atlas.pack(table)
    for row in range(atlas.STRIP_ROWS):
        np.testing.assert_allclose(image[row, :16], table.zero_order, rtol=1e-3)
    x, y = layout.tile_origin(1)
    assert np.argwhere(image[layout.strip_rows :, :, 0]).tolist() == [[y - layout.strip_rows, x + 3]]


def test_the_strip_goes_on_past_its_end():
    """A reading at w = 2 meets one sample more, in line with the last two, and in the file finds the same."""
    table = random_bake(terms=4, resolution=12, samples=20)
    image, layout = atlas.pack(table)
    expected = 2 * image[0, 19].astype(float) - image[0, 18]
    np.testing.assert_allclose(image[: atlas.STRIP_ROWS, 20], np.tile(expected, (4, 1)), rtol=2.0**-11)
    samples = image[0, 18:21].astype(float)
    # Half floats of three values about 1: 2^-11, weighed by at most one.
    np.testing.assert_allclose(table.zero_order_xyz(2.0), [1 / 6, 4 / 6, 1 / 6] @ samples, atol=2.0**-10)


def test_around_the_limit_stands_what_reading_meets():
    """Azimuth goes round, its last column being its first; at the horizon and at the normal the rows turn back."""
    excess = np.random.default_rng(0).random((5, 9)).astype(np.float16).astype(np.float32)
    excess[:, -1] = excess[:, 0]
    image, layout = atlas.pack(replace(random_bake(), excess_albedo=excess))
    assert layout.strip_rows == atlas.STRIP_ROWS + 7
    block = image[atlas.STRIP_ROWS : layout.strip_rows, :11, 1]
    np.testing.assert_array_equal(block[1:-1, 1:-1], excess)
    np.testing.assert_array_equal(block[1:-1, 0], excess[:, -2])
    np.testing.assert_array_equal(block[1:-1, -1], excess[:, 1])
    np.testing.assert_array_equal(block[[0, -1]], block[[2, -3]])


@pytest.mark.parametrize(("terms", "resolution"), [(2, RESOLUTION_MIN), (5, RESOLUTION_MIN), (2, 500), (2, 1024)])
def test_the_strip_fits_under_the_smallest_real_tables(terms, resolution):
    """A shallow relief under a short coherence has two tiles of 64 texels, and 512 samples of w all the same."""
    table = random_bake(terms, resolution, ZERO_ORDER_SAMPLES)
    again = atlas.unpack(*atlas.pack(table))
    np.testing.assert_allclose(again.zero_order, table.zero_order, rtol=1e-3, atol=1e-6)


# Files


def test_a_file_comes_back(written):
    table, path = written
    again, record = atlas_file.read(path)
    image, layout = atlas.pack(table)
    expected = atlas.unpack(image, layout)
    np.testing.assert_array_equal(again.terms, expected.terms)
    np.testing.assert_array_equal(again.zero_order, expected.zero_order)
    assert {key: record[key] for key in PROVENANCE} == PROVENANCE
    assert record["format"] == atlas_file.FORMAT


def test_the_header_tells_the_layout_without_the_pixels(written):
    table, path = written
    layout, record = read_header(path)
    assert layout == atlas.layout_of(table)
    assert atlas.Layout(**record["layout"]) == layout


def test_the_file_is_a_plain_half_float_picture(written):
    """What any reader of EXR sees: R, G, B of half floats, row 0 at the top, our attribute in JSON."""
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
    atlas_file.write(path, *atlas.pack(other), PROVENANCE)
    assert np.abs(atlas_file.read(path)[0].terms - other.terms).max() < 1e-3
    assert os.listdir(path.parent) == ["table.exr"]


@pytest.mark.parametrize("fault", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_an_interrupted_write_leaves_nothing(tmp_path, monkeypatch, fault):
    def fail(*_):
        raise fault

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(type(fault)):
        atlas_file.write(tmp_path / "table.exr", *atlas.pack(random_bake()), PROVENANCE)
    assert os.listdir(tmp_path) == []


def test_an_interrupted_write_keeps_the_older_bake(written, monkeypatch):
    _, path = written
    before = path.read_bytes()

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError):
        atlas_file.write(path, *atlas.pack(random_bake(seed=1)), PROVENANCE)
    assert path.read_bytes() == before
    assert os.listdir(path.parent) == ["table.exr"]


def test_a_place_that_cannot_be_written_is_told(tmp_path):
    """As of a read-only folder or a full disc: OpenEXR raises a RuntimeError, which nobody up there waits for."""
    with pytest.raises((OSError, GratingError)):
        atlas_file.write(tmp_path / "not there" / "table.exr", *atlas.pack(random_bake()), PROVENANCE)


# What is no bake


def refused(path):
    """The one line of each reader's failure, which names file, fault and remedy."""
    lines = set()
    for read in (atlas_file.read, read_header):
        with pytest.raises(GratingError) as caught:
            read(path)
        lines.add(str(caught.value))
    (line,) = lines
    assert line.startswith(f"{path}: ") and "; " in line and "\n" not in line
    return line


def plain_exr(path, image, header=None):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **(header or {})}
    with OpenEXR.File(header, {"RGB": np.ascontiguousarray(image)}) as file:
        file.write(str(path))


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
    "no JSON", "[]", "null", "3", "{}", '{"format": 6}', '{"format": 6, "layout": {}}', '{"format": 6, "layout": 6}',
    '{"format": 6, "layout": {"terms": 3, "surplus": 4}}',
])  # fmt: skip
def test_a_header_that_says_nothing_is_refused(tmp_path, record):
    path = tmp_path / "table.exr"
    plain_exr(path, np.zeros((4, 4, 3), np.float16), {HEADER_KEY: record})
    assert "not a Natural Gratings bake" in refused(path)


def test_another_version_is_refused(tmp_path):
    path = tmp_path / "table.exr"
    plain_exr(path, np.zeros((4, 4, 3), np.float16), {HEADER_KEY: '{"format": 99}'})
    assert "format 99" in refused(path)


@pytest.mark.parametrize("lie", [
    {"terms": 10**4}, {"terms": 7}, {"terms": -1}, {"tile_rows": 13}, {"columns": 10**6}, {"rows": 1},
    {"w_max": 0.0}, {"u_first": 9.0}, {"strip_rows": 0}, {"zero_order_samples": 10**4}, {"tile_columns": "12"},
    {"tile_columns": 12.5}, {"scale": "big"}, {"texel": None}, {"levels": 2}, {"levels": 10**9},
    {"inner_rows": 10**6}, {"inner_columns": 3}, {"bound_rows": 1}, {"bound_columns": 10**6}, {"columns": 5, "rows": 1},
])  # fmt: skip
def test_a_header_that_lies_about_its_picture_is_refused(tmp_path, lie):
    """Sizes are checked against the picture's before they are used (DESIGN 9); the reader of the header alone, which
    has no picture, may believe them. Of 5 tiles in a block of 3 x 2 there is no seventh."""
    image, layout = atlas.pack(random_bake())
    path = tmp_path / "table.exr"
    lying = {"format": atlas_file.FORMAT, "layout": {**vars(layout), **lie}}
    plain_exr(path, image[::-1], {HEADER_KEY: json.dumps(lying)})
    with pytest.raises(GratingError) as caught:
        atlas_file.read(path)
    assert str(caught.value).startswith(f"{path}: ") and "; " in str(caught.value)


@settings(deadline=None, max_examples=60)
@given(st.floats(0.01, 0.99))
def test_a_truncated_file_is_refused(tmp_path_factory, share):
    path = tmp_path_factory.getbasetemp() / "truncated.exr"
    atlas_file.write(path, *atlas.pack(random_bake(terms=6, resolution=16)), PROVENANCE)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(GratingError) as caught:
        atlas_file.read(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)


def test_a_picture_of_other_channels_is_refused(tmp_path):
    path = tmp_path / "table.exr"
    image, layout = atlas.pack(random_bake())
    record = json.dumps({"format": atlas_file.FORMAT, "layout": vars(layout)})
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, HEADER_KEY: record}
    with OpenEXR.File(header, {"Y": np.ascontiguousarray(image[..., 0])}) as file:
        file.write(str(path))
    with pytest.raises(GratingError, match="^.*table.exr: "):
        atlas_file.read(path)

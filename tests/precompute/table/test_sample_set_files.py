# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of sample sets: a round trip, refusals of other files, and the files of a bake."""

import json
import os
from dataclasses import asdict, replace

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from precompute.bake.sample_draws import make_sample_set
from precompute.base.failure import GratingError
from precompute.cli import parser
from precompute.cli.arguments import existing_bake
from precompute.table import atlas, sample_set
from precompute.table.atlas import HEADER_KEY, write_together
from precompute.table.sample_set import SampleSet, SampleSetLayout, path_beside, read_header
from precompute.table.table import Table

from .conftest import PROVENANCE, S_MAX, S_SEEN, SIGMA_B, plain_exr, refusal


@pytest.fixture
def written(scan, tmp_path):
    found = make_sample_set([scan[0]], SIGMA_B, size=16)
    path = tmp_path / "table.lobes.exr"
    atlas.write_together({path: sample_set.pack(found)}, PROVENANCE)
    return found, path


def test_a_file_comes_back(written):
    """q to a millionth of u at 550 nm, and a weight to the rounding of its four coefficients, 2^-11 each."""
    found, path = written
    again, record = sample_set.read(path)
    assert np.abs(again.q - found.q).max() * 550e-9 < 1e-6
    size = np.abs(found.pieces).sum(axis=-1).max(axis=0)
    for s in S_SEEN:
        assert (np.abs(again.weights(s) - found.weights(s)) <= size * 2.0**-11 * 1.01).all()
    assert (again.s_max, again.sigma_b) == (pytest.approx(found.s_max), found.sigma_b)
    assert again.blur_q == pytest.approx(found.blur_q)
    assert {key: record[key] for key in PROVENANCE} == PROVENANCE
    assert record["format"] == atlas.FORMAT
    assert os.listdir(path.parent) == [path.name]


def test_the_picture_is_what_the_docstring_says(written):
    """Half floats, RGBA, row 0 at the top of the file. One weight is computed by hand, as a node group reads it."""
    found, path = written
    pixels = OpenEXR.File(str(path)).channels()["RGBA"].pixels
    assert pixels.dtype == np.float16
    layout, record = read_header(path)
    assert layout == SampleSetLayout(**record["layout"]) == sample_set.layout_of(found)
    image, x, y, w, lam = pixels[::-1].astype(float), 5, 9, 1.3, 610e-9
    at = layout.pieces * w * layout.wavelength / lam / layout.s_last
    piece = min(int(at), layout.pieces - 1)
    t = 2 * (at - piece) - 1
    tile = 1 + piece
    left, low = layout.size * (tile % layout.columns), layout.size * (tile // layout.columns)
    by_hand = layout.scale * image[low + y, left + x] @ t ** np.arange(4) * layout.wavelength**2
    assert by_hand == pytest.approx(found.weights(w / lam)[y, x], rel=2e-3)
    r, g, b, a = image[y, x]
    np.testing.assert_allclose([r + b, g + a], found.q[y, x] * 550e-9, atol=1e-6)


def test_it_may_lie_beside_an_atlas_of_single_floats(scan, tmp_path):
    """Both files hold the same record, which has the atlas's precision. A sample set always has half floats."""
    path = tmp_path / "table.lobes.exr"
    found = make_sample_set([scan[0]], SIGMA_B, size=16)
    atlas.write_together({path: sample_set.pack(found)}, PROVENANCE | {"precision": "float32"})
    assert sample_set.read_sound_header(path)[1]["precision"] == "float32"


@pytest.mark.parametrize(
    ("size", "pieces", "columns"), [(256, 2, 1), (256, 31, 1), (256, 32, 2), (1, 1, 1), (64, 5, 1)]
)
def test_tiles_do_not_overlap(size, pieces, columns):
    empty = SampleSet(np.zeros((size, size, 2)), np.zeros((pieces, size, size, 4), np.float32), S_MAX, SIGMA_B, 0.0)
    layout = sample_set.layout_of(empty)
    assert layout.is_valid and layout.columns == columns and layout.height <= 8192
    taken = np.zeros((layout.height, layout.width), int)
    for k in range(1 + pieces):
        taken[layout.tile(k)] += 1
    assert taken.max() == 1 and taken.sum() == (1 + pieces) * size**2


@pytest.mark.parametrize("decades", [-12, 0, 12])
def test_no_depth_leaves_the_half_floats(written, decades):
    found, _ = written
    scaled = replace(found, pieces=(found.pieces * 10.0**decades).astype(np.float32))
    image, layout = sample_set.pack(scaled)
    assert np.isfinite(image).all()
    np.testing.assert_allclose(
        sample_set.unpack(image, layout).weights(3e6), scaled.weights(3e6), atol=2e-3 * np.abs(scaled.pieces).max()
    )


def test_neither_file_is_written_without_the_other(written):
    found, path = written
    before = path.read_bytes()
    pictures = {path: sample_set.pack(found), path.parent / "not there" / "table.exr": sample_set.pack(found)}
    with pytest.raises(GratingError, match="not there.*cannot be written"):
        write_together(pictures, {"source": "another"})
    assert path.read_bytes() == before
    assert os.listdir(path.parent) == [path.name]


def refused(path):
    return refusal(path, sample_set.read, read_header)


def test_what_is_no_sample_set_is_refused(written, tmp_path):
    path = tmp_path / "other.lobes.exr"
    assert "no such file" in refused(path)
    path.write_bytes(b"")
    assert "not a readable OpenEXR" in refused(path)
    current = {"format": atlas.FORMAT}
    for record in ([], {}, current, {**current, "layout": {"size": 16}}):
        plain_exr(path, np.zeros((4, 4, 4), np.float16), {HEADER_KEY: json.dumps(record)})
        assert "not a Natural Gratings sample set" in refused(path)
    plain_exr(path, np.zeros((4, 4, 4), np.float16), {HEADER_KEY: '{"format": 99}'})
    assert "format 99" in refused(path)


def test_a_table_is_no_sample_set_nor_the_other_way(written, tmp_path):
    _, path = written
    table = path_beside(tmp_path / "small.exr").with_name("small.exr")
    bake = Table(np.ones((2, 16, 16, 3), np.float32), np.ones((20, 3)), 0.04, 0.3, "D65")
    atlas.write_together({table: atlas.pack(bake)}, PROVENANCE)
    assert "give the .lobes.exr" in refused(table)
    with pytest.raises(GratingError, match="not a Natural Gratings bake"):
        atlas.read(path)


@pytest.mark.parametrize("lie", [
    {"size": 32}, {"size": 10**6}, {"size": 0}, {"size": "16"}, {"pieces": 10**4}, {"pieces": -1}, {"columns": 10**6},
    {"rows": 1}, {"rows": 10**9}, {"wavelength": 0.0}, {"s_last": float("nan")}, {"scale": None}, {"blur": -1.0},
    {"pieces": True}, {"wavelength": 1.0}, {"sigma_b": 0}, {"blur": 10**300}, {"size": 2**53 - 1}, {"scale": 1e300},
])  # fmt: skip
def test_a_header_that_lies_is_refused(written, tmp_path, lie):
    image, layout = sample_set.pack(written[0])
    path = tmp_path / "lie.lobes.exr"
    record = json.dumps({"format": atlas.FORMAT, "layout": {**asdict(layout), **lie}})
    plain_exr(path, image[::-1], {HEADER_KEY: record})
    with pytest.raises(GratingError) as caught:
        sample_set.read(path)
    assert str(caught.value).startswith(f"{path}: ") and "; " in str(caught.value)


@pytest.mark.parametrize("share", np.linspace(0.02, 0.98, 25))
def test_a_truncated_file_is_refused(written, share):
    _, path = written
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(GratingError) as caught:
        sample_set.read(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)


@pytest.fixture
def picture(tmp_path):
    x = np.arange(24) / 24
    grey = 127 + 90 * np.sin(6 * np.pi * x + np.sin(2 * np.pi * x[:, None]))
    (tmp_path / "scans").mkdir()
    Image.fromarray(grey.astype(np.uint8)).save(tmp_path / "scans" / "skin.png")
    return tmp_path / "scans" / "skin.png"


@pytest.mark.night("test_a_mirror_bakes_both")
def test_a_bake_writes_both(picture, tmp_path, capsys):
    """In a new bake, in one from the cache, and in one that replaces files."""
    folder = tmp_path / "bakes"
    options = ("--size-um", "2", "--height-nm", "60", "--coherence-um", "2", "--delta-e", "5")
    for more in ((), (), ("--no-cache",)):
        assert parser.main(["bake", str(picture), "-o", str(folder), *options, *more, "--json", "-"]) == 0
        facts = json.loads(capsys.readouterr().out)
        assert facts["files"] == [str(folder / "skin.exr"), str(folder / "skin.lobes.exr")]
        assert sorted(os.listdir(folder)) == ["skin.exr", "skin.lobes.exr"]
        found, record = sample_set.read(folder / "skin.lobes.exr")
        table, of_table = atlas.read(folder / "skin.exr")
        assert found.sigma_b == table.sigma_b and found.weights(3e6).mean() > 0
        assert {**record, "layout": None} == {**of_table, "layout": None}
    assert existing_bake(str(folder)) == folder / "skin.exr"
    assert parser.main(["map", str(folder), "-o", str(tmp_path / "map.png"), "--size", "16"]) == 0


def test_a_scan_may_be_called_lobes(tmp_path):
    for name in ("skin.lobes.exr", "skin.lobes.lobes.exr"):
        (tmp_path / name).write_bytes(b"")
    assert existing_bake(str(tmp_path)) == tmp_path / "skin.lobes.exr"


def test_a_mirror_bakes_both(tmp_path):
    Image.fromarray(np.zeros((16, 16), np.uint8)).save(tmp_path / "mirror.png")
    line = ["bake", tmp_path / "mirror.png", "--size-um", "2", "--height-nm", "100", "-o", tmp_path / "bakes"]
    assert parser.main([str(each) for each in line]) == 0
    assert sample_set.read(tmp_path / "bakes" / "mirror.lobes.exr")[0].q.shape == (1, 1, 2)

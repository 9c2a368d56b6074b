# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample set of the Lobes material: what is drawn, what it weighs, and its file."""

import json
import os
from dataclasses import asdict, replace

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from precompute.bake.draws import INTERPOLATION, Q_MAX, densities, make_sample_set, sobol_points, z_curve
from precompute.bake.ensemble import plan
from precompute.base.failure import GratingError
from precompute.cli import parser
from precompute.cli.arguments import existing_bake
from precompute.maths import chebyshev
from precompute.spectra.fast import fast_series
from precompute.surface.height_map import HeightMap
from precompute.surface.readers.registry import read_height_map
from precompute.surface.relief import prepare
from precompute.surface.samples.gratings import blazed
from precompute.table import atlas, atlas_file, sample_set
from precompute.table.atlas_file import HEADER_KEY, write_together
from precompute.table.sample_set import SampleSet, SampleSetLayout, path_beside, read_header
from precompute.table.table import Table

S_MAX, GRID_MAX = 2 / 380e-9, 5.6e6
# Where light is looked at: w from 0.4 to 2, 700 to 400 nm.
S_SEEN = np.linspace(0.4 / 700e-9, 2 / 400e-9, 9)
SIGMA_B = 0.02
PROVENANCE = {"source": "sample:test", "coherence_um": 12.5, "delta_e": {"p99": 0.7}}


def skin(count=200, scale=40e-9, seed=0):
    """A scan of Gaussian bumps of 300 nm, `scale` rms, pixels of 60 nm."""
    rng = np.random.default_rng(seed)
    q = np.fft.fftfreq(count, 60e-9)
    spectrum = np.fft.fft2(rng.standard_normal((count, count)))
    smooth = np.fft.ifft2(spectrum * np.exp(-(q[:, None] ** 2 + q**2) * (np.pi * 300e-9) ** 2)).real
    return prepare(HeightMap(scale * smooth / smooth.std(), (60e-9, 60e-9), "skin"))


def series_of(relief, finest_kernel=SIGMA_B / 780e-9, tolerance=2e-4):
    return fast_series(relief, GRID_MAX, S_MAX, finest_kernel=finest_kernel, tolerance=tolerance)


@pytest.fixture(scope="module")
def scan():
    """The series of a scan, a set whose pieces are sharp, and the indices (N, N) of its texels' bins."""
    series = series_of(skin())
    found = make_sample_set([series], SIGMA_B, tolerance=1e-5)
    return series, found, bins_of(found, series)


@pytest.fixture(scope="module")
def samples():
    """Kernel, series and set of three samples, as they are baked."""
    chosen = {name: plan(prepare(read_height_map(f"sample:{name}"))) for name in ("blazed", "elaphe", "cd")}
    return {
        name: (one.sigma_b, one.ensemble[0], make_sample_set(one.ensemble, one.sigma_b)) for name, one in chosen.items()
    }


def bins_of(found, series):
    """Indices (row, column), each (N, N), of the bins that hold the texels; every texel lies on one."""
    sides = ((series.grid.q_y, found.q[..., 1]), (series.grid.q_x, found.q[..., 0]))
    index = tuple(np.minimum(np.searchsorted(axis, q), len(axis) - 1) for axis, q in sides)
    for (axis, q), at in zip(sides, index, strict=True):
        np.testing.assert_array_equal(axis[at], q)
    return index


def power_over_s2(series, s):
    """The series' scattered power over s^2 (ny, nx) in float64, of bins that real directions reach."""
    inside = series.grid.q_y[:, None] ** 2 + series.grid.q_x**2 <= Q_MAX**2
    return np.tensordot(series.weights(np.array(s)), series.scattered_over_s2.astype(float), axes=1) * inside


def within_three_errors(values, exact):
    """A mean over texels against an integral: three standard errors of as many independent draws, which stratified
    ones keep to with room to spare."""
    return abs(values.mean() - exact) <= 3 * values.std() / np.sqrt(values.size)


# What the set integrates


@pytest.mark.parametrize("s", S_SEEN)
def test_the_set_integrates_the_spectrum(scan, s):
    """Total light, and first and second moments of q."""
    series, found, _ = scan
    weights, power = found.weights(s), power_over_s2(series, s)
    assert within_three_errors(weights, power.sum())
    q_x, q_y = found.q[..., 0] / Q_MAX, found.q[..., 1] / Q_MAX
    x, y = series.grid.q_x / Q_MAX, series.grid.q_y[:, None] / Q_MAX
    for of_texels, of_bins in ((q_x, x), (q_y, y), (q_x**2, x**2), (q_y**2, y**2), (q_x * q_y, x * y)):
        assert within_three_errors(weights * of_texels, (power * of_bins).sum())


@pytest.mark.parametrize("name", ["blazed", "elaphe", "cd"])
def test_samples_keep_their_light(samples, name):
    """As written: three standard errors, and what the pieces may misplace."""
    _, series, found = samples[name]
    for s in S_SEEN:
        weights, exact = found.weights(s), power_over_s2(series, s).sum()
        error = 3 * weights.std() / np.sqrt(weights.size) + INTERPOLATION * exact
        assert abs(weights.mean() - exact) <= error


def test_texels_follow_the_pdf(scan):
    """Counts in 24 x 24 blocks of bins, at most three standard errors of independent draws off (and one texel)."""
    series, found, (row, column) = scan
    (pdf,) = densities([series])
    assert pdf.sum(dtype=float) == pytest.approx(1)
    edges = [np.linspace(0, count, 25).astype(int) for count in pdf.shape]
    counts, _, _ = np.histogram2d(row.ravel(), column.ravel(), edges)
    expected = np.add.reduceat(np.add.reduceat(pdf.astype(float), edges[0][:-1], 0), edges[1][:-1], 1) * row.size
    assert counts.sum() == row.size
    assert (np.abs(counts - expected) <= 3 * np.sqrt(expected) + 1).all()


@pytest.mark.parametrize("side", [16, 64])
def test_every_block_is_a_set_of_its_own(scan, side):
    """Each aligned block holds the light to three standard errors of its own number of texels."""
    series, found, _ = scan
    weights, exact = found.weights(S_SEEN[4]), power_over_s2(series, S_SEEN[4]).sum()
    blocks = weights.reshape(256 // side, side, -1, side).swapaxes(1, 2).reshape(-1, side * side)
    assert np.abs(blocks.mean(axis=1) - exact).max() <= 3 * weights.std() / side


@pytest.mark.parametrize("count", [1, 4, 64, 1024])
def test_sobol_points_are_a_net(count):
    """One point in each cell of every grid of `count` equal cells, whichever run of points."""
    points = sobol_points(4 * count).reshape(4, count, 2)
    for run in points:
        rows = 1
        while rows <= count:
            cells = np.floor(run[:, 0] * rows) * (count // rows) + np.floor(run[:, 1] * (count // rows))
            assert len(np.unique(cells)) == count
            rows *= 2


def test_the_z_curve_fills_aligned_blocks_in_turn():
    order = z_curve(8)
    assert sorted(order.ravel()) == list(range(64))
    assert order[:2, :2].tolist() == [[0, 1], [2, 3]]
    for block in (2, 4):
        tiles = order.reshape(8 // block, block, -1, block).swapaxes(1, 2).reshape(-1, block * block)
        assert (np.ptp(tiles, axis=1) == block * block - 1).all()


# What a texel weighs


@pytest.mark.parametrize("name", ["blazed", "elaphe", "cd"])
def test_weights_are_spread_little(samples, name):
    """DESIGN 3 asks for 2 to 11 times the mean; measured here, 4 at most. At a node, no texel may weigh more than the
    mean times the number of nodes (and what the pieces misplace)."""
    _, series, found = samples[name]
    for s in S_SEEN:
        weights = found.weights(s)
        assert weights.max() <= 4.5 * weights.mean()
        assert weights.min() >= -0.2 * weights.mean()
    nodes = chebyshev.nodes(len(series.amplitude), 0, series.s_max)
    for s in nodes:
        weights = found.weights(s)
        assert weights.max() <= (len(nodes) + 0.2) * weights.mean()


def test_a_pdf_of_one_s_would_spread_them(scan):
    """What the mean over s is for."""
    series, found, at = scan
    power = np.maximum(power_over_s2(series, S_SEEN[4]), 0)
    ratio = power_over_s2(series, S_SEEN[0])[at] / np.maximum(power[at], 1e-9 * power.max())
    alone = ratio.max() / (power_over_s2(series, S_SEEN[0]).sum() / power.sum())
    weights = found.weights(S_SEEN[0])
    assert alone > 3 * weights.max() / weights.mean()


@pytest.mark.parametrize("scale", [1e-9, 40e-9, 400e-9])
def test_pieces_misplace_one_percent(scale):
    """Of the light at any s, against the series itself; the pieces are chosen on a block of the texels, so the whole
    may miss by a little. The last relief is over 2 um deep."""
    series = series_of(skin(scale=scale))
    found = make_sample_set([series], SIGMA_B, size=64)
    (pdf,) = densities([series])
    at = bins_of(found, series)
    for s in np.linspace(0, S_MAX, 97):
        exact = power_over_s2(series, s)[at] / pdf[at]
        assert np.abs(found.weights(s) - exact).sum() <= 1.1 * INTERPOLATION * np.abs(exact).sum()
    if scale == 400e-9:
        assert skin(scale=scale).height_range_m > 2e-6 and len(found.pieces) > 4
    else:
        assert len(found.pieces) <= 2


def test_orders_stay_where_they_are(samples):
    """m / period, through the file as well: a millionth in u at 550 nm; and as many texels as the pdf says."""
    _, series, found = samples["blazed"]
    order = found.q[..., 0] * blazed.__defaults__[0]
    assert np.abs(order - np.rint(order)).max() < 1e-9
    assert not found.q[..., 1].any()
    stored = sample_set.unpack(*sample_set.pack(found))
    assert np.abs(stored.q - found.q).max() * 550e-9 < 1e-6
    (pdf,) = densities([series])
    _, column = bins_of(found, series)
    counts = np.bincount(column.ravel(), minlength=pdf.shape[1])
    assert np.abs(counts - pdf.sum(axis=0) * column.size).max() <= 2


# Several scans, thinned bins, nothing


def test_several_scans_are_averaged():
    """Of unlike sizes, depths and numbers of nodes."""
    ensemble = [series_of(skin(200, 20e-9, 1)), series_of(skin(160, 90e-9, 2))]
    assert len(ensemble[0].amplitude) != len(ensemble[1].amplitude)
    found = make_sample_set(ensemble, SIGMA_B, tolerance=1e-5)
    assert sum(pdf.sum(dtype=float) for pdf in densities(ensemble)) == pytest.approx(1)
    for s in S_SEEN:
        exact = np.mean([power_over_s2(series, s).sum() for series in ensemble])
        assert within_three_errors(found.weights(s), exact)


def test_a_flat_scan_among_others_halves_the_light():
    ensemble = [series_of(skin(96)), series_of(prepare(HeightMap(np.zeros((96, 96)), (60e-9, 60e-9), "flat")))]
    alone, both = (make_sample_set(part, SIGMA_B, 64) for part in (ensemble[:1], ensemble))
    assert both.weights(3e6).mean() == pytest.approx(alone.weights(3e6).mean() / 2, rel=0.02)


def test_scans_of_unlike_blur_are_jittered_alike():
    """The less blurred one's texels leave their bins by a Gaussian of what it lacks."""
    sharp = series_of(skin(96))
    blurred = replace(sharp, blur_q=8e3)
    assert make_sample_set([blurred], SIGMA_B, 64).blur_q == 8e3
    found = make_sample_set([sharp, blurred], SIGMA_B)
    assert found.blur_q == 8e3
    spacing = sharp.grid.q_x[1] - sharp.grid.q_x[0]
    off = (found.q + 0.5 * spacing) % spacing - 0.5 * spacing
    moved = np.abs(off).max(axis=-1) > 1e-6 * spacing
    assert moved.mean() == pytest.approx(0.5, abs=0.01)
    assert off[moved].std() == pytest.approx(8e3, rel=0.03)


def test_a_flat_surface_has_an_empty_set():
    series = series_of(prepare(HeightMap(np.zeros((32, 32)), (60e-9, 60e-9), "flat")))
    assert densities([series]) is None
    found = make_sample_set([series], SIGMA_B)
    stored = sample_set.unpack(*sample_set.pack(found))
    for each in (found, stored):
        assert each.q.shape == (1, 1, 2)
        assert not each.weights(3e6).any()


def test_a_set_is_made_the_same_again(scan):
    again = make_sample_set([scan[0]], SIGMA_B, tolerance=1e-5)
    np.testing.assert_array_equal(again.q, scan[1].q)
    np.testing.assert_array_equal(again.pieces, scan[1].pieces)


# Files


@pytest.fixture
def written(scan, tmp_path):
    """A small set and its file."""
    found = make_sample_set([scan[0]], SIGMA_B, size=16)
    path = tmp_path / "table.lobes.exr"
    atlas_file.write(path, *sample_set.pack(found), PROVENANCE)
    return found, path


def test_a_file_comes_back(written):
    """q to a millionth in u, a weight to the rounding of its four coefficients (2^-11 each)."""
    found, path = written
    again, record = sample_set.read(path)
    assert np.abs(again.q - found.q).max() * 550e-9 < 1e-6
    size = np.abs(found.pieces).sum(axis=-1).max(axis=0)
    for s in S_SEEN:
        assert (np.abs(again.weights(s) - found.weights(s)) <= size * 2.0**-11 * 1.01).all()
    assert (again.s_max, again.sigma_b) == (pytest.approx(found.s_max), found.sigma_b)
    assert again.blur_q == pytest.approx(found.blur_q)
    assert {key: record[key] for key in PROVENANCE} == PROVENANCE
    assert record["format"] == atlas_file.FORMAT
    assert os.listdir(path.parent) == [path.name]


def test_the_picture_is_what_the_docstring_says(written):
    """Half floats, RGBA, row 0 at the top of the file; a weight by hand as a node group reads it."""
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


def test_neither_file_is_written_without_the_other(written, monkeypatch):
    """A table and its set: one is whole, the other cannot be written."""
    found, path = written
    before = path.read_bytes()
    pictures = {path: sample_set.pack(found), path.parent / "not there" / "table.exr": sample_set.pack(found)}
    with pytest.raises((OSError, GratingError)):
        write_together(pictures, {"source": "another"})
    assert path.read_bytes() == before
    assert os.listdir(path.parent) == [path.name]


def test_temporary_names_are_found_by_who_cancels(written, monkeypatch):
    """BakeJob.cancel removes what its process was at, by this pattern."""
    found, path = written
    seen = []
    monkeypatch.setattr(os, "replace", lambda source, _: seen.append(source))
    write_together({path: sample_set.pack(found), path.with_name("table.exr"): sample_set.pack(found)}, PROVENANCE)
    assert len(set(seen)) == 2
    assert all(name.match(f".*.{os.getpid()}.partial*") for name in seen)


def refused(path):
    lines = set()
    for read in (sample_set.read, read_header):
        with pytest.raises(GratingError) as caught:
            read(path)
        lines.add(str(caught.value))
    (line,) = lines
    assert line.startswith(f"{path}: ") and "; " in line and "\n" not in line
    return line


def plain_exr(path, image, record):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, HEADER_KEY: record}
    with OpenEXR.File(header, {"RGBA": np.ascontiguousarray(image)}) as file:
        file.write(str(path))


def test_what_is_no_sample_set_is_refused(written, tmp_path):
    path = tmp_path / "other.lobes.exr"
    assert "no such file" in refused(path)
    path.write_bytes(b"")
    assert "not a readable OpenEXR" in refused(path)
    for record in ("no JSON", "[]", "{}", '{"format": 6}', '{"format": 6, "layout": {"size": 16}}'):
        plain_exr(path, np.zeros((4, 4, 4), np.float16), record)
        assert "not a Natural Gratings sample set" in refused(path)
    plain_exr(path, np.zeros((4, 4, 4), np.float16), '{"format": 99}')
    assert "format 99" in refused(path)


def test_a_table_is_no_sample_set_nor_the_other_way(written, tmp_path):
    _, path = written
    table = path_beside(tmp_path / "small.exr").with_name("small.exr")
    bake = Table(np.ones((2, 16, 16, 3), np.float32), np.ones((20, 3)), 0.04, 0.3, "D65")
    atlas_file.write(table, *atlas.pack(bake), PROVENANCE)
    assert "give the .lobes.exr" in refused(table)
    with pytest.raises(GratingError, match="not a Natural Gratings bake"):
        atlas_file.read(path)


@pytest.mark.parametrize("lie", [
    {"size": 32}, {"size": 10**6}, {"size": 0}, {"size": "16"}, {"pieces": 10**4}, {"pieces": -1}, {"columns": 10**6},
    {"rows": 1}, {"rows": 10**9}, {"wavelength": 0.0}, {"s_last": float("nan")}, {"scale": None}, {"blur": -1.0},
])  # fmt: skip
def test_a_header_that_lies_is_refused(written, tmp_path, lie):
    image, layout = sample_set.pack(written[0])
    path = tmp_path / "lie.lobes.exr"
    plain_exr(path, image[::-1], json.dumps({"format": atlas_file.FORMAT, "layout": {**asdict(layout), **lie}}))
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


# In the bake's folder


@pytest.fixture
def picture(tmp_path):
    x = np.arange(24) / 24
    grey = 127 + 90 * np.sin(6 * np.pi * x + np.sin(2 * np.pi * x[:, None]))
    (tmp_path / "scans").mkdir()
    Image.fromarray(grey.astype(np.uint8)).save(tmp_path / "scans" / "skin.png")
    return tmp_path / "scans" / "skin.png"


def test_a_bake_writes_both(picture, tmp_path, capsys):
    """Baked, taken from the cache, and baked over what is there."""
    folder = tmp_path / "bakes"
    options = ("--size-um", "2", "--height-nm", "60", "--coherence-um", "2", "--delta-e", "5")
    for more in ((), (), ("--no-cache",)):
        assert parser.main(["bake", str(picture), "-o", str(folder), *options, *more, "--json", "-"]) == 0
        facts = json.loads(capsys.readouterr().out)
        assert facts["files"] == [str(folder / "skin.exr"), str(folder / "skin.lobes.exr")]
        assert sorted(os.listdir(folder)) == ["skin.exr", "skin.lobes.exr"]
        found, record = sample_set.read(folder / "skin.lobes.exr")
        table, of_table = atlas_file.read(folder / "skin.exr")
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

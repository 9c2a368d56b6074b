# SPDX-License-Identifier: GPL-3.0-or-later
"""Sample sets: which frequencies are drawn, and their weights."""

from dataclasses import replace

import numpy as np
import pytest

from precompute.bake.ensemble import plan
from precompute.bake.sample_draws import INTERPOLATION, Q_MAX, densities, make_sample_set, sobol_points, z_curve
from precompute.maths import chebyshev
from precompute.surface.height_map import HeightMap
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed
from precompute.table import sample_set

from .conftest import S_MAX, S_SEEN, SIGMA_B, bins_of, series_of, skin


@pytest.fixture(scope="module")
def samples():
    """Kernel, series and sample set of three samples, as they are baked."""
    chosen = {name: plan(prepare(read_height_map(f"sample:{name}"))) for name in ("blazed", "elaphe", "cd")}
    return {
        name: (one.sigma_b, one.ensemble[0], make_sample_set(one.ensemble, one.sigma_b)) for name, one in chosen.items()
    }


def power_over_s2(series, s):
    """The series' scattered power over s^2, (ny, nx) in float64, in bins that real directions reach; 0 in others."""
    inside = series.grid.q_y[:, None] ** 2 + series.grid.q_x**2 <= Q_MAX**2
    return np.tensordot(series.weights(np.array(s)), series.scattered_over_s2.astype(float), axes=1) * inside


def within_three_errors(values, exact):
    """Whether the mean over texels is the integral, to three standard errors of as many independent draws. Stratified
    draws stay well below that."""
    return abs(values.mean() - exact) <= 3 * values.std() / np.sqrt(values.size)


@pytest.mark.parametrize("s", S_SEEN)
def test_the_set_integrates_the_spectrum(scan, s):
    """The total light, and the first and second moments of q."""
    series, found, _ = scan
    weights, power = found.weights(s), power_over_s2(series, s)
    assert within_three_errors(weights, power.sum())
    q_x, q_y = found.q[..., 0] / Q_MAX, found.q[..., 1] / Q_MAX
    x, y = series.grid.q_x / Q_MAX, series.grid.q_y[:, None] / Q_MAX
    for of_texels, of_bins in ((q_x, x), (q_y, y), (q_x**2, x**2), (q_y**2, y**2), (q_x * q_y, x * y)):
        assert within_three_errors(weights * of_texels, (power * of_bins).sum())


@pytest.mark.parametrize("name", ["blazed", "elaphe", "cd"])
def test_samples_keep_their_light(samples, name):
    """To three standard errors, plus what the pieces may misplace."""
    _, series, found = samples[name]
    for s in S_SEEN:
        weights, exact = found.weights(s), power_over_s2(series, s).sum()
        error = 3 * weights.std() / np.sqrt(weights.size) + INTERPOLATION * exact
        assert abs(weights.mean() - exact) <= error


def test_texels_follow_the_pdf(scan):
    """Counts in 24 x 24 blocks of bins differ by at most three standard errors of independent draws, plus one texel."""
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
    series, found, _ = scan
    weights, exact = found.weights(S_SEEN[4]), power_over_s2(series, S_SEEN[4]).sum()
    blocks = weights.reshape(256 // side, side, -1, side).swapaxes(1, 2).reshape(-1, side * side)
    assert np.abs(blocks.mean(axis=1) - exact).max() <= 3 * weights.std() / side


@pytest.mark.parametrize("count", [1, 4, 64, 1024])
def test_sobol_points_are_a_net(count):
    """Every run of points has one in each cell of every grid of `count` equal cells."""
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


@pytest.mark.parametrize("name", ["blazed", "elaphe", "cd"])
def test_weights_are_spread_little(samples, name):
    """At s between the nodes, the heaviest texel weighs at most 4.5 times the mean; the measured factor is 4. At a
    node, a texel weighs at most the mean times the number of nodes, plus what the pieces misplace: the density is the
    mean over the nodes (table/sample_set.py)."""
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
    """This is why the density is a mean over s."""
    series, found, at = scan
    power = np.maximum(power_over_s2(series, S_SEEN[4]), 0)
    ratio = power_over_s2(series, S_SEEN[0])[at] / np.maximum(power[at], 1e-9 * power.max())
    alone = ratio.max() / (power_over_s2(series, S_SEEN[0]).sum() / power.sum())
    weights = found.weights(S_SEEN[0])
    assert alone > 3 * weights.max() / weights.mean()


@pytest.mark.parametrize("scale", [1e-9, 40e-9, 400e-9])
def test_pieces_misplace_one_percent(scale):
    """Of the light at any s, against the series itself. The number of pieces is chosen on a block of the texels, so all
    texels together may have a slightly larger error. The last relief is over 2 um deep."""
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
    """At m / period, to a millionth of u at 550 nm, also in the file. The pdf gives each order's number of texels."""
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


def test_several_scans_are_averaged():
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
    """The texels of the less blurred scan leave their bins by a Gaussian that makes up the difference."""
    sharp = series_of(skin(96))
    sharp = replace(sharp, grid=replace(sharp.grid, window_q=(0.0, 0.0)))
    blurred = replace(sharp, blur_q=8e3)
    assert make_sample_set([blurred], SIGMA_B, 64).blur_q == 8e3
    found = make_sample_set([sharp, blurred], SIGMA_B)
    assert found.blur_q == 8e3
    spacing = sharp.grid.q_x[1] - sharp.grid.q_x[0]
    off = (found.q + 0.5 * spacing) % spacing - 0.5 * spacing
    moved = np.abs(off).max(axis=-1) > 1e-6 * spacing
    assert moved.mean() == pytest.approx(0.5, abs=0.01)
    assert off[moved].std() == pytest.approx(8e3, rel=0.03)


def test_the_shorter_sides_window_blurs_both_axes():
    """The frequencies along the longer side are jittered by the difference."""
    sharp = series_of(skin(96))
    found = make_sample_set([replace(sharp, grid=replace(sharp.grid, window_q=(8e3, 0.0)))], SIGMA_B)
    assert found.blur_q == 8e3
    for axis, jitter in enumerate([8e3, 0.0]):
        spacing = (sharp.grid.q_x, sharp.grid.q_y)[axis][1] - (sharp.grid.q_x, sharp.grid.q_y)[axis][0]
        off = (found.q[..., axis] + 0.5 * spacing) % spacing - 0.5 * spacing
        assert off.std() == pytest.approx(jitter, rel=0.03, abs=1e-6 * spacing)


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

# SPDX-License-Identifier: GPL-3.0-or-later
"""The table that `check` reads from a bake's file equals the written one."""

import numpy as np
import pytest

from laboratory.check.table_file import read_table
from precompute.table import atlas
from precompute.table.blur_levels import SPACINGS, Cell, cell_for
from precompute.table.table import Table


@pytest.mark.parametrize("precision", [np.float16, np.float32])
def test_a_table_is_read_as_a_renderer_reads_it(tmp_path, precision):
    rng = np.random.default_rng(0)
    tiles = rng.standard_normal((5, 40, 300, 3)).astype(np.float32)
    table = Table(
        tiles, rng.random((600, 3)), 0.05, 0.008, "E", first=(-0.1, -0.4), w_range=(0.5, 1.9), precision=precision
    )
    path = tmp_path / "table.exr"
    atlas.write_together({path: atlas.pack(table)}, {"model": "ensemble"})
    read, stored = read_table(path), atlas.read(path)[0]
    assert read.region == (pytest.approx((-0.384, 1.976)), pytest.approx((-0.084, 0.196)))
    assert (read.w_range, read.sigma_b, read.illuminant) == ((0.5, 1.9), 0.05, "E")
    u, v = rng.uniform(-0.5, 2.1, 500), rng.uniform(-0.2, 0.4, 500)
    for w in (0.5, 1.234, 1.9):
        expected = stored.scattered_over_w2(u, v, w)
        np.testing.assert_allclose(read.scattered_over_w2(u, v, w), expected, rtol=0, atol=1e-5)
        np.testing.assert_allclose(read.zero_order_xyz(w), stored.zero_order_xyz(w), rtol=1e-6)


@pytest.mark.parametrize(("illuminant", "channels"), [("D65+smooth", 6), ("D65+led", 9), ("D65+smooth+2700K+FL11", 12)])
def test_all_channels_are_read(tmp_path, illuminant, channels):
    """Random numbers in every texel, on two levels."""
    rng, spacing = np.random.default_rng(2), SPACINGS[0]
    cell = Cell((30, 40), 2, spacing, spacing.stretch)
    levels = [
        rng.standard_normal((5, *(count + 4 for count in cell.inner_of(level)), channels)).astype(np.float32)
        for level in range(2)
    ]
    table = Table(
        levels[0], rng.random((50, channels)), 0.05, 0.02, illuminant, precision=np.float32,
        wider=(levels[1],), spacing=spacing, coarser=cell.coarser,
    )  # fmt: skip
    path = tmp_path / "table.exr"
    atlas.write_together({path: atlas.pack(table)}, {"model": "ensemble"})
    read, stored = read_table(path), atlas.read(path)[0]
    u, v = rng.uniform(-0.5, 0.5, 200), rng.uniform(-0.4, 0.4, 200)
    for variance in (0.0, 0.6 * table.sigma_b**2):
        expected = stored.channels_over_w2(u, v, 1.2, variance=variance)
        found = read.channels_over_w2(u, v, 1.2, variance=variance)
        assert found.shape == (200, channels)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5)
        np.testing.assert_array_equal(read.scattered_over_w2(u, v, 1.2, variance=variance), found[:, :3])
    # Single precision.
    np.testing.assert_allclose(read.zero_order, table.zero_order, rtol=2.0**-23)
    np.testing.assert_allclose(read.zero_order_xyz(1.3), stored.zero_order_xyz(1.3), rtol=1e-6)


# All sides and the first and last spacing: the spacings differ in numbers alone.
@pytest.mark.short("spacing0", f"spacing{len(SPACINGS) - 1}-1.4")
@pytest.mark.parametrize("coarser", [1.0, 1.4])
@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("inner", [(30, 200), (57, 23), (200, 201)])
def test_every_level_is_read(tmp_path, spacing, inner, coarser):
    """Tiles of random numbers on every level: a texel from another place would be another number."""
    rng = np.random.default_rng(1)
    cell = cell_for(3, inner, 0.02, spacings=(spacing,), coarser=coarser)
    levels = [
        rng.standard_normal((3, *(count + 4 for count in cell.inner_of(level)), 3)).astype(np.float32)
        for level in range(cell.levels)
    ]
    table = Table(
        levels[0], rng.random((600, 3)), 0.02, 0.01, "E", first=(-0.1, -0.4), precision=np.float32,
        wider=tuple(levels[1:]), spacing=spacing, coarser=cell.coarser,
    )  # fmt: skip
    path = tmp_path / "table.exr"
    atlas.write_together({path: atlas.pack(table)}, {"model": "ensemble"})
    read, stored = read_table(path), atlas.read(path)[0]
    assert len(read.wider) == cell.levels - 1
    u, v = rng.uniform(-0.5, 2.1, 200), rng.uniform(-0.2, 0.4, 200)
    for added in (0, 0.3, spacing.grown(1) - 1, 2.2 * spacing.ratio, 300):
        variance = added * table.sigma_b**2
        expected = stored.scattered_over_w2(u, v, 1.2, variance=variance)
        np.testing.assert_allclose(read.scattered_over_w2(u, v, 1.2, variance=variance), expected, rtol=0, atol=1e-5)

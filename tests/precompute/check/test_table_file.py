# SPDX-License-Identifier: GPL-3.0-or-later
"""The table that `check` reads from a bake's file equals the written one."""

import numpy as np
import pytest

from precompute.check.table_file import read_table
from precompute.table import atlas, atlas_file
from precompute.table.table import Table


@pytest.mark.parametrize("precision", [np.float16, np.float32])
def test_a_table_is_read_as_a_renderer_reads_it(tmp_path, precision):
    rng = np.random.default_rng(0)
    tiles = rng.standard_normal((5, 40, 300, 3)).astype(np.float32)
    table = Table(
        tiles, rng.random((600, 3)), 0.05, 0.008, "E", first=(-0.1, -0.4), w_range=(0.5, 1.9), precision=precision
    )
    path = tmp_path / "table.exr"
    atlas_file.write_together({path: atlas.pack(table)}, {"model": "ensemble"})
    read, stored = read_table(path), atlas_file.read(path)[0]
    assert read.region == (pytest.approx((-0.384, 1.976)), pytest.approx((-0.084, 0.196)))
    assert (read.w_range, read.sigma_b, read.illuminant) == ((0.5, 1.9), 0.05, "E")
    u, v = rng.uniform(-0.5, 2.1, 500), rng.uniform(-0.2, 0.4, 500)
    for w in (0.5, 1.234, 1.9):
        expected = stored.scattered_over_w2(u, v, w)
        np.testing.assert_allclose(read.scattered_over_w2(u, v, w), expected, rtol=0, atol=1e-5)
        np.testing.assert_allclose(read.zero_order_xyz(w), stored.zero_order_xyz(w), rtol=1e-6)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of colour bands, on pictures with known bands."""

import numpy as np
import pytest

from laboratory.benchmarks.bands import components, measure, thickness_of


def test_parts_touch_by_eight_neighbours():
    mask = np.zeros((20, 30), bool)
    mask[2, 3:25] = mask[3:18, 25] = True  # an L whose ends touch at a corner
    mask[10:14, 2:6] = True
    labels = components(mask)
    assert len(np.unique(labels[mask])) == 2 and len(np.unique(labels[10:14, 2:6])) == 1 and not labels[~mask].any()


def test_thickness_of_a_strip_and_a_square():
    mask = np.zeros((40, 60), bool)
    mask[3:6, 5:55] = mask[15:30, 10:25] = True
    found = thickness_of(mask, 100)
    assert (found[3:6, 5:55] == 3).all() and (found[15:30, 10:25] == 15).all() and not found[~mask].any()
    assert thickness_of(mask, 10).max() == 10


def test_bands_over_scales_of_ten_pixels():
    """Twelve by eight scales: a red band 4 pixels thick over ten of them, a white one of 2, a thin blue line."""
    rows, columns = np.indices((80, 120))
    scales = (rows // 10 * 12 + columns // 10 + 1) / 97
    light = np.zeros((80, 120, 3))
    light[12:16, 5:100] = (0.8, 0.1, 0.1)
    light[20:22, 0:120] = 0.9
    light[50, 0:60] = (0.1, 0.1, 0.8)
    facts = measure(light, scales)
    assert facts["scales"] == 96 and facts["scale_px"] == 10
    assert facts["longest"] == [10, 6] and facts["longest_white"] == [12]
    assert facts["thickness"] == pytest.approx(0.4) and facts["thin_share"] == 0
    assert facts["coloured_share"] == pytest.approx((4 * 95 + 60) / 9600)
    # The rows 12 to 15 are 8 to 5 steps from row 20, and the line more than 28.
    assert facts["to_white"] == pytest.approx(0.7, abs=0.1)


def test_dim_light_is_no_band():
    facts = measure(
        np.full((80, 120, 3), 0.05), np.repeat(np.repeat(np.arange(1, 97).reshape(8, 12), 10, 0), 10, 1) / 97
    )
    assert facts["coloured_share"] == facts["white_share"] == 0 and facts["longest"] == []

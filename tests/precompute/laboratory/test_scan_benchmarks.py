# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of repaired scans, on small ones."""

import numpy as np
import pytest

from laboratory.benchmarks import scans, scans_page
from precompute.bake.request import BakeRequest
from precompute.surface.height_map import HeightMap
from precompute.surface.steps.pipeline import KINDS

PIXEL = 80e-9


@pytest.fixture
def dusty():
    """An irregular grating, 10 um wide, with a grain of dust."""
    x = np.arange(128) / 128
    shape = 30e-9 * np.sin(2 * np.pi * (8 * x + 0.1 * np.sin(2 * np.pi * x[:, None])))
    shape[30:36, 90:96] += 400e-9
    return HeightMap(shape, (PIXEL, PIXEL), "dusty")


def test_a_repaired_bake_is_compared_with_the_plain_one(dusty):
    request = BakeRequest(delta_e=6, coherence_length_m=4e-6)
    plain, other = (scans.baked(dusty, steps, request) for steps in ("plane", "plane,dust"))
    same, changed = scans.facts_of(plain, plain), scans.facts_of(plain, other)
    # NumPy rounds a sum by where its terms lie in memory, so a table differs from itself by 1e-13 of a colour of 100.
    assert (same["mean"], same["p99"], same["relative_dy"]) == pytest.approx((0, 0, 0), abs=1e-11)
    assert same["removed"] == 0
    assert changed["p99"] > 1 and changed["relative_dy"] > 0.01
    assert changed["removed"] > 36 / 128**2 and changed["height_range_m"] < 0.5 * same["height_range_m"]
    assert changed["terms"] < same["terms"]
    sheet = scans.picture(plain, other)
    assert sheet.size == (5 * scans.MAP_PIXELS + 4 * 8, scans.MAP_PIXELS)
    red = (np.array(sheet) == (220, 30, 30)).all(axis=-1)
    assert red[:, scans.MAP_PIXELS : 2 * scans.MAP_PIXELS + 8].any() and not red[:, : scans.MAP_PIXELS].any()


def test_the_most_that_was_removed_is_in_the_middle(dusty):
    holes = np.zeros((1000, 800), bool)
    holes[500:510, 300:304] = True
    holes[3, 3] = True
    scan = HeightMap(np.zeros((1000, 800)), (PIXEL, PIXEL), "scan")
    rows, cols = scans.around_most(holes, scan)
    # 13 um are 162 pixels; the middle of the pixels 500 to 509 is 504.5.
    assert rows.stop - rows.start == cols.stop - cols.start == 162
    assert abs((rows.start + rows.stop - 1) / 2 - 504.5) <= 0.5 and abs((cols.start + cols.stop - 1) / 2 - 301.5) <= 0.5


def test_the_page_tells_every_step_and_every_figure():
    row = {
        "steps": "plane", "told": [], "removed": 0.0, "height_range_m": 4e-7, "rms_m": 4e-8, "terms": 9,
        "blender_bytes": 2**25, "own_p99": 0.5, "mean": 0.0, "p99": 0.0, "relative_dy": 0.0,
    }  # fmt: skip
    changed = {"steps": "plane,dust", "told": ["dust:5: 1%"], "removed": 0.01, "terms": 5, "mean": 0.4, "p99": 1.2}
    rows = [row, row | changed | {"relative_dy": 0.03}]
    skins = [{"name": name, "quality": ["quality: good"], "rows": rows} for name in scans_page.TITLES]
    page = scans_page.page(skins, 1.0)
    assert all(f"| `{kind.form.replace('|', ' or ')}` | {kind.help} |" in page for kind in KINDS.values())
    assert "| Elaphe guttata | `plane,dust` | 1.00% | 400 nm, rms 40.0 | 5 | 32 | 0.40 | 1.20 | 3.0% | 0.50 |" in page
    assert "| Elaphe guttata | `plane` | 0.00% | 400 nm, rms 40.0 | 9 | 32 | - | - | - | 0.50 |" in page
    assert page.count("```\nquality: good\n\ndust:5: 1%\n```\n") == 2
    assert max(map(len, page.splitlines())) < 200

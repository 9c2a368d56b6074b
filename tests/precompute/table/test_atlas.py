# SPDX-License-Identifier: GPL-3.0-or-later
"""The atlas: a table packed into one picture and unpacked again."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.bake.resolution import RESOLUTION_MIN
from precompute.table import atlas
from precompute.table.table import ZERO_ORDER_SAMPLES

from .conftest import random_bake

few = settings(deadline=None, max_examples=40)


@few
@given(st.integers(2, 30), st.floats(-12, 12), st.integers(0, 2**32), st.integers(1, 4))
def test_what_is_packed_comes_back(terms, decades, seed, levels):
    """To the rounding of half floats: 2^-11 of a value, and steps of 2^-24 below 2^-14.

    The scale puts the largest value between 4096 and 8192."""
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
    # The scale is a power of two, which loses no digit.
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
    """Every tile of every level lies inside the picture and above the strip, on texels of its own.

    Few places are left empty, since every one takes memory. The picture is not much longer than wide."""
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
    """The formulas by which a material finds a tile from a level that only the shading knows, in floats."""
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
    """The strip is at the bottom, Z first. Row 0 of a tile has the smallest v."""
    table = random_bake(terms=2, resolution=8, samples=16)
    table.terms[:] = 0
    table.terms[1, 0, 3] = 1
    image, layout = atlas.pack(table)
    for row in range(atlas.STRIP_ROWS):
        np.testing.assert_allclose(image[row, :16], table.zero_order, rtol=1e-3)
    x, y = layout.tile_origin(1)
    assert np.argwhere(image[layout.strip_rows :, :, 0]).tolist() == [[y - layout.strip_rows, x + 3]]


def test_the_strip_goes_on_past_its_end():
    """A reading at w = 2 uses one more sample, which continues the line through the last two.

    The file holds the same sample."""
    table = random_bake(terms=4, resolution=12, samples=20)
    image, layout = atlas.pack(table)
    expected = 2 * image[0, 19].astype(float) - image[0, 18]
    np.testing.assert_allclose(image[: atlas.STRIP_ROWS, 20], np.tile(expected, (4, 1)), rtol=2.0**-11)
    samples = image[0, 18:21].astype(float)
    # Three half floats near 1 are off by 2^-11 each, and their weights sum to 1.
    np.testing.assert_allclose(table.zero_order_xyz(2.0), [1 / 6, 4 / 6, 1 / 6] @ samples, atol=2.0**-10)


def test_the_bound_stands_above_the_curve():
    """Its lower left texel stands at the left of the first row above the strip's curve. It may be negative."""
    excess = np.random.default_rng(0).normal(size=(9, 9)).astype(np.float16).astype(np.float32)
    image, layout = atlas.pack(replace(random_bake(), excess_albedo=excess))
    assert layout.strip_rows == atlas.STRIP_ROWS + 9
    np.testing.assert_array_equal(image[atlas.STRIP_ROWS : layout.strip_rows, :9, 1], excess)
    np.testing.assert_array_equal(atlas.unpack(image, layout).excess_albedo, excess)


@pytest.mark.parametrize(("terms", "resolution"), [(2, RESOLUTION_MIN), (5, RESOLUTION_MIN), (2, 500), (2, 1024)])
def test_the_strip_fits_under_the_smallest_real_tables(terms, resolution):
    """A shallow relief under a short coherence has two tiles of 64 texels a side, but still 512 samples of Z(w)."""
    table = random_bake(terms, resolution, ZERO_ORDER_SAMPLES)
    again = atlas.unpack(*atlas.pack(table))
    np.testing.assert_allclose(again.zero_order, table.zero_order, rtol=1e-3, atol=1e-6)

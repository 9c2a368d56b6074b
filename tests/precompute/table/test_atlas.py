# SPDX-License-Identifier: GPL-3.0-or-later
"""The atlas: a table packed into one picture and unpacked again."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.bake.plan import RESOLUTION_MIN
from precompute.colour.channels import channel_count
from precompute.optics.brdf import NO_RATIO
from precompute.table import atlas
from precompute.table.blur_levels import (
    BYTES_PER_TEXEL,
    COLUMNS_BESIDE,
    FINE_BYTES,
    SPACINGS,
    TILE_PADDING,
    Cell,
    cell_for,
)
from precompute.table.table import ZERO_ORDER_SAMPLES

from .conftest import random_bake

few = settings(deadline=None, max_examples=40)


@few
@given(st.integers(2, 30), st.floats(-12, 12), st.integers(0, 2**32), st.integers(1, 4), st.sampled_from(SPACINGS))
def test_what_is_packed_comes_back(terms, decades, seed, levels, spacing):
    """To the rounding of half floats: 2^-11 of a value, and steps of 2^-24 below 2^-14. The scale puts the largest
    value between 4096 and 8192."""
    table = random_bake(terms, 12, 20, 10.0**decades, seed=seed, levels=levels, spacing=spacing)
    image, layout = atlas.pack(table)
    assert image.dtype == np.float16
    assert np.isfinite(image).all()
    again = atlas.unpack(image, layout)
    assert (len(again.levels), again.spacing, again.coarser) == (levels, spacing, table.coarser)
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


@pytest.mark.parametrize("spacing", [SPACINGS[0], SPACINGS[-1]])
@pytest.mark.parametrize("levels", [1, 4, 13])
@pytest.mark.parametrize("terms", [2, 7, 12, 23])
@pytest.mark.parametrize("resolution", [6, 15, (41, 70), (300, 33)])
def test_tiles_do_not_overlap(terms, resolution, levels, spacing):
    """Every tile of every level lies inside the picture and above the strip, on its own texels. Few texels are left
    empty, since all take memory. The picture is only a little longer than wide."""
    table = random_bake(terms, resolution, 6, levels=levels, spacing=spacing)
    layout = atlas.layout_of(table)
    taken = np.zeros((layout.height, layout.width), int)
    taken[: layout.strip_rows] += 1
    for level, tiles in enumerate(table.levels):
        for k in range(terms):
            x, y = layout.tile_origin(k, level)
            assert layout.tile_block(k, level) == (slice(y, y + tiles.shape[1]), slice(x, x + tiles.shape[2]))
            tile = taken[layout.tile_block(k, level)]
            assert tile.shape == tiles.shape[1:3]
            tile += 1
    assert taken.max() == 1
    square = np.ptp(layout.cell.size) < max(layout.cell.size) / 2
    assert terms <= layout.columns * layout.rows <= (1.34 * terms if square else 2 * terms)
    if square:
        short, long = sorted((layout.height - layout.strip_rows, layout.width))
        assert long <= 3 * short


@pytest.mark.parametrize("coarser", [1.0, 1.4, 2.0])
@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("side", [8, 60, 231, 2043])
def test_a_cell_is_little_more_than_its_tiles(side, spacing, coarser):
    """At most a third of a cell is lost to shelves and rounding."""
    cell = Cell((side, side), 14, spacing, coarser)
    tiles = sum(math.prod(n + 2 * TILE_PADDING for n in cell.inner_of(level)) for level in range(14))
    assert math.prod(cell.size) < 1.5 * tiles


@few
@given(st.tuples(*[st.integers(8, 2043)] * 2), st.integers(1, 22), st.sampled_from(SPACINGS), st.floats(1, 4))
def test_where_a_level_is_read_is_of_closed_form(inner, levels, spacing, coarser):
    """The formula by which a material finds a level known only during shading, in floats of 24 bits and with a power
    off by up to 4 last digits."""
    cell = Cell(inner, levels, spacing, coarser)
    off = np.random.default_rng(levels).uniform(-4, 4, levels) * 2.0**-24
    power = (cell.shrink ** np.arange(levels) * (1 + off)).astype(np.float32)
    shrink = np.maximum(power * np.float32(1 / coarser), np.float32(1) - np.arange(levels, dtype=np.float32))
    along = shrink * np.float32(-cell.geometric) + np.float32(cell.column_end + cell.phase)
    x = np.floor(np.maximum(np.arange(levels, dtype=np.float32) * np.float32(COLUMNS_BESIDE) + along, 0))
    above = np.arange(levels) >= cell.shelf
    places = np.stack([x - above * cell.upper[0], above * cell.upper[1]], axis=-1)
    np.testing.assert_array_equal(places, [cell.corner(level) for level in range(levels)])


def test_levels_stand_nearer_where_memory_allows():
    """The spacing is the closest whose picture takes at most FINE_BYTES. The last level reaches a kernel of 0.25, or is
    the last one with eight inner texels."""
    for side in (200, 800, 1500):
        cell = cell_for(4, (side, side), 4 / side)
        spacing, last = cell.spacing, cell.levels - 1
        assert spacing.grown(last - 1) < (0.25 * side / 4) ** 2 <= spacing.grown(last)
        number = SPACINGS.index(spacing)
        assert 4 * math.prod(cell.size) * BYTES_PER_TEXEL <= FINE_BYTES or spacing == SPACINGS[-1]
        for other in SPACINGS[:number]:
            assert 4 * math.prod(Cell((side, side), 14, other, other.stretch).size) * BYTES_PER_TEXEL > FINE_BYTES
        assert (number > 0) == (side > 200)
    # A part of a table has the whole table's spacing, even if a closer one would fit.
    whole = cell_for(4, (800, 800), 4 / 800)
    part = cell_for(4, (200, 300), 4 / 800, whole=(800, 800))
    assert part.spacing == whole.spacing != cell_for(4, (200, 300), 4 / 800).spacing and part.inner == (200, 300)
    small = cell_for(4, (20, 90), 1e-3)
    assert min(small.inner_of(small.levels - 1)) >= 8
    assert min(replace(small, levels=small.levels + 1).inner_of(small.levels)) <= 8


def test_wider_levels_have_fewer_texels_to_their_kernels_as_asked():
    """At most `coarser` times fewer than level 0, and that at level 1. So a smaller error takes finer texels on level 0
    alone, and their memory serves closer levels."""
    for coarser in (1.0, 1.35):
        cell = cell_for(6, (700, 700), 0.0074, coarser=coarser)
        texels = [cell.texels(level) / cell.spacing.grown(level) ** 0.5 for level in range(cell.levels)]
        assert texels[0] == 1 and texels[1] == pytest.approx(coarser)
        assert texels[1:] == sorted(texels[1:], reverse=True)
    even, coarse = (cell_for(6, (700, 700), 0.0074, coarser=coarser).spacing for coarser in (1.0, 1.35))
    assert SPACINGS.index(coarse) < SPACINGS.index(even)


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
    """A reading at w = 2, also from the file, uses one more sample on the line through the last two."""
    table = random_bake(terms=4, resolution=12, samples=20)
    image, layout = atlas.pack(table)
    expected = 2 * image[0, 19].astype(float) - image[0, 18]
    np.testing.assert_allclose(image[: atlas.STRIP_ROWS, 20], np.tile(expected, (4, 1)), rtol=2.0**-11)
    samples = image[0, 18:21].astype(float)
    # Three half floats near 1 have an error of 2^-11 each, and their weights sum to 1.
    np.testing.assert_allclose(table.zero_order_xyz(2.0), [1 / 6, 4 / 6, 1 / 6] @ samples, atol=2.0**-10)


@pytest.mark.parametrize(("ratio_ior", "albedo"), [(NO_RATIO, 1.0), (2.5, 1.25)])
def test_above_the_curves_rows_the_tiles_begin(ratio_ior, albedo):
    image, layout = atlas.pack(replace(random_bake(), ratio_ior=ratio_ior, largest_albedo=albedo))
    assert layout.strip_rows == atlas.STRIP_ROWS
    assert layout.is_valid and layout.tile_origin(0) == (0, atlas.STRIP_ROWS)
    assert layout.height == atlas.STRIP_ROWS + layout.rows * layout.cell_rows
    again = atlas.unpack(image, layout)
    assert (again.ratio_ior, again.largest_albedo) == (ratio_ior, albedo)


@pytest.mark.parametrize(("illuminant", "triples"), [("D65+smooth", 2), ("D65+led", 3), ("D65+led+FL11", 4)])
def test_all_channels_come_back(illuminant, triples):
    """Random half floats in every texel. Each three channels have rows of the strip, and then cells of all terms. The
    scale is a power of two, which loses no digit."""
    rng, plain = np.random.default_rng(1), random_bake(levels=2)

    def halves(*shape):
        return rng.normal(size=shape).astype(np.float16).astype(np.float32)

    terms, wider = (halves(*tiles.shape[:3], 3 * triples) for tiles in plain.levels)
    table = replace(
        plain, terms=terms, wider=(wider,), zero_order=halves(20, 3 * triples), illuminant=illuminant,
    )  # fmt: skip
    image, layout = atlas.pack(table)
    assert layout.is_valid and layout.triples == triples
    assert layout.strip_rows == triples * atlas.STRIP_ROWS
    again = atlas.unpack(image, layout)
    for one, other in zip((*table.levels, table.zero_order), (*again.levels, again.zero_order), strict=True):
        np.testing.assert_array_equal(one, other)
    # The first three channels of a term are in the cell that a table of XYZ alone has.
    (rows, columns), last = layout.tile_block(1, 0), layout.tile_block(1, 1, triples - 1)
    np.testing.assert_array_equal(image[rows, columns] * layout.scale, table.terms[1, ..., :3])
    np.testing.assert_array_equal(image[last] * layout.scale, table.wider[0][1, ..., -3:])
    for triple in range(triples):
        for row in range(atlas.STRIP_ROWS):
            curve = image[triple * atlas.STRIP_ROWS + row, :20]
            np.testing.assert_array_equal(curve, table.zero_order[:, 3 * triple : 3 * triple + 3])


@pytest.mark.parametrize("illuminant", ["D65+smooth", "D65+led"])
def test_cells_of_several_channels_do_not_overlap(illuminant):
    count = channel_count(illuminant)
    plain = random_bake(5, (30, 41), levels=3)
    levels = [np.repeat(tiles, count // 3, axis=-1) for tiles in plain.levels]
    table = replace(plain, terms=levels[0], wider=tuple(levels[1:]), zero_order=np.zeros((20, count)))
    layout = atlas.layout_of(replace(table, illuminant=illuminant))
    taken = np.zeros((layout.height, layout.width), int)
    taken[: layout.strip_rows] += 1
    for triple in range(layout.triples):
        for level in range(3):
            for term in range(5):
                taken[layout.tile_block(term, level, triple)] += 1
    assert taken.max() == 1


def test_strip_rows_are_those_of_the_channels():
    """A header whose rows or cells are too few or too many for its channels is refused, and so is one of other
    channels than the picture's rows are for."""
    table = replace(random_bake(), terms=np.zeros((5, 12, 12, 6), np.float32), zero_order=np.zeros((20, 6)))
    layout = atlas.layout_of(replace(table, illuminant="D65+smooth"))
    assert layout.is_valid and layout.strip_rows == 8
    for rows in (0, 4, 7, 9, 12):
        assert not replace(layout, strip_rows=rows).is_valid
    for other in ("D65", "D65+led", "D65+smooth+FL11", "D65+2700K+FL11", "smooth", "D65+smooth+smooth"):
        assert not replace(layout, illuminant=other).is_valid
    assert replace(layout, illuminant="D65+2700K").is_valid
    assert not replace(layout, rows=1, columns=9).is_valid and replace(layout, rows=1, columns=10).is_valid


@pytest.mark.parametrize(("terms", "resolution"), [(2, RESOLUTION_MIN), (5, RESOLUTION_MIN), (2, 500), (2, 1024)])
def test_the_strip_fits_under_the_smallest_real_tables(terms, resolution):
    """A shallow relief under a short coherence has two tiles of 64 texels a side, but still 512 samples of Z(w)."""
    table = random_bake(terms, resolution, ZERO_ORDER_SAMPLES)
    again = atlas.unpack(*atlas.pack(table))
    np.testing.assert_allclose(again.zero_order, table.zero_order, rtol=1e-3, atol=1e-6)

# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from precompute.world_sources.sources import compact_parts, panorama_cells
from tests.precompute.world_sources.worlds import COLS, ROWS, box, direction, disc

CELLS = panorama_cells(ROWS, COLS)


def parts_of(luminance, least=0.01):
    total = luminance @ CELLS.solid_angles
    return compact_parts(luminance.reshape(ROWS, COLS), CELLS, least=least * total, widest=0.02)


def test_a_disc_is_a_part_with_its_surroundings_as_base():
    shape = box(direction(30, 40), 12, 12)
    [part] = parts_of(0.5 + 3 * shape)
    assert set(part.pixels) == set(np.flatnonzero(shape))
    assert part.base == 0.5
    assert part.excess == pytest.approx(3 * shape @ CELLS.solid_angles)


@pytest.mark.night("test_what_is_wide_or_faint_or_has_no_contrast_is_no_part")
@pytest.mark.parametrize("towards", [(30, 180), (90, 0), (-90, 0), (84, 100)])
def test_parts_go_on_across_the_edges_of_the_picture(towards):
    assert len(parts_of(0.1 + disc(direction(*towards), 8))) == 1


def test_two_windows_in_a_bright_wall_are_two_parts_and_two_lobes_of_one_light_are_one():
    left, right, wall = (box(direction(0, azimuth), width, 12) for azimuth, width in ((-7, 8), (7, 8), (0, 22)))
    assert len(parts_of(0.1 + wall + 9 * (left + right))) == 2
    assert len(parts_of(0.1 + 9 * wall + 1 * (left + right))) == 1


def test_what_is_wide_or_faint_or_has_no_contrast_is_no_part():
    assert parts_of(0.1 + disc(direction(50, 30), 30)) == []
    assert parts_of(1 + 4 * disc(direction(50, 30), 1)) == []
    assert parts_of(1 + 0.9 * disc(direction(50, 30), 12)) == []
    assert len(parts_of(1 + 1.5 * disc(direction(50, 30), 12))) == 1


def test_the_greatest_excess_comes_first():
    found = parts_of(0.1 + 2 * disc(direction(50, 30), 6) + 5 * disc(direction(-20, 200), 6))
    assert [part.excess for part in found] == sorted((part.excess for part in found), reverse=True)
    assert len(found) == 2

# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from precompute.world_sources.sources import crop_cells, crop_frame, inside_crop, panorama_cells


def test_the_cells_of_a_panorama_are_the_sphere():
    for rows, cols in ((1, 1), (1, 8), (7, 5), (64, 128)):
        cells = panorama_cells(rows, cols)
        assert cells.solid_angles.sum() == pytest.approx(4 * np.pi, rel=1e-12)
        np.testing.assert_allclose(cells.moments.sum(axis=0), 0, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(cells.directions, axis=1), 1)


def test_a_picture_looks_along_x_from_the_bottom_up():
    """Blender's convention; tests/addon/worlds compares it with Blender itself."""
    directions = panorama_cells(3, 4).directions.reshape(3, 4, 3)
    east, up = np.sqrt(0.5), np.sqrt(0.75)
    np.testing.assert_allclose(directions[1], [[-east, east, 0], [east, east, 0], [east, -east, 0], [-east, -east, 0]],
                               atol=1e-12)  # fmt: skip
    np.testing.assert_allclose(directions[:, 0, 2], (-up, 0, up), atol=1e-12)


def test_moments_are_the_integral_of_the_direction():
    """Against the sum over cells 50 times finer, whose error is 1e-4 of the coarse cells' size squared."""
    coarse, fine = panorama_cells(4, 8), panorama_cells(200, 400)
    sums = (fine.directions * fine.solid_angles[:, None]).reshape(4, 50, 8, 50, 3).sum(axis=(1, 3))
    np.testing.assert_allclose(coarse.moments, sums.reshape(-1, 3), atol=1e-4)


@pytest.mark.parametrize("towards", [(1, 0, 0), (0, 0, 1), (0, 0, -1), (0.3, -0.5, 0.2)])
def test_a_crop_is_a_small_square_about_its_direction(towards):
    unit = np.array(towards) / np.linalg.norm(towards)
    frame = crop_frame(unit)
    np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1)
    np.testing.assert_allclose(frame[:, 0], unit, atol=1e-12)
    cells = crop_cells(8, 0.01, unit)
    # The square of 0.02 rad, less the curvature of the sphere: a part in (0.01)^2 / 6.
    assert cells.solid_angles.sum() == pytest.approx(0.02**2, rel=2e-5)
    np.testing.assert_allclose(cells.moments.sum(axis=0) / cells.solid_angles.sum(), unit, atol=1e-4)
    assert inside_crop(cells.directions, 0.01, unit).all()
    assert not inside_crop(crop_cells(2, 0.03, unit).directions, 0.01, unit).any()
    # Row 0 is at the bottom, column 0 at the left.
    corner = cells.directions[0] @ frame
    assert corner[1] > 0 > corner[2]


def test_tiny_cells_know_how_wide_they_are():
    """A square of side a has a variance of a^2 / 12 along each axis, to the rounding of 1 - cosine."""
    cells = crop_cells(1, 5e-5, (0.3, 0.4, 0.5))
    variance = 1 - np.linalg.norm(cells.moments[0]) / cells.solid_angles[0]
    assert variance == pytest.approx(1e-4**2 / 12, rel=1e-6)
    assert cells[np.array([True])].directions.shape == (1, 3)

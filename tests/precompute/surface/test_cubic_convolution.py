# SPDX-License-Identifier: GPL-3.0-or-later
"""Readings between pixels."""

import numpy as np
import pytest

from precompute.surface.height_map import read_between


def quadratic(row, col):
    return 3 + 0.2 * row - 0.4 * col + 0.05 * row**2 - 0.03 * row * col + 0.02 * col**2


@pytest.mark.parametrize(("kind", "digits"), [(np.float64, 1e-14), (np.float32, 1e-6)])
def test_a_quadratic_surface_is_read_exactly(kind, digits):
    """To some roundings in the image's kind of float, of values up to 30."""
    row, col = np.random.default_rng(0).uniform(1, 17, (2, 5, 40))
    image = quadratic(*np.meshgrid(np.arange(20.0), np.arange(20.0), indexing="ij")).astype(kind)
    found = read_between(image, row, col)
    assert found.dtype == kind
    np.testing.assert_allclose(found, quadratic(row, col), rtol=0, atol=30 * digits)


def test_places_broadcast_and_edge_pixels_repeat():
    image = np.arange(12.0).reshape(3, 4)
    found = read_between(image, np.array([[0.0], [2.0]]), np.arange(4.0))
    np.testing.assert_array_equal(found, image[[0, 2]])
    np.testing.assert_allclose(read_between(image, np.array([-9.0, 50.0]), np.array([-9.0, 50.0])), [0, 11], atol=1e-14)

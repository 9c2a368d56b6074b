# SPDX-License-Identifier: GPL-3.0-or-later
"""The grid search against all distances."""

import numpy as np

from precompute.mesh.surface import nearest

from .shapes import sphere


def test_it_is_the_nearest_near_and_far():
    random = np.random.default_rng(3)
    points, _ = sphere(4)
    places = np.concatenate([random.uniform(-1.2, 1.2, (200, 3)), random.uniform(-50, 50, (50, 3))])
    distance = np.linalg.norm(points[None] - places[:, None], axis=2)
    found = nearest(points, places)
    np.testing.assert_allclose(distance[np.arange(len(places)), found], distance.min(axis=1), rtol=1e-12)


def test_of_one_point_it_is_that():
    np.testing.assert_array_equal(nearest(np.zeros((1, 3)), np.array([[0.0, 0, 0], [5, 5, 5]])), [0, 0])

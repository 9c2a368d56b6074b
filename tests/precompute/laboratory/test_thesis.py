# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's gain and its blending with a texture."""

import numpy as np
import pytest

from laboratory.study.thesis import blend_texture, fresnel_schlick, relative_reflectance


def test_schlick_at_both_ends():
    assert fresnel_schlick(np.array([1.0, 0.0]), 1.5) == pytest.approx([0.04, 1.0])


def test_relative_reflectance_of_a_mirror_is_one():
    samples = 400
    up = np.array([0.0, 0.0, 1.0])
    assert relative_reflectance(up, up, samples) * samples**2 == pytest.approx(1)
    a, b = np.radians(50), np.radians(20)
    wi, wr = np.array([-np.sin(a), 0, np.cos(a)]), np.array([np.sin(b), 0, np.cos(b)])
    c = np.cos((a + b) / 2)
    f = (0.04 + 0.96 * (1 - c) ** 5) / 0.04
    expected = f**2 * (1 + wi @ wr) ** 2 / ((np.cos(a) + np.cos(b)) ** 2 * np.cos(b))
    assert relative_reflectance(wi, wr, 1) == pytest.approx(expected)


def test_blending():
    diffraction, texture = np.array([[1.0, 0, 0]] * 3), np.array([[0, 1.0, 0]] * 3)
    mixed = blend_texture(diffraction, texture, np.array([0.0, -0.4, 7.0]))
    assert mixed == pytest.approx(np.array([[0.9, 1.1, 0], [0.9, 0.7, 0], [0.9, 0.1, 0]]))

# SPDX-License-Identifier: GPL-3.0-or-later
"""N slits against known results."""

import numpy as np
import pytest

from laboratory.study import slits
from precompute.colour.observer import white_xyz

LAM = 500e-9


def test_two_slits_are_a_cosine_squared():
    sine = np.linspace(-0.02, 0.02, 301)
    expected = np.sinc(30e-6 * sine / LAM) ** 2 * np.cos(np.pi * 150e-6 * sine / LAM) ** 2
    assert slits.intensity(sine, 2, LAM) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("count", [1, 3, 10])
def test_the_sum_over_the_slits(count):
    """The sum of every slit's field, each as a sum over points of its width."""
    sine = np.linspace(-0.011, 0.013, 97)
    points = (np.arange(400) + 0.5) / 400 * slits.WIDTH_M
    places = (np.arange(count)[:, None] * slits.PITCH_M + points).ravel()
    field = np.exp(-2j * np.pi / LAM * sine[:, None] * places).mean(axis=1)
    assert slits.intensity(sine, count, LAM) == pytest.approx(np.abs(field) ** 2, abs=1e-5)


def test_orders_stand_where_the_grating_equation_puts_them():
    orders = np.arange(-4, 5) * LAM / slits.PITCH_M
    assert slits.intensity(orders, 7, LAM) == pytest.approx(slits.envelope(orders, LAM), abs=1e-12)
    # The pitch is five widths: the fifth order falls on the envelope's first zero.
    assert slits.intensity(np.array([5 * LAM / slits.PITCH_M]), 7, LAM)[0] < 1e-25
    zeros = np.arange(1, 7) * LAM / (7 * slits.PITCH_M)
    assert np.all(slits.intensity(zeros, 7, LAM) < 1e-25)


def test_the_middle_of_the_screen_is_white():
    assert slits.white_light(slits.screen_sine(np.zeros(1)), 5)[0] == pytest.approx(white_xyz())


def test_the_plot(tmp_path, matplotlib):
    slits.plot(tmp_path / "slits.png")
    assert (tmp_path / "slits.png").stat().st_size > 5000

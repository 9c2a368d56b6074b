# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a low wave's first order."""

import numpy as np
import pytest

from precompute.surface.periods import COARSEST_PERIOD_M, FINEST_PERIOD_M, visible_share


def test_only_periods_of_the_band_diffract_visibly():
    inside = np.array([1.01 * FINEST_PERIOD_M, 1e-6, 0.99 * COARSEST_PERIOD_M])
    outside = np.array([0.99 * FINEST_PERIOD_M, 1.01 * COARSEST_PERIOD_M, 1.0])
    assert (visible_share(1 / inside) > 0).all()
    assert (visible_share(1 / outside) == 0).all()
    assert visible_share(np.zeros((2, 2))).tolist() == [[0, 0], [0, 0]]


def test_a_coarse_wave_sends_out_what_its_closed_form_says():
    """For a long wave tr is nearly -ti, so w = 2 cos(ti). The mean of w^2 over ti, weighted by cos(ti), is
    4 * (integral of cos^3) / (integral of cos) = 4 * (4 / 3) / 2 = 8 / 3. Luminance under D65 is centred near 560 nm,
    and the mean of 1 / lambda^2 is 2 % above its value there. At 6.6 um lambda / d is 0.085: w^2 differs by less than
    2 * 0.085 = 17 %, with both signs."""
    expected = (np.pi / 560e-9) ** 2 * 8 / 3
    assert visible_share(np.array(1 / 6.6e-6)) == pytest.approx(expected, rel=0.1)


def test_finer_waves_send_out_less():
    """Their orders leave at steeper angles, and more orders do not leave at all."""
    shares = visible_share(1 / np.array([6e-6, 3e-6, 1.5e-6, 1e-6, 0.6e-6, 0.4e-6, 0.3e-6, 0.2e-6]))
    assert (np.diff(shares) < 0).all()


def test_the_band_is_that_of_the_eye_and_the_sun():
    assert FINEST_PERIOD_M == pytest.approx(190e-9)
    # Red and green are 62 nm apart, over the sun's 9.3 mrad.
    assert COARSEST_PERIOD_M == pytest.approx(6.67e-6, rel=1e-3)

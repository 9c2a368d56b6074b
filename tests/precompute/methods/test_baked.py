# SPDX-License-Identifier: GPL-3.0-or-later
"""The arrangements in which the benchmark tries the bake."""

from laboratory.speed.trials import FINER
from precompute.bake.plan import TEXELS_MIN
from precompute.maths import bspline


def test_every_trial_leaves_a_kernel_to_bake():
    """The kernel sampled at the texels is narrower by the blur of a reading, and vanishes if texels are too large. That
    once ended the benchmark after ten minutes."""
    assert min(FINER) * TEXELS_MIN > bspline.VARIANCE**0.5

# SPDX-License-Identifier: GPL-3.0-or-later
"""A plan's choice of terms, texels, kernel and wavelengths."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.bake import ensemble
from precompute.bake.ensemble import plan
from precompute.bake.needs import Needs
from precompute.bake.plan import (
    DEFAULT_BYTES,
    RESOLUTION_MIN,
    bake_wavelengths,
    blender_bytes,
    kernel_for,
    resolution_for,
    texel_size,
)
from precompute.bake.request import BakeRequest
from precompute.base.failure import GratingError
from precompute.optics import coherence
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare

from .conftest import COHERENCE_M, waves

few = settings(deadline=None, max_examples=25)


def table_bytes(chosen):
    """Bytes of a plan's table as an atlas in Blender."""
    return blender_bytes(chosen.terms, tuple(len(axis) for axis in chosen.axes), chosen.sigma_b)


def test_deeper_reliefs_take_more_terms():
    counts = [
        plan(waves(depth), BakeRequest(coherence_length_m=COHERENCE_M)).terms
        for depth in (0.0, 50e-9, 200e-9, 400e-9, 800e-9)
    ]
    assert counts[0] == 2
    assert counts == sorted(counts) and len(set(counts)) >= 4


def test_a_tighter_budget_takes_more_terms_and_texels():
    plans = [
        plan(waves(300e-9), BakeRequest(delta_e=delta_e, coherence_length_m=COHERENCE_M)) for delta_e in (10, 1, 0.1)
    ]
    for what in ("terms", "texels_per_sigma"):
        counts = [getattr(chosen, what) for chosen in plans]
        assert counts == sorted(counts) and counts[0] < counts[-1]


@few
@given(st.floats(0.003, 1), st.floats(0.9, 4))
def test_the_coarsest_table_that_resolves_the_kernel(sigma_b, texels):
    """Two texels fewer (their number is even) would not resolve the kernel."""
    resolution = resolution_for(sigma_b, texels)
    assert resolution % 2 == 0
    assert sigma_b >= texels * texel_size(resolution) * (1 - 1e-9)
    if resolution > RESOLUTION_MIN:
        assert sigma_b < texels * texel_size(resolution - 2) * (1 + 1e-9)


@pytest.mark.parametrize("delta_e", [3.0, 1.0])
def test_a_coherence_that_no_table_holds_is_refused_and_what_is_recommended_is_taken(delta_e):
    with pytest.raises(GratingError, match="coherence of 2e[+]03 um: too fine for .*; ask for at most") as caught:
        plan(waves(), BakeRequest(delta_e=delta_e, coherence_length_m=2e-3))
    recommended = float(str(caught.value).split("at most ")[1].split()[0])
    assert plan(
        waves(), BakeRequest(delta_e=delta_e, coherence_length_m=recommended * 1e-6)
    ).sigma_b == coherence.kernel_sigma(recommended * 1e-6)


def test_a_kernel_chosen_by_itself_averages_thirty_areas():
    scan = prepare(HeightMap(waves().height_m, (78e-9, 78e-9), "test"))
    chosen = plan(scan)
    areas = coherence.coherence_areas(scan.size_m, coherence.coherence_length(chosen.sigma_b))
    assert areas == pytest.approx(coherence.MINIMUM_AREAS, rel=1e-9)
    assert table_bytes(chosen) <= DEFAULT_BYTES


def test_scans_of_one_skin_average_more_areas():
    """n scans average thirty areas of sqrt(n) times the length. If they do not wrap, their apodisation limits it."""
    scan = prepare(HeightMap(waves().height_m, (78e-9, 78e-9), "test"))
    one, two, nine = (kernel_for((waves(),) * count, BakeRequest()) for count in (1, 2, 9))
    assert (two, nine) == pytest.approx((one / 2**0.5, one / 3), rel=1e-12)
    assert kernel_for((scan,) * 9, BakeRequest()) == pytest.approx(
        780e-9 * max(scan.window_q) / (2 / 3) ** 0.5, rel=1e-12
    )


def test_a_table_chosen_by_itself_keeps_to_its_memory(monkeypatch):
    """An automatic kernel that needs more memory than there is gets wider until the table fits. An asked kernel is
    kept. The levels may leave some memory
    unused, since their tiles are rounded up to a power of two."""
    monkeypatch.setattr(ensemble, "DEFAULT_BYTES", 6 << 20)
    free = plan(waves(), BakeRequest(coherence_length_m=COHERENCE_M))
    assert free.sigma_b == pytest.approx(coherence.kernel_sigma(COHERENCE_M), rel=1e-12)
    assert table_bytes(free) > 6 << 20
    # To average 30 areas of a scan of 20 x 20 periods, cut to 400 rows, the kernel would be 0.005.
    wide = HeightMap(np.tile(waves().height_m, (20, 20))[:400], (78e-9, 78e-9), "test", periodic=True)
    chosen = plan(prepare(wide))
    assert 0.85 * (6 << 20) < table_bytes(chosen) <= 6 << 20
    assert 2 * np.diff(np.log(chosen.wavelengths)).max() <= 1.7 * chosen.sigma_b


def test_a_wide_light_takes_fewer_texels():
    """A disc of ten degrees blurs by 0.044, more than the kernel's 0.031."""
    needs = Needs(light_radius=np.radians(5))
    assert plan(waves(), BakeRequest(coherence_length_m=COHERENCE_M, needs=needs)).sigma_b == pytest.approx(
        np.radians(5) / 2
    )


@pytest.mark.parametrize("sigma_b", [0.004, 0.0079, 0.03, 0.5])
def test_wavelengths_leave_no_gaps(sigma_b):
    """At |u| = 2 an order moves by at most 1.61 standard deviations from one wavelength to the next. A sum of Gaussians
    at this spacing is flat to 1e-3."""
    lambdas = bake_wavelengths(sigma_b)
    assert (lambdas[0], lambdas[-1]) == pytest.approx((380e-9, 780e-9), rel=1e-12)
    steps = np.diff(np.log(lambdas))
    np.testing.assert_allclose(steps, steps[0], rtol=1e-9)
    assert len(lambdas) >= 81
    spacing = 1.612
    assert 2 * steps[0] <= spacing * sigma_b * (1 + 1e-9)
    x = np.linspace(0, spacing, 50)
    comb = np.exp(-((x[:, None] - spacing * np.arange(-8, 9)) ** 2) / 2).sum(axis=1) * spacing / np.sqrt(2 * np.pi)
    assert np.abs(comb - 1).max() < 1.01e-3

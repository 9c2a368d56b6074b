# SPDX-License-Identifier: GPL-3.0-or-later
"""The largest directional albedo of a bake that holds its matter's reflectance, and the division by it."""

from functools import cache

import numpy as np
import pytest

from laboratory.benchmarks.hemisphere import directional_albedo_xyz
from precompute.bake.ensemble import bake, plan, sample_set
from precompute.bake.largest_albedo import largest_albedo
from precompute.bake.request import BakeRequest
from precompute.bake.sample_draws import make_sample_set
from precompute.reflectance.matter import parse
from precompute.surface.relief import prepare
from precompute.surface.samples.catalogue import make_sample
from precompute.surface.samples.ruled_gratings import flat, sinusoidal

COHERENCE_M = 4e-6
SURFACES = {
    "shallow": lambda: sinusoidal(1.5e-6, 60e-9, periods=8, samples_per_period=64, rows=8),
    "deep": lambda: sinusoidal(0.8e-6, 250e-9, periods=8, samples_per_period=64, rows=8),
    "blazed": lambda: make_sample("blazed"),
    "xenopeltis": lambda: make_sample("xenopeltis"),
}


@cache
def chosen(name, matter="mirror"):
    request = BakeRequest(delta_e=5, coherence_length_m=COHERENCE_M, matter=parse(matter))
    return plan(prepare(SURFACES[name]()), request)


@pytest.mark.night("test_a_flat_mirror_and_a_dark_matter_are_not_divided")
@pytest.mark.parametrize("name", SURFACES)
def test_more_directions_and_texels_change_it_by_a_percent_at_most(name):
    """A sample of 64 x 64 texels has errors of 0.3 %, and twice as many angles find up to 0.8 % more."""
    one = chosen(name)
    finer = largest_albedo(one.ensemble, one.matter, "D65", size=128, finer=2)
    assert one.largest_albedo == pytest.approx(finer, rel=0.01)
    assert one.largest_albedo > 1.01


@pytest.mark.parametrize("name", ["shallow", "deep"])
def test_a_perfect_mirror_sends_back_at_most_what_arrives(name):
    """The bake's table, seen along T in a white world, by another quadrature. The sums over the table are good to a
    dE00 of 1, a hundredth of the light; so is the number."""
    relief = prepare(SURFACES[name]())
    table = bake(relief, BakeRequest(coherence_length_m=COHERENCE_M, matter=parse("mirror")))
    found = [
        directional_albedo_xyz(table, np.radians(angle))[1] for angle in (0, 15, 30, 45, 55, 65, 70, 75, 80, 85, 88)
    ]
    assert max(found) == pytest.approx(1, abs=0.02)


def test_a_flat_mirror_and_a_dark_matter_are_not_divided():
    request = BakeRequest(delta_e=5, coherence_length_m=COHERENCE_M)
    for surface, matter in ((flat(), "mirror"), (SURFACES["deep"](), "1.5")):
        asked = BakeRequest(delta_e=5, coherence_length_m=COHERENCE_M, matter=parse(matter))
        assert plan(prepare(surface), asked).largest_albedo == pytest.approx(1, abs=1e-9)
    assert plan(prepare(SURFACES["deep"]()), request).largest_albedo == 1


def test_the_sample_set_is_divided_too():
    one = chosen("deep")
    plain, divided = make_sample_set(one.ensemble, one.sigma_b), sample_set(one)
    np.testing.assert_array_equal(divided.q, plain.q)
    np.testing.assert_allclose(divided.pieces * np.float32(one.largest_albedo), plain.pieces, rtol=1e-6)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The second attempt of a bake that misses the requested colour error."""

import pytest

from precompute.bake import make as make_module
from precompute.bake.request import BakeRequest
from precompute.measure.errors import Errors
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import sinusoidal


@pytest.mark.night("tests/precompute/bake/test_spread.py")
def test_it_asks_for_a_smaller_error_alone(monkeypatch):
    """For half of the error that would be just enough: the first attempt has twice the requested error."""
    attempt, tried = make_module._attempt, []

    def told(reliefs, request, *rest):
        tried.append(request)
        return attempt(reliefs, request, *rest)

    monkeypatch.setattr(make_module, "_attempt", told)
    errors = iter([2.0, 2.0])
    monkeypatch.setattr(Errors, "over", lambda *_: next(errors, 0.5))
    monkeypatch.setattr(make_module, "with_learnt_basis", lambda table, _: table)
    relief = prepare(sinusoidal(2.5e-6, 60e-9, periods=4, samples_per_period=32, rows=128))
    make_module.make([relief], BakeRequest(delta_e=10.0))
    assert tried == [BakeRequest(delta_e=10.0), BakeRequest(delta_e=pytest.approx(2.5))]

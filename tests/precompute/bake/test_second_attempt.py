# SPDX-License-Identifier: GPL-3.0-or-later
"""The second attempt of a bake that misses the requested colour error."""

import pytest

from precompute.bake import make as make_module
from precompute.bake.request import BakeRequest
from precompute.optics.coherence import coherence_length
from precompute.reflectance.matter_text import parse
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import sinusoidal


@pytest.mark.short("None")
@pytest.mark.parametrize(
    ("matter", "asked_m", "halves"), [("mirror", None, True), ("mirror", 4e-6, False), ("dielectric", None, False)]
)
def test_it_halves_an_automatic_coherence_length_for_an_albedo_bound(matter, asked_m, halves, monkeypatch):
    """A line grating in aluminium was refused by default: its bound bends where an order crosses the horizon, and the
    bound's table has a largest size."""
    attempt, tried = make_module._attempt, []

    def told(reliefs, request, *rest):
        made = attempt(reliefs, request, *rest)
        tried.append((request, made.table.sigma_b))
        return made

    monkeypatch.setattr(make_module, "_attempt", told)
    errors = iter([2.0, 2.0, 0.5, 0.5, 0.5])  # the first attempt misses, the second keeps the request
    monkeypatch.setattr(make_module, "_excess", lambda *_: next(errors, 0.5))
    monkeypatch.setattr(make_module, "with_learnt_basis", lambda table, _: table)
    relief = prepare(sinusoidal(2.5e-6, 60e-9, periods=4, samples_per_period=32, rows=128))
    make_module.make([relief], BakeRequest(delta_e=10.0, matter=parse(matter), coherence_length_m=asked_m))
    (_, sigma_b), (second, _) = tried
    assert second.delta_e == pytest.approx(10 / (2 * 2))
    if halves:
        assert second.coherence_length_m == pytest.approx(coherence_length(sigma_b) / 2)
    else:
        assert second.coherence_length_m == asked_m

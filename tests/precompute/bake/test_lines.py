# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes for the single line of a laser."""

import json
from dataclasses import replace

import numpy as np
import pytest

from laboratory.verbs import PACKAGES
from precompute.bake import patch
from precompute.bake.ensemble import bake, plan
from precompute.bake.request import BakeRequest, request_from
from precompute.base.failure import GratingError
from precompute.cli import parser
from precompute.colour.observer import mirror_xyz
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare

PERIOD_M, DEPTH_M, LINE_M = 2.5e-6, 246.23e-9, 532e-9
LASER = BakeRequest(coherence_length_m=12e-6, illuminant="532nm")


@pytest.fixture(scope="module")
def blazed():
    return prepare(read_height_map("sample:blazed"))


@pytest.fixture(scope="module")
def table(blazed):
    return bake(blazed, LASER)


def test_each_order_is_one_spot_at_the_grating_equation(table):
    """The orders of a blaze follow the closed form: order m at u = m lambda / d with the efficiency sinc^2(m + w
    depth / lambda), blurred by the kernel. The sample's edges are one pixel wide, which costs the strong orders 1 %."""
    u = np.linspace(-0.7, -0.1, 601)
    for w in (1.2, 1.7, 2.0):
        m = np.arange(-8, 9)[:, None]
        efficiency = np.sinc(m + w * DEPTH_M / LINE_M) ** 2 * (m != 0)
        spots = np.exp(-((u - m * LINE_M / PERIOD_M) ** 2) / (2 * table.sigma_b**2))
        y = (efficiency * spots).sum(axis=0) / (2 * np.pi * table.sigma_b**2)
        read = table.scattered_over_w2(u, 0 * u, np.full(u.shape, w)) * w**2
        np.testing.assert_allclose(read[:, 1], y, atol=0.02 * y.max())
        assert abs(u[read[:, 1].argmax()] + LINE_M / PERIOD_M) <= 1e-3  # the step of u
        np.testing.assert_allclose(read, read[:, 1:2] * mirror_xyz("532nm"), atol=1e-3 * y.max())


def test_the_mirror_image_has_its_colour(table):
    np.testing.assert_allclose(table.zero_order_xyz(np.zeros(1))[0], mirror_xyz("532nm"), rtol=1e-3)


@pytest.mark.night("tests/precompute/bake/test_patch.py")
def test_one_wavelength_is_summed(blazed):
    assert len(plan(blazed, LASER).wavelengths) == 1
    assert len(patch.plan([blazed], replace(LASER, model="patch")).wavelengths) == 1


@pytest.mark.night("tests/precompute/cli/test_level.py")
def test_the_error_is_kept_and_checked(tmp_path, capsys):
    """By the self-check, and from the file by `check`, which shares no code with the bake."""
    bake_it = ["bake", "sample:blazed", "--coherence-um", "12", "--illuminant", "650nm", "-o", str(tmp_path)]
    assert parser.main([*bake_it, "--json", "-", "--progress", "none"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["wavelengths"] == 1
    assert 0 < facts["delta_e"]["p99"] <= 1
    assert (
        parser.main(["check", facts["files"][0], "sample:blazed", "--pairs", "400", "--progress", "none"], PACKAGES)
        == 0
    )


def test_other_lights_are_refused():
    assert request_from({"illuminant": "633nm"}, "a").illuminant == "633nm"
    for bad in ("390nm", "710nm", "532.5nm", "green", 532):
        with pytest.raises(GratingError, match="a: illuminant: .*; (give|did you mean) "):
            request_from({"illuminant": bad}, "a")

# SPDX-License-Identifier: GPL-3.0-or-later
"""`check` of a bake for several lamps: its channels, and the errors under lamps that its header states."""

import json
from dataclasses import replace

import numpy as np
import pytest

from laboratory.check.verdict import Lamp
from precompute.bake.self_check import LAMPS
from precompute.cli import parser
from precompute.measure.errors import Errors
from precompute.table import atlas

PICTURE = ("--size-um", "4", "--height-nm", "250")
QUICK = ("--pairs", "1000", "--step-nm", "10", "--progress", "none")


@pytest.fixture(scope="module", params=["dielectric", "gold"])
def baked(request, folder, scan):
    """The file of the picture's bake under D65+smooth."""
    line = ["bake", scan, *PICTURE, "--coherence-um", "4", "--illuminant", "D65+smooth", "--matter", request.param]
    line += ["-o", folder / request.param, "--no-cache", "--progress", "none"]
    assert parser.main([str(each) for each in line]) == 0
    return folder / request.param / "skin.exr"


def spoilt(baked, path, fault, lamps=None):
    """Write the bake's file with a changed table, and other claims for lamps; return its path."""
    table, record = atlas.read(baked)
    for key in ("format", "layout"):
        del record[key]
    if lamps is not None:
        record["delta_e"] = {**record["delta_e"], "lamps_claim": lamps}
    atlas.write_together({path: atlas.pack(fault(table))}, record)
    return path


def as_it_is(table):
    return table


@pytest.mark.night("test_claims_that_are_too_good_fail")
def test_a_bake_for_several_lamps_passes(run, baked, scan):
    """Each lamp's 95th percentile is the header's, within what two samples differ by."""
    status, out, err = run("check", baked, scan, *PICTURE, *QUICK, "--json", "-")
    facts, stated = json.loads(out), atlas.read(baked)[1]["delta_e"]["lamps"]
    assert (status, err, facts["faults"]) == (0, "", [])
    assert set(facts["lamps"]) == set(stated) == set(LAMPS)
    for lamp, figures in facts["lamps"].items():
        assert stated[lamp][1] <= figures["p95_claimed"]
        # Two samples of one distribution, drawn by two programs, as in test_verdict.py.
        assert figures["mean"] == pytest.approx(stated[lamp][0], rel=0.6, abs=0.01)
    assert facts["lamps"]["2700K"]["p95"] < 1 < facts["lamps"]["FL11"]["p95"]


@pytest.mark.night("test_claims_that_are_too_good_fail")
@pytest.mark.parametrize(("first", "factor"), [(3, 1.3), (3, -1.0), (5, 0.0)])
def test_wrong_channels_fail(refused, baked, scan, tmp_path, first, factor):
    """The channels beyond XYZ are read, each is in its place, and XYZ themselves stay right."""

    def fault(table):
        terms = table.terms.copy()
        terms[..., first:] *= factor
        return replace(table, terms=terms)

    told = refused("check", spoilt(baked, tmp_path / "wrong.exr", fault), scan, *PICTURE, *QUICK)
    assert "dE00 p95" in told and ", claimed" in told and "dE00 p99" not in told


@pytest.mark.night("tests/precompute/laboratory/check/test_verdict.py")
def test_a_wrong_zero_order_of_a_channel_fails(refused, baked, scan, tmp_path):
    def fault(table):
        zero_order = table.zero_order.copy()
        zero_order[:, 4] += 0.02
        return replace(table, zero_order=zero_order)

    told = refused("check", spoilt(baked, tmp_path / "wrong.exr", fault), scan, *PICTURE, *QUICK)
    assert "zero order off by" in told and "dE00" not in told


@pytest.mark.short("dielectric")
def test_claims_that_are_too_good_fail(run, baked, scan, tmp_path):
    path = spoilt(baked, tmp_path / "bold.exr", as_it_is, {"FL11": 0.02, "2700K": 9})
    status, out, err = run("check", path, scan, *PICTURE, *QUICK, "--json", "-")
    facts = json.loads(out)
    assert status == 1 and "under FL11, claimed 0.02" in err and "2700K" not in err
    assert set(facts["lamps"]) == {"2700K", "FL11"}


@pytest.mark.night("test_claims_that_are_too_good_fail")
@pytest.mark.parametrize("lamps", [
    [], {"moon": 1}, {"D65+smooth": 1}, {"smooth": 1}, {"tungsten": 1}, {"2700K": [1]}, {"2700K": "1"}, {"2700K": -1},
    {"2700K": True}, {f"{kelvins}K": 1 for kelvins in range(2000, 2033)},
])  # fmt: skip
def test_claims_that_cannot_be(refused, baked, scan, tmp_path, lamps):
    path = spoilt(baked, tmp_path / "odd.exr", as_it_is, lamps)
    assert "its header's lamps_claim is invalid" in refused("check", path, scan, *PICTURE, *QUICK)


def test_the_allowance_is_in_closed_form():
    """A tail of ln 5 between both percentiles falls to 1 / e over a length of 1, so the density beside the 95th is
    0.05. The share beside the 99th varies by 0.001, and beside the 95th by sqrt(0.05 0.95 / (0.01 0.99)) times that."""
    errors = Errors(1, 2, 2 + np.log(5), 9, 0, 0, 0, pairs=1000, share_deviation=0.001)
    allowance = 2 * 0.001 * np.sqrt(0.05 * 0.95 / (0.01 * 0.99)) / 0.05
    assert errors.p95_allowance == pytest.approx(allowance)
    assert errors.p95_claim == pytest.approx(2 + allowance)
    assert replace(errors, p95_of_w=3.0).p95_claim == 3
    assert Lamp(errors, 2.01 - allowance).keeps_claim and not Lamp(errors, 1.99 - allowance).keeps_claim


def test_the_allowance_is_two_deviations_of_the_percentile():
    """Of 400 samples of an exponential distribution, 600 pairs each, about 95 % lie within it. The estimate of the tail
    from each sample varies by a third, which leaves 91 % to 97 %."""
    rng, inside = np.random.default_rng(0), []
    for _ in range(400):
        de = rng.exponential(size=600)
        p95, p99 = np.percentile(de, [95, 99])
        errors = Errors(1, p95, p99, 9, 0, 0, 0, pairs=600, share_deviation=np.sqrt(0.01 * 0.99 / 600))
        inside.append(abs(p95 - np.log(20)) <= errors.p95_allowance)
    print(np.mean(inside))
    assert 0.9 < np.mean(inside) < 0.98

# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests as JSON: a round trip, and refusals that name the key."""

import pytest

from precompute.bake.request import COHERENCE_UM, DELTA_E, BakeRequest, Scan, request_from
from precompute.base.failure import GratingError
from precompute.cli.bake_verb import read_request
from precompute.reflectance.matter import DIELECTRIC, Matter, parse
from precompute.surface.steps.pipeline import DEFAULT, parse_steps

SCAN = {"source": "skin.png", "size_um": 4, "height_nm": 250}


def test_a_request_comes_back():
    scans = (Scan("skin.png", 4.0, 250.0), Scan("sample:cd"))
    layers = parse("chitin 1.7/80nm, 3x(1.5/9nm, gold/5nm), 1.5+0.1i")
    for kinds in ({"model": "patch", "patch_um": (20.1, 32.5)}, {"spread_deg": 2.5}, {"matter": layers}):
        request = BakeRequest(2.5, 7e-6, "E", scans=scans, **kinds)
        assert request_from(request.as_dict(), "test") == request
    # A record from before metals is of a dielectric.
    assert request_from({}, "test").matter == Matter(DIELECTRIC)
    for steps in ("none", "plane,poly:3,scars,rotate:-12.5"):
        asked = BakeRequest(levelling=parse_steps(steps))
        assert request_from(asked.as_dict(), "test") == asked
    # A request without a patch or a spread has no key for it, so older bakes keep their keys in the cache.
    assert not {"patch_um", "spread_deg"} & set(BakeRequest(model="patch").as_dict())
    # The record of a bake from before levelling had other steps, and a record without steps.
    assert request_from({"levelling": ["plane"]}, "test") == request_from({}, "test") == BakeRequest(levelling=DEFAULT)
    for delta_e in DELTA_E:
        for length_um in COHERENCE_UM:
            assert request_from({"delta_e": delta_e, "coherence_um": length_um}, "test").delta_e == delta_e


@pytest.mark.parametrize(("record", "fault"), [
    (None, "has no request"), ([], "has no request"), ("{}", "has no request"), (True, "has no request"),
    ({"delta_e": True}, "delta_e: give a number from 0.001 to 100"), ({"delta_e": "1"}, "delta_e: give"),
    ({"delta_e": 0}, "delta_e: give"), ({"delta_e": 1e-308}, "delta_e: give"), ({"delta_e": 101}, "delta_e: give"),
    ({"delta_e": None}, "delta_e: give"), ({"delta_e": [1]}, "delta_e: give"), ({"coherence_um": 1e5}, "coherence"),
    ({"coherence_um": 1e-9}, "coherence_um: give a number from 0.1"), ({"coherence_um": False}, "coherence"),
    ({"illuminant": ["D65"]}, "illuminant: give a text"), ({"illuminant": {}}, "illuminant: give a text"),
    ({"model": None}, "model: give one of"), ({"patch_um": 5}, "patch_um: give a list of two"),
    ({"patch_um": [1, 2, 3]}, "patch_um: give a list"), ({"patch_um": ["1", 2]}, "patch_um: give a number from 0 to"),
    ({"spread_deg": 0}, "spread_deg: give a number from 0.1 to 45"),
    ({"patch_um": [-1, 2]}, "patch_um: give a number from 0"),
    ({"matter": None}, "matter: give a text"), ({"matter": ["gold"]}, "matter: give a text"),
    ({"levelling": "plane"}, "levelling: give a list"),
    ({"levelling": [[]]}, "levelling: no such step; give one of"),
    ({"levelling": ["rotate"]}, "levelling: rotate: no such argument; give DEG"),
    ({"levelling": ["plane"] * 10**4}, "levelling: 10000 steps; give at most 50"),
    ({"needs": 1}, "not a needs file"), ({"needs": {}}, "not a needs"),
    ({"k" * 10**5: 0}, "kkk: no such key"), ({"scans": {}}, "scans: give a list"), ({"scans": [1]}, "scans: give each"),
    ({"scans": [SCAN] * 1001}, "scans: 1001 of them"), ({"scans": [{"source": 1}]}, "scans: give each"),
    ({"scans": [{"source": ""}]}, "not a file name"), ({"scans": [{"source": "a\0b"}]}, "not a file name"),
    ({"scans": [{"source": "\ud800"}]}, "not a file name"), ({"scans": [{**SCAN, "channel": 1}]}, "scans"),
    ({"scans": [{**SCAN, "size_um": True}]}, "scans: size_um: give a number"),
    ({"scans": [{**SCAN, "size_um": 1e-9}]}, "scans: size_um: give a number from 0.001"),
    ({"scans": [{**SCAN, "height_nm": 2e9}]}, "scans: height_nm: give a number from 0.001 to 1e.09"),
])  # fmt: skip
def test_what_no_bake_can_have_is_refused(record, fault):
    fault = fault.replace(": give", ": cannot be .*; give")
    with pytest.raises(GratingError, match=f"^asked: .*{fault}") as caught:
        request_from(record, "asked")
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(("text", "fault"), [
    ("", "is empty; give dielectric, mirror"), ("metal", "metal: is not a known matter; give dielectric, mirror"),
    ("1.5/100nm,, gold", "has an empty layer; write layers"), ("1.5/0nm, gold", "1.5/0nm: is 0nm thick; give more"),
])  # fmt: skip
def test_a_wrong_matter_names_the_request(text, fault):
    with pytest.raises(GratingError, match=f"^asked: matter: {fault}") as caught:
        request_from({"matter": text}, "asked")
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize("matter", ["mirror", "gold", "1.7+0.02i", "air/2nm, gold", "2x(1.6/8nm, 1.5/9nm), air"])
def test_each_kind_of_matter_comes_back(matter):
    request = BakeRequest(matter=parse(matter))
    assert request.as_dict()["matter"] == matter
    assert request_from(request.as_dict(), "test") == request


@pytest.mark.parametrize("content", [
    b"{", b"[" * 10**5 + b"]" * 10**5, b'{"delta_e": ' + b"1" * 5000 + b"}", b'{"delta_e": NaN}', b"\xff\xfe{\0}\0",
    b'{"delta_e": 1, "delta_e": 2}', b"", b" " * (1 << 21), b'{"scans": [{"source": "\\ud800"}]}',
])  # fmt: skip
def test_files_of_requests_that_are_none(tmp_path, content):
    path = tmp_path / "request.json"
    path.write_bytes(content)
    with pytest.raises(GratingError, match=f"^{path}: .*; |^{path}: .*give"):
        read_request(path)

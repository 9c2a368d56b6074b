# SPDX-License-Identifier: GPL-3.0-or-later
"""Gratings by their parameters on the command line."""

import pytest

from precompute.bake.cache import content_of, key_of
from precompute.bake.request import BakeRequest, Scan, request_from


def test_info_finds_the_period(run):
    status, out, err = run("info", "grating:blazed?lines_per_mm=400")
    assert (status, err) == (0, "")
    assert "\ngrating: 2500 nm at 0 deg, 26 repeats in the scan; " in out


def test_two_texts_of_one_grating_have_one_key_and_one_record():
    texts = ("grating:binary?period_nm=2500", "grating:binary?duty=0.50&lines_per_mm=400&seed=0")
    requests = [BakeRequest(scans=(Scan(text),)) for text in texts]
    keys = {key_of(content_of([scan.read() for scan in request.scans], request)) for request in requests}
    assert len(keys) == 1 and requests[0].as_dict() == requests[1].as_dict()
    record = requests[0].as_dict()
    assert request_from(record, "test").as_dict() == record
    other = BakeRequest(scans=(Scan("grating:binary?duty=0.4"),))
    assert key_of(content_of([other.scans[0].read()], other)) not in keys


def test_a_grating_has_no_folder(tmp_path):
    request = BakeRequest(scans=(Scan("grating:binary"),))
    assert request.at(tmp_path).scans == request.scans
    assert BakeRequest(scans=(Scan("grating:nonsense"),)).as_dict()["scans"][0]["source"] == "grating:nonsense"


@pytest.mark.parametrize("verb", ["info", "bake", "map", "dft", "check"])
def test_a_faulty_grating_is_refused_by_every_verb(refused, tmp_path, small_bake, verb):
    output = {"bake": ("-o", tmp_path), "map": ("-o", tmp_path / "a.png"), "dft": ("-o", tmp_path)}.get(verb, ())
    first = (small_bake,) if verb == "check" else ()
    assert "grating:blazed?duty=1: Blazed has no parameter 'duty'" in refused(
        verb, *first, "grating:blazed?duty=1", *output
    )


def test_help_names_the_kinds(run):
    assert "grating:KIND?NAME=VALUE&NAME=VALUE" in run("info", "--help")[1].replace("\n", " ")

# SPDX-License-Identifier: GPL-3.0-or-later
"""The speed benchmark: its references, its Pareto front, its page, and the verb on tiny pieces that take seconds."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from laboratory.speed import pareto_front
from laboratory.speed.candidates import _directions
from laboratory.speed.page import number, summary
from laboratory.speed.pareto_front import measure_all, pareto
from laboratory.speed.references import away_from_zero_order, ensemble_truths, exact_series
from laboratory.speed.surfaces import QUICK, SKINS, middle, skin, surfaces
from laboratory.verbs import PACKAGES
from laboratory.verbs import benchmark_verb as verb
from precompute.cli import parser
from precompute.colour.observer import wavelengths
from precompute.measure.errors import Pairs
from precompute.optics import coherence
from precompute.reference.reference import reference_xyz
from precompute.surface.relief import prepare
from precompute.surface.samples.catalogue import make_sample
from precompute.surface.samples.ruled_gratings import blazed

pytestmark = pytest.mark.night("tests/precompute/measure/test_metric.py")

ROOT = Path(__file__).resolve().parents[3]
TINY = replace(
    QUICK, piece_m=4e-6, coherence_m=3e-6, w_count=1, pairs=60, patch_pairs=20, delta_es=(3,), steps_nm=(20,),
    reference_nm=20, seconds_timed=0.001,
)  # fmt: skip


@pytest.fixture(scope="module")
def facts(tmp_path_factory, matplotlib):
    """The verb's JSON, with its folder and the result behind it."""
    folder, every, measured, results = tmp_path_factory.mktemp("benchmark"), surfaces, measure_all, []

    def kept(*arguments):
        results.append(measured(*arguments))
        return results[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(verb, "QUICK", TINY)
        patch.setattr(verb, "measure_all", kept)
        patch.setattr(pareto_front, "surfaces", lambda *arguments: every(*arguments)[2:])
        arguments = ["benchmark", "--quick", "--output", str(folder), "--json", str(folder / "facts.json")]
        assert parser.main([*arguments, "--shared", str(folder), "--progress", "none"], PACKAGES) == 0
    found = json.loads((folder / "facts.json").read_text())
    return {**found, "folder": folder, "result": results[0]}


def test_the_verb_tells_all(facts):
    assert {"processor", "cores", "numpy", "python"} <= set(facts["machine"])
    assert {row["surface"] for row in facts["rows"]} == {"xenopeltis"}
    methods = {row["method"] for row in facts["rows"]}
    assert {"bake", "reference", "chebyshev", "stam", "gem"} <= methods
    for row in facts["rows"]:
        assert row["seconds_per_million"] > 0
        assert row["preparation_seconds"] >= 0
        assert row["peak_bytes"] > 0
        assert {"table_bytes", "mean", "p95", "p99", "max", "relative_rms", "peak_angle_deg"} <= set(row)


def test_the_verb_writes_its_page(facts):
    text = (facts["folder"] / "speed.md").read_text()
    assert "A quick run" in text
    assert "images/speed_against_error.png" in text
    assert (facts["folder"] / "images" / "speed_against_error.png").stat().st_size > 1000
    for row in facts["result"].nearest("xenopeltis"):
        assert f"| {row.title if row.method == 'bake' else row.method} | " in text
    assert all(len(line) < 400 for line in text.splitlines())
    assert summary(facts["result"]).count("\n") > len(facts["rows"])


def test_a_refused_method_is_named(facts):
    """A relief of 819 nm is too deep for Taylor in single precision."""
    refused = {(one["surface"], one["method"]) for one in facts["refused"]}
    assert ("xenopeltis", "flss") in refused
    assert "refused: Xenopeltis, flss N " in summary(facts["result"])


def test_the_real_skins_are_taken_where_they_are(shared_data, tmp_path):
    for name in SKINS:
        assert skin(shared_data, name).source_name == f"{name}_65um.png"
        assert skin(tmp_path, name).source_name == f"sample:{name}"


def test_the_front_holds_what_nothing_beats():
    points = [(1, 9), (2, 5), (2, 4), (3, 4), (4, 1), (0.5, 20), (9, 1), (10, 0.5)]
    assert pareto(points) == [5, 0, 2, 4, 7]
    assert pareto([]) == []
    assert pareto([(1, math.inf)]) == []


def test_the_ensemble_s_reference_is_the_reference():
    relief = prepare(middle(make_sample("elaphe"), 5e-6))
    sigma_b = coherence.kernel_sigma(3e-6)
    truths = ensemble_truths(exact_series(relief, sigma_b), sigma_b, 1, pairs=60, lambdas=wavelengths(20e-9))
    exact, _ = reference_xyz(
        relief, (truths[0].pairs.u, truths[0].pairs.v), w=truths[0].w, sigma_b=sigma_b, step_m=20e-9
    )
    np.testing.assert_allclose(truths[0].scattered_xyz, exact, atol=1e-8 * exact.max())


def test_pairs_are_away_from_the_zero_order():
    rng = np.random.default_rng(0)
    wi, wr = (_directions(50).T for _ in range(2))
    pairs = Pairs(wi, wr, rng.random(50) < 0.5)
    kept = away_from_zero_order(pairs, 0.05)
    assert 0 < len(kept.u) < 50
    assert np.hypot(kept.u, kept.v).min() > 0.4


def test_a_middle_piece_keeps_its_pixels():
    whole = blazed()
    piece = middle(whole, 10e-6)
    assert piece.height_m.shape == (128, 128)
    assert not piece.periodic
    assert piece.pixel_size_m == whole.pixel_size_m
    assert middle(piece, 1.0).height_m.shape == (128, 128)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--shared", "nowhere"], "nowhere: there is no such folder"),
        (["--output", "README.md"], "is a file; name a folder"),
        (["--json", "nowhere/facts.json"], "its folder does not exist"),
    ],
)
def test_a_refusal_is_one_line(arguments, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "README.md").write_text("")
    assert parser.main(["benchmark", "--quick", *arguments], PACKAGES) == 1
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1


@pytest.mark.parametrize(
    ("value", "written"),
    [(0, "0"), (1234.5, "1,230"), (0.01234, "0.0123"), (2e-6, "2e-06"), (math.inf, "-"), (12, "12.0")],
)
def test_numbers_are_short(value, written):
    assert number(value) == written

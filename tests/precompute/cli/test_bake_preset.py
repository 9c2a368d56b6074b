# SPDX-License-Identifier: GPL-3.0-or-later
"""`bake --preset`: what it bakes, and what it refuses."""

import json

import pytest

from precompute.cli.bake_verb import request_of
from precompute.cli.parser import build_parser
from precompute.presets.presets import FOLDER, preset_names, read_preset

from .conftest import LASER, SHORT

QUICK = (*SHORT, *LASER, "--progress", "none")


def request(*argv):
    return request_of(build_parser(["bake"]).parse_args(["bake", "-o", "out", *argv]))


@pytest.mark.parametrize("name", preset_names())
def test_the_request_is_the_preset_s(name):
    assert request("--preset", name) == read_preset(name).request


def test_options_that_the_preset_leaves_free_count():
    found = request("--preset", "cd", "--delta-e", "3", "--coherence-um", "10", "--illuminant", "532nm")
    assert (found.delta_e, found.illuminant, str(found.matter)) == (3.0, "532nm", "plate 1.585, aluminium")
    assert found.coherence_length_m == 10 * 1e-6


def test_a_preset_of_one_s_own_is_a_file(tmp_path):
    (tmp_path / "mine.json").write_text((FOLDER / "cd.json").read_text())
    assert request("--preset", str(tmp_path / "mine.json"), *QUICK) == request("--preset", "cd", *QUICK)


def test_the_model_in_a_remedy_is_taken():
    assert request("--preset", "cd", "--model", "ensemble").model == "ensemble"
    assert request("--preset", "corn_snake", "--model", "patch").model == "patch"


def test_it_bakes_and_repeats_from_the_header(run, tmp_path):
    status, out, err = run("bake", "--preset", "silver_foil", "-o", tmp_path / "a", *QUICK, "--json", "-")
    assert (status, err) == (0, "")
    file = json.loads(out)["files"][0]
    again = request("--request", file)
    assert again == request("--preset", "silver_foil", *QUICK)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--preset", "toad"), "preset toad: there is no such preset; choose one of bluray, "),
        (("--preset", "cd", "sample:cd"), "--preset cd: a FILE is given too; give one of FILE, --request and --preset"),
        (("--preset", "cd", "--request", "a.json"), "--preset cd: --request is given too; give one of FILE, "),
        (("--preset", "cd", "--matter", "dielectric"), "--preset cd: --matter is given too; leave --matter out"),
        (("--preset", "cd", "--level", "plane"), "--preset cd: --level is given too; leave --level out"),
        (("--preset", "cd", "--size-um", "9"), "--preset cd: --size-um is given too; leave --size-um out"),
        (("--preset", "cd", "--model", "patch"), "and the preset is of plate 1.585, aluminium; take --model ensemble"),
    ],
)
def test_conflicts_are_one_line(refused, tmp_path, words, line):
    assert line in refused("bake", *words, "-o", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_help_names_each(capsys):
    with pytest.raises(SystemExit):
        build_parser(["bake"]).parse_args(["bake", "--help"])
    told = " ".join(capsys.readouterr().out.split())
    assert all(name in told for name in preset_names())

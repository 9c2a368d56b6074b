# SPDX-License-Identifier: GPL-3.0-or-later
"""Options for numbers, counts, names and paths: accepted values and refusals."""

import argparse
import ast
from pathlib import Path

import pytest

from devtools import ROOT
from laboratory.verbs import PACKAGES
from precompute.cli.arguments import count, name_argument, number, path_argument
from precompute.cli.parser import build_parser

VERBS = [name for texts in PACKAGES.values() for name in texts]
NO_NUMBERS = (
    "", " ", "-", "--", "nan", "NaN", "inf", "-inf", "Infinity", "1e400", "-1e400", "1e-308", "5e-324", "0", "-1",
    "1_0", " 2", "2 ", "2\n", "\t2", "0x2", "2,5", "2e", "e2", ".", "1" + "0" * 400, "0." + "0" * 400 + "1", "9" * 5000,
    "١", "２", "2²", "\udcff", "\ud800", "2\0", "two", "True", "None", "[2]", "x" * 10**6, "−2",
)  # fmt: skip


@pytest.mark.parametrize("read", [number(0.5, 9), count(1, 9)])
@pytest.mark.parametrize("text", NO_NUMBERS, ids=lambda text: ascii(text[:12]))
def test_what_is_no_number_is_refused_with_the_range(read, text):
    with pytest.raises(argparse.ArgumentTypeError) as caught:
        read(text)
    line = str(caught.value)
    assert " number from " in line and line.endswith("to 9") and len(line) < 100


@pytest.mark.parametrize(("text", "value"), [
    ("2", 2), ("+2.", 2), (".5", 0.5), ("5E-1", 0.5), ("0.9e1", 9), ("1e0", 1), ("0000000000002.50", 2.5),
])  # fmt: skip
def test_numbers_are_taken(text, value):
    assert number(0.5, 9)(text) == value


def test_counts_are_taken():
    assert [count(-3, 12)(text) for text in ("-3", "+7", "0", "012")] == [-3, 7, 0, 12]
    for text in ("1.0", "1e1", "13", "-4"):
        with pytest.raises(argparse.ArgumentTypeError, match="give a whole number from -3 to 12"):
            count(-3, 12)(text)


def test_names_are_not_empty():
    assert (name_argument("a b"), path_argument("a/b").name) == ("a b", "b")
    for read in (name_argument, path_argument):
        with pytest.raises(argparse.ArgumentTypeError, match="empty; give"):
            read("")


def options():
    """Every option with a value: the verb, the option, and its action."""
    verbs = build_parser(VERBS, PACKAGES)._subparsers._group_actions[0].choices
    assert set(verbs) == set(VERBS)
    nested = {
        f"{verb} {name}": inner
        for verb, parser in verbs.items()
        for action in parser._actions
        if isinstance(action, argparse._SubParsersAction)
        for name, inner in action.choices.items()
    }
    assert set(nested) == {"cache list", "cache prune", "cache verify"}
    for verb, parser in (verbs | nested).items():
        for action in parser._actions:
            if action.option_strings and action.nargs != 0:
                yield pytest.param(verb, action, id=f"{verb} {action.option_strings[-1]}")


@pytest.mark.parametrize(("verb", "action"), list(options()))
def test_every_option_has_a_type(verb, action):
    """Python's int and float accept too much, and Path accepts an empty text."""
    assert action.choices or action.type not in (int, float, Path, None)


FOLDERS = "precompute", "addon", "laboratory", "sample_scenes"
SOURCES = {path.relative_to(ROOT).as_posix(): path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")}


@pytest.mark.parametrize("name", SOURCES)
def test_no_command_line_takes_numbers_in_another_way(name):
    """No program's source uses int or float as an option's type, or a parser whose errors have several lines."""
    for node in ast.walk(ast.parse(SOURCES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            assert node.func.attr != "ArgumentParser"
            if node.func.attr == "add_argument":
                types = [word.value for word in node.keywords if word.arg == "type"]
                assert not [each for each in types if isinstance(each, ast.Name) and each.id in ("int", "float")]


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("each", ["--size-um=--", "--json=--", "-o--", "-o=--", "--output=--"])
def test_dashes_are_no_value(refused, verb, each):
    assert "`--` is not a value" in refused(verb, "sample:flat", each, status=2)


@pytest.mark.parametrize("argv", [
    ["info", "sample:flat", "--size-um", "3\n4"], ["info", "sample:flat", "--surplus\n\nmore"], ["in\r\nfo", "x"],
    ["map", "sample:flat", "-o", "a.png", "--method", "a\n\tb"], ["evaluate", "sample:flat", "--methods", "a\nb,"],
    ["info", "sample:flat", "--si"], ["info", ""], ["info", "sample:flat", "--json", ""], ["bake", "", "-o", "out"],
    ["bake", "sample:flat", "-o", ""], ["map", "sample:flat", "-o", ""], ["check", "", "sample:flat"],
    ["info", "sample:flat", "--progress", "x" * 10**5], ["info", "sample:flat", "--surplus", "x" * 10**5],
])  # fmt: skip
def test_a_refusal_is_one_line_whatever_is_given(refused, tmp_path, monkeypatch, argv):
    monkeypatch.chdir(tmp_path)
    assert len(refused(*argv, status=2)) < 600

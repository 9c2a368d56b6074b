# SPDX-License-Identifier: GPL-3.0-or-later
"""Untrusted JSON: what is read, and what is refused in one line."""

import json
import os

import pytest

from precompute.base.failure import GratingError
from precompute.base.strict import DEEPEST, LARGEST_BYTES, parse_json, read_json

REMEDY = "write one by the verb `needs` inside Blender"


def refused(text):
    """The one-line error for a text."""
    with pytest.raises(GratingError) as caught:
        parse_json(text, "needs.json", REMEDY)
    line = str(caught.value)
    assert line.startswith("needs.json: ") and line.endswith(f"; {REMEDY}")
    assert len(line.splitlines()) == 1 and len(line) < 200
    return line


@pytest.mark.parametrize("value", [
    None, True, 0, -1, 2**53 - 1, 1 - 2**53, 0.1, 1e308, "text", "ü\n\ud800", [], {}, {"a": [1, {"b": None}]},
])  # fmt: skip
def test_what_json_holds_comes_back(value):
    found = parse_json(json.dumps(value), "needs.json", REMEDY)
    assert found == value and type(found) is type(value)


@pytest.mark.parametrize("text", ["", " ", "{", "[1,]", "{} {}", "nul", "'a'", b"\xff\xfe", b'"\x80"', "\ufeff\ufeff1"])
def test_what_is_no_json_is_refused(text):
    assert "not JSON" in refused(text)


@pytest.mark.parametrize("text", ["NaN", "Infinity", "[-Infinity]", "1e999", "-1" + "0" * 400 + ".5"])
def test_numbers_that_are_not_finite_are_refused(text):
    assert "not a finite number" in refused(text)


@pytest.mark.parametrize("digits", [400, 5000, 10**6])
def test_integers_of_many_digits_are_refused(digits):
    for sign in ("", "-"):
        assert "digits" in refused(f'{{"format": {sign}{"7" * digits}}}')


def test_integers_that_double_precision_cannot_hold_are_refused():
    assert "digits" in refused(str(2**53))


@pytest.mark.parametrize("brackets", ["[]", ('{"a":', "}")])
def test_json_nested_deeply_is_refused(brackets):
    opened, closed = brackets
    for depth in (DEEPEST + 1, 900, 100_000):
        assert "nested too deeply" in refused(opened * depth + "1" + closed * depth)
        assert "not JSON" in refused(opened * depth)
    assert parse_json(opened * DEEPEST + "1" + closed * DEEPEST, "needs.json", REMEDY)


def test_a_key_that_stands_twice_is_refused():
    assert "twice" in refused('{"a": {"format": 1, "format": 2}}')


def test_a_text_without_end_is_refused():
    assert "KiB" in refused(" " * LARGEST_BYTES + "1")


def refused_file(path):
    with pytest.raises(GratingError) as caught:
        read_json(path, REMEDY)
    line = str(caught.value)
    assert line.startswith(f"{path}: ") and line.endswith(f"; {REMEDY}") and len(line.splitlines()) == 1
    return line


def test_a_file_is_read_with_or_without_a_mark_of_its_byte_order(tmp_path):
    for begins in (b"", b"\xef\xbb\xbf"):
        (tmp_path / "needs.json").write_bytes(begins + '{"ä": 1}'.encode())
        assert read_json(tmp_path / "needs.json", REMEDY) == {"ä": 1}


def test_what_is_no_file_is_refused(tmp_path):
    assert "No such file" in refused_file(tmp_path / "gone.json")
    assert "is not a file" in refused_file(tmp_path)
    assert "cannot be read" in refused_file(tmp_path / ("n" * 300))
    (tmp_path / "needs.json").write_bytes(b"\0")
    assert "not JSON" in refused_file(tmp_path / "needs.json")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no fifos")
def test_a_fifo_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "needs.json")
    assert "is not a file" in refused_file(tmp_path / "needs.json")


def test_no_more_of_a_file_is_read_than_may_be(tmp_path):
    with (tmp_path / "needs.json").open("wb") as file:
        file.truncate(1 << 40)
    assert "KiB" in refused_file(tmp_path / "needs.json")

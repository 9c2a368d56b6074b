# SPDX-License-Identifier: GPL-3.0-or-later
"""The coverage-guided search keeps files that reach new lines and finds files that break a reader."""

import random

from laboratory.benchmarks.hostile import guided
from laboratory.benchmarks.hostile.readers import FORMATS
from precompute.base.failure import GratingError
from precompute.surface.readers import scan_file


def test_what_reaches_new_lines_is_kept_and_what_raises_is_found():
    def take(data):
        if scan_file.is_numbers(data):
            return
        if b"\0" in data:
            raise KeyError("zero")
        raise GratingError("file", "no numbers", "save it again")

    search = guided.Search([b"1 2 3\n4 5 6\n"])
    search.run(take, 200, random.Random(1))
    assert len(search.kept) > 1
    assert search.reached
    assert {what for _, what in search.finds} == {"KeyError: 'zero'"}
    assert all(b"\0" in data for data, _ in search.finds)


def test_a_line_without_a_remedy_is_a_find():
    def refuse(data):
        raise GratingError("", "no", "")

    search = guided.Search([b"x"])
    search.run(refuse, 0, random.Random(1))
    assert search.finds == [(b"x", "no line with a remedy: no")]


def test_what_costs_seconds_is_a_find(monkeypatch):
    monkeypatch.setattr(guided, "_SECONDS_MAX", -1.0)
    search = guided.Search([b"x"])
    search.run(lambda data: None, 0, random.Random(1))
    assert len(search.finds) == 1 and search.finds[0][1].endswith(" s")


def test_whole_files_reach_their_readers(tmp_path, capsys):
    assert guided.main(["--count", "3", "--only", ".gsf"]) == 0
    assert ".gsf" in capsys.readouterr().out
    assert ".gsf" in FORMATS

# SPDX-License-Identifier: GPL-3.0-or-later
"""Foreign text in a message: one line, without control characters for a terminal."""

import pytest

from precompute.base.failure import GratingError, printable


@pytest.mark.parametrize(("text", "shown"), [
    ("scan.png", "scan.png"), ("a  b.png", "a  b.png"), ("Größe µm 格.png", "Größe µm 格.png"),
    ("a\nerror: b", "a\\nerror: b"), ("\x1b]0;title\x07\x1b[2J", "\\x1b]0;title\\x07\\x1b[2J"),
    ("a\rb\tc", "a\\rb\\tc"),
    ("\x9b31m", "\\x9b31m"), ("gnp\u202e.exe", "gnp\\u202e.exe"), ("a\u2028b\x85c", "a\\u2028b\\x85c"),
    ("\udcff.png", "\\udcff.png"), ("\U000e0041", "\\U000e0041"), ("", ""),
])  # fmt: skip
def test_what_is_shown_of_a_text(text, shown):
    assert printable(text) == shown
    assert str(GratingError(f"{text}: no scan; give another")) == f"{shown}: no scan; give another"


def test_a_long_text_is_cut_and_the_remedy_stays():
    told = str(GratingError("a" * 10**7 + "; bake it again"))
    assert len(told) < 10**4 and told.endswith("; bake it again")

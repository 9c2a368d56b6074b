# SPDX-License-Identifier: GPL-3.0-or-later
"""Foreign text in a message: one line, without control characters for a terminal."""

import pytest

from precompute.base.failure import GratingError, Setting, printable, spelled


@pytest.mark.parametrize(("text", "shown"), [
    ("scan.png", "scan.png"), ("a  b.png", "a  b.png"), ("Größe µm 格.png", "Größe µm 格.png"),
    ("a\nerror: b", "a\\nerror: b"), ("\x1b]0;title\x07\x1b[2J", "\\x1b]0;title\\x07\\x1b[2J"),
    ("a\rb\tc", "a\\rb\\tc"),
    ("\x9b31m", "\\x9b31m"), ("gnp\u202e.exe", "gnp\\u202e.exe"), ("a\u2028b\x85c", "a\\u2028b\\x85c"),
    ("\udcff.png", "\\udcff.png"), ("\U000e0041", "\\U000e0041"), ("", ""),
])  # fmt: skip
def test_what_is_shown_of_a_text(text, shown):
    assert printable(text) == shown
    assert str(GratingError(text or "a", "no scan", "give another")) == f"{shown or 'a'}: no scan; give another"


def test_a_long_text_is_cut_and_the_remedy_stays():
    told = str(GratingError("a" * 10**7, "", "bake it again"))
    assert len(told) < 10**4 and told.endswith(": bake it again")


FAILURE = GratingError("a.png", "it does not store its size", ("give ", Setting.SIZE_UM, ", or crop it"))


def test_a_setting_is_an_option_on_the_command_line():
    assert str(FAILURE) == "a.png: it does not store its size; give --size-um, or crop it"
    assert spelled(FAILURE.remedy) == "give --size-um, or crop it"
    assert (
        FAILURE.line("b.png", lambda setting: setting.name)
        == "b.png: it does not store its size; give SIZE_UM, or crop it"
    )


@pytest.mark.parametrize(("fields", "told"), [
    (("", "no memory", "crop it"), "no memory; crop it"), (("a.png", "", "crop it"), "a.png: crop it"),
    (("a.png", "broken", ""), "a.png: broken"), (("", "broken", ""), "broken"),
])  # fmt: skip
def test_an_empty_field_leaves_no_mark(fields, told):
    assert str(GratingError(*fields)) == told


def test_a_failure_of_a_part_names_the_whole():
    assert str(FAILURE.within("two scans")) == f"two scans: {FAILURE}"
    assert str(GratingError("", "no memory", "crop it").within("a.png")) == "a.png: no memory; crop it"


def test_every_setting_is_an_option():
    assert all(setting.value == "--" + setting.name.lower().replace("_", "-") for setting in Setting)

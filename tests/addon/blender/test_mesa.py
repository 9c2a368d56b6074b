# SPDX-License-Identifier: GPL-3.0-or-later
"""Anisotropic filtering is switched off only where Mesa renders on the processor."""

import os
import sys

import pytest

VARIABLE = "MESA_EXTENSION_OVERRIDE"


@pytest.fixture
def cards(addon, tmp_path, monkeypatch):
    """Linux with an empty folder of graphics cards."""
    monkeypatch.setattr(addon.mesa, "_CARDS", tmp_path)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv(VARIABLE, "")  # restores the variable after the test
    monkeypatch.delenv(VARIABLE)
    return tmp_path


def test_without_a_card_it_is_off(addon, cards):
    addon.mesa.filter_as_cards_do()
    assert "texture_filter_anisotropic" in os.environ[VARIABLE]


def test_a_card_keeps_it(addon, cards):
    (cards / "renderD128").touch()
    addon.mesa.filter_as_cards_do()
    assert VARIABLE not in os.environ


def test_other_systems_keep_it(addon, cards, monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    addon.mesa.filter_as_cards_do()
    assert VARIABLE not in os.environ


def test_what_the_user_has_set_stays(addon, cards, monkeypatch):
    monkeypatch.setenv(VARIABLE, "-GL_ARB_sync")
    addon.mesa.filter_as_cards_do()
    assert os.environ[VARIABLE] == "-GL_ARB_sync"

# SPDX-License-Identifier: GPL-3.0-or-later
"""Anisotropic filtering is switched off only where Mesa renders on the processor."""

import os
import sys

import bpy
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


def test_a_render_in_background_switches_it_off(addon, cards, scene, grating):
    """Before the first render of a file with diffraction, however the render was started."""
    addon.handlers.show_what_renders(scene)
    assert VARIABLE not in os.environ
    bpy.ops.grating.assign()
    addon.handlers.show_what_renders(scene)
    assert "texture_filter_anisotropic" in os.environ[VARIABLE]


def test_a_window_warns_of_it(addon, cards, scene, grating, monkeypatch):
    """There Mesa has read the variable already."""
    bpy.ops.grating.assign()
    scene.render.engine = addon.compat.eevee_engine()
    monkeypatch.setattr(addon.data_pictures, "has_window", lambda: True)
    (line,) = addon.data_pictures.resampled_pictures(scene)
    assert line.startswith("EEVEE draws on the processor here")
    scene.render.engine = "CYCLES"
    assert not addon.data_pictures.resampled_pictures(scene)

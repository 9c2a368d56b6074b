# SPDX-License-Identifier: GPL-3.0-or-later
"""The field for the spectrum of a grating's light."""

import importlib
import json

import bpy
import pytest

from devtools import EXTENSION

LAMP = "400:0.5 500:1 600:0.25"


def fields():
    return importlib.import_module(f"{EXTENSION}.addon.gratings.grating")


@pytest.fixture
def waves(scene, scan):
    """A grating that is not baked yet."""
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    return scene.natural_gratings.active()


@pytest.mark.parametrize(("typed", "asked"), [
    ("", "D65"), ("D65", "D65"), ("tungsten", "2700K"), ("3200k", "3200K"), ("fl11", "FL11"), ("532nm", "532nm"),
    (LAMP, LAMP),
])  # fmt: skip
def test_a_light_is_asked_for_and_given_back(waves, typed, asked):
    waves.illuminant = typed
    request = waves.bake_request()
    assert request.illuminant == asked
    waves.take_request(request)
    assert waves.illuminant == ("" if asked == "D65" else asked)
    assert waves.bake_request() == request


def test_a_file_s_spectrum_is_in_the_field(waves, tmp_path):
    """So the .blend file holds it, without the file."""
    path = tmp_path / "lamp.csv"
    path.write_text("400 2\n500 4\n600 1\n")
    waves.illuminant = str(path)
    assert waves.illuminant == LAMP
    path.unlink()
    assert waves.bake_request().illuminant == LAMP


@pytest.mark.parametrize(("typed", "told"), [
    ("moon", "waves: Lamp Spectrum: moon: is not a known illuminant"), ("0K", "0K: is out of range"),
    ("/none/lamp.csv", "cannot be read"), ("400:1 300:2", "is not a known illuminant"),
])  # fmt: skip
def test_a_light_that_is_none_stays_and_is_refused(waves, typed, told):
    waves.illuminant = typed
    assert waves.illuminant == typed
    with pytest.raises(RuntimeError, match=told):
        bpy.ops.grating.bake()


def test_a_grating_of_an_earlier_file_keeps_its_light(waves):
    """Before the field, only the request held it."""
    waves.request = json.dumps({"illuminant": "532nm"})
    assert waves.bake_request().illuminant == "532nm"
    waves.illuminant = "FL2"
    assert waves.bake_request().illuminant == "FL2"


def test_names_are_found_by_their_letters():
    assert fields().known_names("led-b")[:3] == ["LED-B1", "LED-B2", "LED-B3"]
    assert {"tungsten", "2700K", "D65", "FL11"} <= set(fields().known_names(""))
    assert fields().known_names("nothing of this name") == []

# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps above a diffracting plane 2 m wide at z = 0."""

import bpy
import pytest


def add_lamp(scene, name, kind="POINT", *, energy=100.0, height=2.0, **settings):
    """A lamp above the middle of the plane, in its own collection."""
    lamp = bpy.data.objects.new(name, bpy.data.lights.new(name, kind))
    lamp.location, lamp.data.energy = (0, 0, height), energy
    for key, value in settings.items():
        setattr(lamp.data, key, value)
    held = bpy.data.collections.new(name)
    scene.collection.children.link(held)
    held.objects.link(lamp)
    return lamp


def equal_lamps(scene, count, kind="POINT"):
    return [add_lamp(scene, f"L{k}", kind) for k in range(count)]


@pytest.fixture
def eight_lamps(addon, monkeypatch):
    """Let at most eight lamps light diffraction, so that a test of the choice among more needs few. The choice needs no
    nodes."""
    monkeypatch.setattr(addon.lighting, "show_lamps", lambda **_: None)
    monkeypatch.setattr(addon.brightest_lamps, "FOLLOWED_MAX", 8)
    monkeypatch.setattr(addon.lighting, "FOLLOWED_MAX", 8)


@pytest.fixture
def lit(scene, grating):
    """The scene, whose plane diffracts, without lamps."""
    assert bpy.ops.grating.assign() == {"FINISHED"}
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    yield scene
    bpy.data.batch_remove(list(bpy.data.collections))


@pytest.fixture
def ranked(addon, lit):
    """A function that chooses the lamps anew and returns the names of the chosen ones."""

    def names() -> list[str]:
        bpy.context.view_layer.update()
        addon.lighting.update_lamps(lit)
        return [lamp.name for lamp in addon.follow.followed_lamps(lit)]

    return names

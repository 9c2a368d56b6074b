# SPDX-License-Identifier: GPL-3.0-or-later
"""Two answers in place of one for each lamp (addon/materials/lamp_choice.py): the same light with little noise."""

import bpy
import numpy as np
import pytest

from .conftest import clear
from .lamp_scenes import PIXELS, add_camera, add_grating, add_plane, agree

ENGINES = ["cycles", "eevee"]
SAMPLES = 64
# Directions to eight suns around the plane.
AROUND = [(np.cos(turn), np.sin(turn), 1.0 + 0.2 * index) for index, turn in enumerate(np.arange(8) * 2.4)]


@pytest.fixture
def shown(stage, baked):
    """shown(engine, directions, every=, lights=, samples=) -> a plane under suns of two colours."""

    def render(engine, directions, *, every, lights="LAMPS", samples=1, same=False):
        add_plane()
        add_camera(stage)
        for index, to in enumerate(directions):
            colour = (1.0, 0.5, 0.2) if index % 2 else (0.4, 0.6, 1.0)
            sun = {"energy": 1.0} if same else {"energy": 1.0 + index, "angle": 0.02 * index, "color": colour}
            stage.lamp("SUN", to=to, name=f"Sun {index}", **sun)
        grating = add_grating(stage, baked[0])
        grating.every_lamp = every
        assert bpy.ops.grating.lights(lights=lights) == {"FINISHED"}
        assert bpy.ops.grating.assign() == {"FINISHED"}
        picture = stage.rgb(engine, PIXELS, samples, f"{engine} {every}")
        clear(stage.addon, stage.scene)
        return picture

    return render


@pytest.mark.short("cycles-REST")
@pytest.mark.parametrize("lights", ["LAMPS", "REST"])
@pytest.mark.parametrize("engine", ENGINES)
def test_the_light_is_that_of_every_lamp(shown, engine, lights):
    # EEVEE compiles its material for each lamp: three minutes for eight of them without a cache.
    suns = AROUND if engine == "cycles" else AROUND[:4]
    every, two = (shown(engine, suns, every=each, lights=lights, samples=SAMPLES) for each in (True, False))
    apart = two - every
    # One of all but the strongest is drawn. Its p is within a factor of some 4 of what it sends, and it sends less than
    # the strongest: at most the light itself for the standard deviation of a sample, an eighth of it for 64.
    noise = np.sqrt((apart**2).mean())
    assert 0 < noise < every.mean() / 8
    # Five standard errors of a mean over independent pixels; for rounding, half floats in EEVEE.
    assert abs(apart.mean()) < 5 * noise / PIXELS + every.mean() * (2**-10 if engine == "eevee" else 1e-4)


@pytest.mark.short("cycles")
@pytest.mark.parametrize("engine", ENGINES)
def test_up_to_three_lamps_nothing_is_drawn(shown, engine):
    every, two = (shown(engine, AROUND[:3], every=each) for each in (True, False))
    np.testing.assert_array_equal(two, every)


@pytest.mark.short("cycles")
@pytest.mark.parametrize("engine", ENGINES)
def test_suns_in_one_place_are_as_bright_as_their_sum(shown, engine):
    """Equal lamps are equally likely. One of them alone may be the strongest, and whichever is drawn stands for all."""
    place = [(0.1, 0.3, 1.0)] * 5
    agree(*(shown(engine, place, every=each, same=True) for each in (False, True)))


@pytest.mark.short("REST")
@pytest.mark.parametrize("lights", ["LAMPS", "REST"])
def test_each_of_many_lamps_leaves_a_material_room_in_cycles(stage, baked, lights):
    """A shader with more numbers than Cycles holds would be black: lamps of three kinds, each answered to, were."""
    add_plane()
    add_camera(stage)
    for index in range(stage.addon.brightest_lamps.FOLLOWED_MAX):
        place = np.array([np.cos(2.4 * index), np.sin(2.4 * index), 1.0 + 0.05 * index])
        stage.lamp(("SPOT", "AREA", "POINT")[index % 3], 2 * place, to=place, name=f"Lamp {index}", energy=10.0)
    grating = add_grating(stage, baked[0])
    assert bpy.ops.grating.lights(lights=lights) == {"FINISHED"}
    pictures = []
    for grating.every_lamp in (True, False):
        assert bpy.ops.grating.assign() == {"FINISHED"}
        pictures.append(stage.rgb("cycles", PIXELS, 8))
    every, two = pictures
    # Five standard errors of a mean over independent pixels.
    assert abs((two - every).mean()) < 5 * (two - every).std() / PIXELS
    assert (two - every).std() < every.mean()


@pytest.fixture
def boxes(stage, baked):
    """boxes(count, samples) -> a plane under soft boxes around it that share one light, by the table and closures."""

    def render(count, samples):
        add_plane()
        add_camera(stage)
        for index in range(count):
            x, y, z = AROUND[index % 4]
            name, energy = f"Box {index}", 40.0 / count
            stage.lamp("AREA", (2 * x, 2 * y, 2 * z), to=(x, y, z), name=name, energy=energy, size=0.2)
        add_grating(stage, baked[0])
        assert bpy.ops.grating.lights(lights="REST") == {"FINISHED"}
        assert bpy.ops.grating.assign() == {"FINISHED"}
        picture = stage.rgb("cycles", PIXELS, samples)
        clear(stage.addon, stage.scene)
        return picture

    return render


@pytest.mark.short("12")
@pytest.mark.parametrize("count", [12, "all"])
def test_many_soft_boxes_leave_a_material_room_in_cycles(boxes, stage, count):
    """They are as bright as four that have their light. A shader with more numbers than Cycles holds would be black."""
    count = stage.addon.brightest_lamps.FOLLOWED_MAX if count == "all" else count
    many, few = (boxes(each, SAMPLES) for each in (count, 4))
    # Five standard errors of a mean over independent pixels.
    assert abs((many - few).mean()) < 5 * (many - few).std() / PIXELS
    assert (many - few).std() < few.mean()

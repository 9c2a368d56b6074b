# SPDX-License-Identifier: GPL-3.0-or-later
"""An area lamp that is wide in the sky, by random points of it, against small lamps that fill its shape."""

import bpy
import numpy as np
import pytest

from .world_scenes import add_ball, add_world, assign, look_at_ball

# Small lamps along each side. Each is a twelfth of the large one's radius: 1 degree.
_SIDE = 6
_SAMPLES = 64
_AWAY = np.array((-2.0, -1.0, 1.5))


@pytest.fixture
def lamp(stage, skin):
    """A lamp 1.2 m wide and 0.6 m high, 2.7 m from a ball of the skin: half its width is 12 degrees."""
    add_ball()
    assign(stage, skin[0], "LAMPS")
    found = stage.lamp("AREA", tuple(_AWAY), to=(0, 0, 0), energy=100.0, size=1.2, name="Area")
    found.data.shape, found.data.size_y = "RECTANGLE", 0.6
    look_at_ball(stage)
    return found


def ball(stage, lights: str, samples: int = 1) -> np.ndarray:
    """The ball's middle by a choice of lights."""
    assert bpy.ops.grating.lights(lights=lights) == {"FINISHED"}
    return stage.rgb("cycles", 64, samples)[12:-12, 12:-12]


def by_small_lamps(stage, lamp) -> np.ndarray:
    """The same, by the table, as the mean over small lamps that fill the lamp."""
    bpy.context.view_layer.update()
    x, y, _ = (np.array(axis[:3]) for axis in lamp.matrix_world.transposed()[:3])
    width, height = lamp.data.size, lamp.data.size_y
    lamp.data.size, lamp.data.size_y = width / _SIDE, height / _SIDE
    assert bpy.ops.grating.lights(lights="LAMPS") == {"FINISHED"}
    total = 0.0
    for a in (np.arange(_SIDE) + 0.5) / _SIDE - 0.5:
        for b in (np.arange(_SIDE) + 0.5) / _SIDE - 0.5:
            lamp.location = _AWAY + a * width * x + b * height * y
            total = total + stage.rgb("cycles", 64)[12:-12, 12:-12]
    lamp.location, lamp.data.size, lamp.data.size_y = _AWAY, width, height
    return total / _SIDE**2


def test_a_wide_lamp_has_its_shape(stage, lamp):
    """Half the error of one Gaussian, whose colours are too pale. The error of the random points is mostly noise."""
    expected = by_small_lamps(stage, lamp)
    gaussian, points = ball(stage, "LAMPS"), ball(stage, "REST", _SAMPLES)
    brightest = expected.max(axis=-1)
    scattering = brightest <= np.percentile(brightest, 97)  # without the mirror image
    errors = [np.abs(each - expected)[scattering].mean() for each in (gaussian, points)]
    assert errors[1] < errors[0] / 2, errors


@pytest.mark.night("test_a_wide_lamp_has_its_shape")
def test_light_beside_a_wide_lamp_stays(stage, lamp):
    """A closure loses only what the lamp itself hides: the lamp stands before a white world, and is dark."""
    sky = add_world(stage)
    lamp.data.energy = 0.0
    alone = ball(stage, "REST", _SAMPLES).mean()
    lamp.data.energy = 1e-6
    beside = ball(stage, "REST", _SAMPLES).mean()
    sky.default_value = (0, 0, 0, 1)
    # The picture's mean is 0.998, and 0.993 if the closure loses all of the cone around the lamp.
    assert 0.996 < beside / alone < 1.0, beside / alone

# SPDX-License-Identifier: GPL-3.0-or-later
"""Holograms in a picture: what each pattern gives at a place, and the diffraction with it."""

from math import cos, pi, sin

import bpy
import numpy as np
import pytest
from PIL import Image

from .test_direction_source import look_down, positions

PIXELS = 128
ENGINES = ["cycles", "eevee"]
# EEVEE renders to half floats, and shown values are from 0 to 1.
TOLERANCE = 2**-11
# The range of the turn over pi, and of the logarithm of the stretch, that the values from 0 to 1 show.
SHOWN = 8
CELLS = 16


@pytest.fixture
def plane(stage):
    """A plane of 2 m that fills the picture, whose UV square it is, under a sun."""
    bpy.ops.mesh.primitive_plane_add(size=2)
    look_down(stage, 2)
    stage.lamp("SUN", to=(sin(0.5), 0.0, cos(0.5)), energy=1.0, angle=0.0)
    return bpy.context.object


def uv():
    """u and v at the pixels' centres."""
    return np.moveaxis(positions(PIXELS)[..., :2] / 2 + 0.5, -1, 0)


def shown(stage, plane, engine, group, **values):
    """The turn over pi, the logarithm of the stretch, and the share of the strength (PIXELS, PIXELS) of a pattern."""
    material, tree = stage.material("Shown")
    plane.data.materials.clear()
    plane.data.materials.append(material)
    at = tree.value(tree.node("ShaderNodeUVMap").outputs["UV"])
    made = tree.group(group, {"Vector": at, **{name.replace("_", " "): value for name, value in values.items()}})
    stretch = tree.math("LOGARITHM", made["Period Scale"], np.e)
    turn = made["Rotation"].times_plus(1 / SHOWN / pi, 0.5)
    colour = tree.vector(turn, stretch.times_plus(1 / SHOWN, 0.5), made["Strength"])
    tree.node("ShaderNodeOutputMaterial", tree.emission(colour, 1.0))
    turn, stretch, share = np.moveaxis(stage.rgb(engine, PIXELS), -1, 0)
    return (turn - 0.5) * SHOWN, (stretch - 0.5) * SHOWN, share


def test_dot_matrix_has_square_cells_with_uniform_numbers(stage, plane):
    group = stage.addon.hologram_nodes.pattern_group("DOT_MATRIX")
    choice = {"Cells": CELLS, "Turn": 0.4, "Period_Spread": 2.0}
    for engine in ENGINES:
        turn, stretch, share = shown(stage, plane, engine, group, **choice)
        width = PIXELS // CELLS
        for values, most in ((turn * pi, 0.4), (stretch, np.log(2.0))):
            cells = values.reshape(CELLS, width, CELLS, width).swapaxes(1, 2)
            assert np.ptp(cells, axis=(2, 3)).max() < SHOWN * pi * TOLERANCE, "one number in each cell"
            number = (cells[:, :, 0, 0] / most + 1) / 2
            assert number.min() > -0.03 and number.max() < 1.03  # SHOWN pi TOLERANCE / 0.4
            # Of n uniform numbers the mean has the standard deviation sqrt(1 / 12 n); four of them are allowed.
            assert abs(number.mean() - 0.5) < 4 * np.sqrt(1 / 12 / CELLS**2)
            beside = np.corrcoef(number[:, 1:].ravel(), number[:, :-1].ravel())[0, 1]
            assert abs(beside) < 4 / CELLS, "neighbours are independent"
        np.testing.assert_allclose(share, 1, atol=TOLERANCE)
    other = shown(stage, plane, "cycles", group, **choice, Seed=1.0)
    assert np.abs(other[0] - turn).max() > 0.1


@pytest.mark.parametrize("engine", ENGINES)
def test_cells_keep_square_on_a_wide_map(stage, plane, engine):
    group = stage.addon.hologram_nodes.pattern_group("DOT_MATRIX")
    turn, *_ = shown(stage, plane, engine, group, Cells=CELLS, Aspect=0.5)
    steps = [(np.abs(np.diff(turn, axis=axis)).max(axis=1 - axis) > 0.01).sum() for axis in (0, 1)]
    assert steps == [CELLS / 2 - 1, CELLS - 1]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("sectors", [0, 7])
def test_sunburst_points_outwards(stage, plane, engine, sectors):
    group = stage.addon.hologram_nodes.pattern_group("SUNBURST")
    choice = {"Twist": 0.3, "Sectors": sectors, "Center_X": 0.25, "Aspect": 0.8, "Period_Spread": 1.5}
    turn, stretch, _ = shown(stage, plane, engine, group, **choice)
    u, v = uv()
    angle = np.arctan2(0.8 * (v - 0.5), u - 0.25) % (2 * pi)
    if sectors:
        step = 2 * pi / sectors
        away = np.abs((angle / step + 0.5) % 1 - 0.5) > 0.05
        angle = (np.floor(angle / step) + 0.5) * step
        of_sectors = [stretch[away & (angle == each)] for each in np.unique(angle)]
        assert max(map(np.ptp, of_sectors)) < 2 * SHOWN * TOLERANCE and np.ptp(stretch) > 0.1
    else:
        away = (np.hypot(u - 0.25, v - 0.5) > 0.1) & ((np.abs(v - 0.5) > 0.01) | (u < 0.25))
        np.testing.assert_allclose(stretch, 0, atol=SHOWN * TOLERANCE)
    # A pixel's centre is uncertain by a hundredth of a pixel, at least 0.1 of the width away from the centre.
    atol = SHOWN * TOLERANCE * pi + 0.01 / PIXELS / 0.08
    np.testing.assert_allclose((turn * pi)[away], angle[away] + 0.3, atol=atol)


@pytest.mark.parametrize("engine", ENGINES)
def test_crystal_has_shards_with_one_number_each(stage, plane, engine):
    group = stage.addon.hologram_nodes.pattern_group("CRYSTAL")
    turn, stretch, _ = shown(stage, plane, engine, group, Shards=4.0, Turn=1.0, Period_Spread=2.0)
    flat = np.abs(np.diff(turn, axis=1)) < SHOWN * TOLERANCE
    # An edge of a shard crosses a line of pixels at most about twice per shard and line.
    assert 1 - 2.5 * 4 / PIXELS < flat.mean() < 1
    assert np.abs(turn * pi).max() <= 1.0 + 0.01 and np.ptp(turn * pi) > 1.0
    assert np.abs(stretch).max() <= np.log(2.0) + 0.01 and np.ptp(stretch) > 0.5
    # Four by four shards and those that reach in from outside.
    assert 12 <= len(np.unique(np.round(turn, 2))) <= 40


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("cells", [0, CELLS])
def test_a_picture_s_hue_turns_and_its_value_dims(stage, plane, engine, cells, tmp_path):
    """Quarters: pure green, pale violet, a dark grey, and a transparent red."""
    picture = np.zeros((32, 32, 4), np.uint8)
    picture[:16, :16], picture[:16, 16:] = (0, 255, 0, 255), (191, 127, 255, 255)
    picture[16:, :16], picture[16:, 16:] = (128, 128, 128, 255), (255, 0, 0, 51)
    Image.fromarray(picture).save(tmp_path / "quarters.png")
    image = stage.addon.hologram_nodes.load_picture(str(tmp_path / "quarters.png"))
    group = stage.addon.hologram_nodes.pattern_group("PICTURE", image)
    values = np.stack(shown(stage, plane, engine, group, Cells=cells, Saturated_Period=2.0))
    # Away from the quarters' edges, over which the cubic filter reaches two pixels of the picture's 32.
    middle = [values[:, y, x] for y in (PIXELS // 4, 3 * PIXELS // 4) for x in (PIXELS // 4, 3 * PIXELS // 4)]
    violet = (240 + 60 * (191 - 127) / (255 - 127)) / 360
    wanted = [
        (1 / 3, np.log(2), 1.0),
        (violet, 128 / 255 * np.log(2), 1.0),
        (0.0, 0.0, (128 / 255) ** 2.2),
        (0.0, np.log(2), 0.2),
    ]
    np.testing.assert_allclose(middle, wanted, atol=SHOWN * TOLERANCE)


@pytest.mark.short("cycles")
@pytest.mark.parametrize("engine", ENGINES)
def test_a_still_dot_matrix_and_a_plain_hue_are_the_plain_picture(stage, plane, gold, engine, tmp_path):
    """Against the same material with the numbers set by hand, at the settings of a real bake."""
    addon = stage.addon
    Image.new("RGB", (4, 4), (0, 255, 255)).save(tmp_path / "cyan.png")
    response = addon.direct_response.direct_response(gold[0])
    material, tree = stage.material("Gold")
    plane.data.materials.append(material)
    group = addon.skin.group_around("gold", response, shadows=False, lights="LAMPS")
    tree.node("ShaderNodeOutputMaterial", tree.group(group)["Shader"])
    addon.lighting.update_all_lamps()
    (node,) = addon.material.diffraction_nodes(material)
    node.inputs["Roughness"].default_value = 0.3

    def picture():
        return stage.rgb(engine, 32)

    plain = picture()
    assert plain.max() > 0
    still = {"Cells": 8.0, "Turn": 0.0, "Period Spread": 1.0}
    addon.hologram_nodes.put_hologram(node, addon.hologram_nodes.pattern_group("DOT_MATRIX"), still)
    # The same constants reach the same formula. The power of 1 and the sum with 0 are exact up to rounding, which moves
    # a reading of the table by 1e-6 of a texel; EEVEE's picture is in half floats.
    tolerance = {"rtol": 2**-10, "atol": 2**-10 * plain.max()}
    np.testing.assert_allclose(picture(), plain, **tolerance)
    addon.hologram_nodes.remove_hologram(node)
    node.inputs["Rotation"].default_value = pi / 2
    turned = picture()
    assert np.abs(turned - plain).max() > 0.1 * plain.max(), "the direction matters"
    node.inputs["Rotation"].default_value = 0.0
    image = addon.hologram_nodes.load_picture(str(tmp_path / "cyan.png"))
    addon.hologram_nodes.put_hologram(node, addon.hologram_nodes.pattern_group("PICTURE", image), {"Cells": 8.0})
    np.testing.assert_allclose(picture(), turned, **tolerance)

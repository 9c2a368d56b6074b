# SPDX-License-Identifier: GPL-3.0-or-later
"""The sheet of presets: which shape shows a preset, the stages, and how the tiles are joined. Nothing is rendered."""

import bpy
import numpy as np
import pytest
from PIL import Image

from precompute.presets.presets import preset_names, read_preset
from sample_scenes import preset_stage
from sample_scenes.preset_sheet import COLUMNS, ROWS, corner, join, shape_of, tile

WIDTH = 32


def test_discs_lie_and_printed_matter_bends():
    shapes = {name: shape_of(read_preset(name)) for name in preset_names()}
    assert [name for name, shape in shapes.items() if shape == "disc"] == ["bluray", "cd", "dvd"]
    assert shapes["record"] == "record"
    printed = ["brushed_aluminium", "gold_foil", "security_hologram", "silver_foil"]
    assert [name for name, shape in shapes.items() if shape == "sheet"] == printed
    assert set(shapes.values()) <= set(preset_stage.VIEWS)
    assert {light for _, light, _ in ROWS} == set(preset_stage.LIGHTS)


@pytest.mark.parametrize("light", preset_stage.LIGHTS)
@pytest.mark.parametrize("shape", preset_stage.VIEWS)
def test_a_stage_has_its_object_its_lamps_and_the_files_gratings(scene, shape, light, tmp_path):
    scene.natural_gratings.items.add().name = "Foil"
    file = str(tmp_path / "stage.blend")
    preset_stage.main(["--output", file, "--shape", shape, "--light", light])
    bpy.ops.wm.open_mainfile(filepath=file)
    assert bpy.data.objects["Preset"].data.uv_layers and bpy.context.scene.camera
    assert {lamp.type for lamp in bpy.data.lights} == {"SUN" if light == "suns" else "AREA"}
    assert [grating.name for grating in bpy.context.scene.natural_gratings.items] == ["Foil"]


def test_tiles_do_not_overlap():
    corners = np.array([corner(preset, row, WIDTH) for preset in range(2 * COLUMNS) for row in range(len(ROWS))])
    apart = np.abs(corners[:, None] - corners).max(axis=-1)
    assert apart[~np.eye(len(corners), dtype=bool)].min() >= WIDTH


def test_each_tile_is_in_its_row_and_column(tmp_path):
    presets = [read_preset(name) for name in preset_names()]
    colours = {}
    for index, preset in enumerate(presets):
        (tmp_path / preset.name).mkdir()
        for row, (_, light, engine) in enumerate(ROWS):
            colours[index, row] = (10 * index, 60 * row, 200)
            Image.new("RGB", (WIDTH, WIDTH), colours[index, row]).save(tile(tmp_path / preset.name, light, engine))
    sheet = join(presets, tmp_path)
    for (index, row), colour in colours.items():
        x, y = corner(index, row, WIDTH)
        assert sheet.getpixel((x, y)) == sheet.getpixel((x + WIDTH - 1, y + WIDTH - 1)) == colour
    left = np.asarray(sheet)[:, : corner(0, 0, WIDTH)[0]]
    assert left.max() > 100  # the titles of the rows

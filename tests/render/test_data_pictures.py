# SPDX-License-Identifier: GPL-3.0-or-later
"""A table is data that no renderer may resample. The add-on warns about settings that cause it."""

import bpy
import numpy as np
import pytest

from .test_radiance import assign, lamps, shape

# Few enough for the texture cache to use smaller sizes of a picture.
PIXELS = 24


@pytest.fixture
def lit(stage, baked, tmp_path):
    """The stage with a plane that shows the bake under a sun."""
    path = tmp_path / "table.exr"
    path.write_bytes(baked[0].read_bytes())
    mesh, (location, target, angle) = shape(stage, "plane")
    stage.camera(location, target, angle=angle)
    lamps(stage, "sun")
    assign(stage, mesh, path)
    render, cycles, system = stage.scene.render, stage.scene.cycles, bpy.context.preferences.system
    owners = {"render": render, "cycles": cycles, "system": system}
    names = [
        ("render", "use_simplify"), ("render", "use_auto_generate_texture_cache"), ("cycles", "texture_limit_render"),
        ("cycles", "texture_resolution_render"), ("system", "gl_texture_limit"),
    ]  # fmt: skip
    before = [(owners[of], key, getattr(owners[of], key)) for of, key in names if hasattr(owners[of], key)]
    yield stage
    for owner, key, value in before:
        setattr(owner, key, value)


def change_and_told(stage, addon, engine: str, change) -> tuple[float, list[str]]:
    """How much an engine's picture changes, relative to its largest value, and the warnings after the change."""
    before = stage.rgb(engine, PIXELS)
    change()
    after = stage.rgb(engine, PIXELS)
    return np.abs(after - before).max() / before.max(), addon.data_pictures.resampled_pictures(stage.scene)


def set_to(owner, **settings):
    """A function that changes settings; skips the test if this Blender lacks them."""
    for name in settings:
        if not hasattr(owner, name):
            pytest.skip(f"this Blender has no {name}")
    return lambda: [setattr(owner, name, value) for name, value in settings.items()]


@pytest.mark.parametrize(
    ("setting", "value", "remedy"),
    [
        ("texture_limit_render", "128", "set it to No Limit"),
        ("texture_resolution_render", 0.25, "set it to 1"),
    ],
)
def test_simplify_spoils_a_table_and_is_told(lit, addon, setting, value, remedy):
    """The picture of 600 x 868 texels is read as one of 128 or 217. There is no warning before Simplify is on."""
    set_to(lit.scene.cycles, **{setting: value})()
    changed, told = change_and_told(lit, addon, "cycles", set_to(lit.scene.render, use_simplify=True))
    assert changed > 0.1 and len(told) == 1 and remedy in told[0]
    assert addon.lighting.warnings_about(lit.scene, bpy.context.evaluated_depsgraph_get()) == told
    lit.scene.render.use_simplify = False
    assert addon.data_pictures.resampled_pictures(lit.scene) == []


@pytest.mark.parametrize("engine", ["cycles", "eevee"])
def test_the_preferences_limit_spoils_what_eevee_shows(lit, addon, engine):
    limit = set_to(bpy.context.preferences.system, gl_texture_limit="CLAMP_128")
    changed, told = change_and_told(lit, addon, engine, limit)
    if engine == "eevee":
        assert changed > 0.1 and len(told) == 1 and "Limit Size" in told[0]
    else:
        assert (changed, told) == (0, [])


def test_a_limit_that_is_large_enough_is_none(lit, addon):
    set_to(lit.scene.cycles, texture_limit_render="4096")()
    assert change_and_told(lit, addon, "cycles", set_to(lit.scene.render, use_simplify=True)) == (0, [])


def test_the_texture_cache_reads_a_table_that_is_not_packed_at_its_full_size(lit, addon):
    """The extension packs its pictures, and the texture cache ignores packed pictures. If an artist unpacks a picture,
    the cache reads a file with smaller sizes of it. Cycles chooses the size by how fast the texture coordinate changes
    between pixels. For a table it cannot know this rate, as the coordinate is a sum of numbers, not vectors. Other
    pictures may be spoiled, so the add-on warns."""
    cache = set_to(lit.scene.render, use_texture_cache=True, use_auto_generate_texture_cache=True)
    assert change_and_told(lit, addon, "cycles", cache) == (0, [])
    picture = bpy.data.images["table"]
    changed, told = change_and_told(lit, addon, "cycles", lambda: picture.unpack(method="USE_ORIGINAL"))
    # Less than a quarter of an 8-bit step.
    assert changed < 1e-3 and len(told) == 1 and told[0].startswith("table: ") and "pack it" in told[0]


def test_half_floats_hold_a_table_of_half_floats(lit, addon):
    picture = bpy.data.images["table"]
    assert picture.use_half_precision
    assert change_and_told(lit, addon, "cycles", lambda: setattr(picture, "use_half_precision", False)) == (0, [])


def test_a_render_in_background_tells_it(lit, capfd):
    set_to(lit.scene.cycles, texture_limit_render="128")()
    lit.scene.render.use_simplify = True
    lit.rgb("cycles", 8)
    assert "Simplify > Texture Limit resamples the diffraction's table; set it to No Limit" in capfd.readouterr().err

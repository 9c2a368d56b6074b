# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons Height Map, Spectrum and Chart: one image of each kind, renewed, small in the file, in the editor."""

import bpy
import numpy as np
import pytest

from tests.addon.conftest import reports

KINDS = ("HEIGHT", "SPECTRUM", "CHART")


@pytest.fixture
def surface(scene, scan):
    """An imported scan, without a bake."""
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    return scene.natural_gratings.active()


@pytest.fixture
def image_editor():
    """The first area of the window, as an Image Editor."""
    area = bpy.context.window_manager.windows[0].screen.areas[0]
    before, area.ui_type = area.ui_type, "IMAGE_EDITOR"
    yield area.spaces.active
    area.ui_type = before


def show(kind, **more):
    return bpy.ops.grating.show_picture(kind=kind, **more)


def pixels(image):
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_is_one_image_that_is_renewed(surface, baked, kind):
    surface.bake_path = str(baked)
    assert show(kind) == {"FINISHED"}
    (image,) = bpy.data.images
    before = pixels(image)
    assert image.size[:] == (512, 512) and before.std() > 0.05 and (before[..., 3] == 1).all()
    surface.name, surface.levelling = "Other", "rotate:40"
    assert show(kind, light_deg=10.0) == {"FINISHED"}
    (image,) = bpy.data.images
    assert image.name.endswith("of Other")
    assert np.abs(pixels(image) - before).max() > 0.1


def test_the_picture_stands_upright(scene):
    """The legend, on the lower edge, is below: Blender counts rows from the bottom."""
    bpy.ops.grating.import_height_map(filepath="sample:xenopeltis")
    show("HEIGHT")
    picture = pixels(bpy.data.images[0])[..., :3]
    assert picture[:20, 200:250].std() < 0.01  # the ground between both bars
    assert picture[-20:, 200:250].std() > 0.05  # the relief


def test_the_file_holds_it_small_and_saved(surface):
    """Blender asks nobody to save it. Its PNG is smaller than its pixels of 4 bytes."""
    show("HEIGHT")
    image = bpy.data.images[0]
    assert not image.is_dirty and 0 < image.packed_file.size < 512 * 512 * 4
    assert image.users == 0 and not image.use_fake_user


def test_an_open_image_editor_shows_it(surface, image_editor, capfd):
    told = reports(lambda: show("SPECTRUM"), capfd)
    assert image_editor.image.name == "Spectrum of waves"
    assert "Spectrum of waves: in the Image Editor" in told


def test_without_an_editor_the_report_names_it(surface, capfd):
    assert "Height Map of waves: open it in an Image Editor" in reports(lambda: show("HEIGHT"), capfd)


def test_what_is_missing_is_told_and_nothing_is_made(scene, surface, baked):
    with pytest.raises(RuntimeError, match="waves: not baked yet"):
        show("CHART")
    surface.source = "gone.png"
    with pytest.raises(RuntimeError) as told:
        show("HEIGHT")
    assert len(str(told.value).strip().splitlines()) == 1
    scene.natural_gratings.items.clear()
    bpy.ops.grating.load_bake(filepath=str(baked))
    with pytest.raises(RuntimeError, match="made from a bake, without a height map"):
        show("SPECTRUM")
    assert not bpy.data.images
    assert show("CHART") == {"FINISHED"}


def test_a_linked_picture_is_left_alone(surface, tmp_path):
    show("HEIGHT")
    image = bpy.data.images[0]
    bpy.data.libraries.write(str(tmp_path / "other.blend"), {image}, fake_user=True)
    bpy.data.images.remove(image)
    with bpy.data.libraries.load(str(tmp_path / "other.blend"), link=True) as (held, into):
        into.images = list(held.images)
    assert show("HEIGHT") == {"FINISHED"}
    assert sorted(each.library is None for each in bpy.data.images) == [False, True]
    bpy.data.batch_remove(list(bpy.data.libraries))

# SPDX-License-Identifier: GPL-3.0-or-later
"""The presets as assets: the library's files, its entry in the preferences, and an appended material in a scene."""

import math
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from precompute.presets.presets import read_preset
from tests.addon.conftest import add_camera, select
from tests.addon.layout import Layout, context_of

# The preset whose draft is baked soonest, and its title.
PRESET, TITLE = "gold_foil", "Gold Holographic Foil"
_MIB = 1 << 20
OWN = "11111111-2222-3333-4444-555555555555:My Things:My Things"


def everything():
    """The contents of the file: the names and user counts of each kind of data."""
    kinds = [own.identifier for own in bpy.data.bl_rna.properties if own.type == "COLLECTION"]
    return {kind: sorted((each.name_full, each.users) for each in getattr(bpy.data, kind)) for kind in kinds}


def entries(folder):
    """The preferences' entries of a library."""
    return [each for each in bpy.context.preferences.filepaths.asset_libraries if each.path == str(folder)]


@pytest.fixture(scope="module")
def library(extension, tmp_path_factory):
    """The folder of a library with one preset. It has a catalog of another already."""
    folder = tmp_path_factory.mktemp("library")
    (folder / "blender_assets.cats.txt").write_text(f"VERSION 1\n\n{OWN}\n")
    before = everything()
    assert bpy.ops.grating.make_assets(directory=str(folder), presets=PRESET) == {"FINISHED"}
    assert everything() == before, "the artist's file was touched"
    yield folder
    assert bpy.ops.grating.remove_assets(directory=str(folder)) == {"FINISHED"}
    assert entries(folder) == []
    assert [path.name for path in folder.iterdir()] == ["blender_assets.cats.txt"], "of others"


def test_the_library_has_a_small_file_for_each_preset_and_its_catalogs(library):
    assert sorted(path.name for path in library.iterdir()) == ["blender_assets.cats.txt", f"{PRESET}.blend"]
    assert (library / f"{PRESET}.blend").stat().st_size < 8 * _MIB
    lines = (library / "blender_assets.cats.txt").read_text().splitlines()
    assert lines.count("VERSION 1") == 1 and OWN in lines
    paths = [line.split(":")[1] for line in lines if "Natural Gratings" in line]
    kinds = ("Discs", "Foils", "Nature", "Snakes")
    assert paths == ["Natural Gratings", *(f"Natural Gratings/{kind}" for kind in kinds)]


def test_catalogs_keep_their_identifiers(addon):
    """Assets in artists' own libraries refer to them."""
    text = addon.catalogs.catalogs_text()
    assert "7073c2fb-469e-5029-9563-2c623b768cff:Natural Gratings/Snakes:Natural Gratings-Snakes\n" in text
    assert addon.catalogs.catalogs_text(text) == text and not addon.catalogs.has_other_catalogs(text)
    assert addon.catalogs.has_other_catalogs(f"{text}{OWN}\n")


@pytest.mark.parametrize(
    ("preset", "tags"),
    [
        ("cd", {"disc", "aluminium"}),
        ("corn_snake", {"snake", "dielectric"}),
        ("jewel_beetle", {"nature", "thin film"}),
        ("security_hologram", {"foil", "thin film"}),
    ],
)
def test_tags_tell_the_thing_and_its_matter(addon, preset, tags):
    assert set(addon.catalogs.tags_of(read_preset(preset))) == {"diffraction", "iridescent", *tags}


def test_the_library_is_listed_once_and_appends(addon, library):
    again = addon.library.list_library(library, [library / f"{PRESET}.blend"])
    assert "1 material (" in again
    (entry,) = entries(library)
    assert entry.import_method in ("APPEND", "APPEND_REUSE")


def test_an_asset_has_its_facts_and_no_path_of_this_machine(library, scene):
    path = str(library / f"{PRESET}.blend")
    with bpy.data.libraries.load(path, link=True, assets_only=True) as (there, into):
        assert there.materials == [TITLE]
        into.materials = [TITLE]
    (material,) = into.materials
    asset = material.asset_data
    catalogs = (library / "blender_assets.cats.txt").read_text()
    assert f"{asset.catalog_id}:Natural Gratings/Foils:" in catalogs
    assert {tag.name for tag in asset.tags} == {"diffraction", "iridescent", "foil", "gold"}
    assert (asset.author, asset.license) == ("Natural Gratings", "CC0") and "plate 1.5, gold" in asset.description
    assert min(material.preview.image_size) >= 128 and np.ptp(material.preview.image_pixels_float) > 0.1
    pictures = [image for image in bpy.data.images if image.library is not None]
    assert len(pictures) >= 2 and all(image.packed_file for image in pictures)
    assert all(image.filepath.startswith("//") for image in pictures if image.filepath)
    bpy.data.batch_remove([material.library])


@pytest.fixture
def stage(scene):
    """The plane under a sun and a camera, and what it renders."""
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 4, False
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 48, 48, 100
    add_camera(scene, (0, 0, 5))
    bpy.data.objects["Sun"].rotation_euler = (0, math.radians(35), math.radians(20))
    yield scene
    scene.camera = None


def rendered(scene, tmp_path):
    scene.render.filepath = str(tmp_path / "seen.exr")
    scene.render.image_settings.file_format = "OPEN_EXR"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    values = np.array(image.pixels[:]).reshape(48, 48, 4)[..., :3]
    bpy.data.images.remove(image)
    return values


def append(library):
    """Append the material as a drop from the Asset Browser does, and put it on the plane."""
    bpy.ops.wm.append(directory=f"{library / PRESET}.blend/Material/", filename=TITLE, clear_asset_data=True)
    material = bpy.data.materials[TITLE]
    plane = bpy.data.objects["Plane"]
    plane.data.materials.clear()
    plane.data.materials.append(material)
    return material


def test_an_appended_material_renders_as_the_preset_and_is_adopted(addon, library, stage, tmp_path):
    plane = bpy.data.objects["Plane"]
    select(plane)
    assert bpy.ops.grating.add_preset(preset=PRESET, assign=True) == {"FINISHED"}
    bpy.context.view_layer.update()
    added = rendered(stage, tmp_path)
    grating = stage.natural_gratings.active()
    group, material = grating.group, grating.material
    stage.natural_gratings.items.clear()
    plane.data.materials.clear()
    bpy.data.batch_remove([material, group, *bpy.data.images, *bpy.data.node_groups])
    appended = append(library)
    bpy.context.view_layer.update()
    assert not appended.asset_data and addon.material.diffraction_nodes(appended)
    shown = rendered(stage, tmp_path)
    assert added.max() > 0.01, "the sun's colours are in the picture"
    # The same nodes with the same random numbers, but Cycles may order its sums in single precision otherwise. Of all
    # presets on a sphere, the largest difference was 3e-6 of the brightest pixel.
    np.testing.assert_allclose(shown, added, rtol=0, atol=1e-5 * added.max())
    layout = Layout()
    addon.panel.GratingPanel.draw(SimpleNamespace(layout=layout), context_of())
    assert "grating.adopt" in layout.operators
    assert bpy.ops.grating.adopt() == {"FINISHED"}
    made = stage.natural_gratings.active()
    assert made.name == TITLE and made.material == appended and made.baked_file().is_file()
    # It can be baked at another quality, as its surface needs no file.
    assert made.source == read_preset(PRESET).request.scans[0].source and "period 1246 nm" in made.summary
    assert addon.grating.quality_of(made) == "DRAFT" and not addon.bakes.is_asked_otherwise(made)
    np.testing.assert_allclose(rendered(stage, tmp_path), added, rtol=0, atol=1e-5 * added.max())


def test_the_hologram_of_an_asset_is_fitted_when_it_is_adopted(addon, scene, grating):
    plane = bpy.data.objects["Plane"]
    plane.scale.y = 3
    assert bpy.ops.grating.assign() == {"FINISHED"}
    bpy.ops.grating.hologram(pattern="CRYSTAL")
    (node,) = addon.material.diffraction_nodes(grating.material)
    aspect = addon.hologram_nodes.hologram_of(node).inputs["Aspect"]
    bpy.context.view_layer.update()
    for marked, fitted in ((False, 1.0), (True, 3.0)):
        aspect.default_value = 1.0
        if marked:
            addon.varying_inputs.fit_hologram_later(plane.active_material)
        scene.natural_gratings.items.clear()
        assert bpy.ops.grating.adopt() == {"FINISHED"}
        assert aspect.default_value == pytest.approx(fitted)
    aspect.default_value = 2.0  # what an artist chose since then stays
    scene.natural_gratings.items.clear()
    assert bpy.ops.grating.adopt() == {"FINISHED"}
    assert aspect.default_value == 2.0


@pytest.mark.night("test_the_command_writes_a_library")
def test_an_unknown_preset_and_a_folder_that_is_a_file_are_one_line(scene, tmp_path):
    with pytest.raises(RuntimeError, match="preset tree: there is no such preset"):
        bpy.ops.grating.make_assets(directory=str(tmp_path / "new"), presets="tree")
    (tmp_path / "file").write_text("")
    with pytest.raises(RuntimeError, match="file: cannot be written"):
        bpy.ops.grating.make_assets(directory=str(tmp_path / "file"), presets=PRESET)
    with pytest.raises(RuntimeError, match="holds no asset library"):
        bpy.ops.grating.remove_assets(directory=str(tmp_path))
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_cancelling_leaves_no_file(addon, scene, tmp_path):
    job = addon.library_job.LibraryJob(tmp_path / "new")
    assert job.running
    job.cancel()
    assert not job.running and list(tmp_path.iterdir()) == []


def test_the_command_writes_a_library(addon, scene, tmp_path, capsys):
    assert addon.commands.execute(["assets", "-o", str(tmp_path / "share"), "--preset", PRESET]) == 0
    assert "1 material" in capsys.readouterr().out
    assert (tmp_path / "share" / f"{PRESET}.blend").is_file() and entries(tmp_path / "share") == []


def test_the_panel_offers_the_library(addon, scene, library, monkeypatch):
    layout = Layout()
    addon.panel.draw_assets(layout)
    assert layout.operators == ["grating.make_assets"]
    monkeypatch.setattr(addon.library, "library_folder", lambda: library)
    layout = Layout()
    addon.panel.draw_assets(layout)
    assert layout.operators == ["grating.make_assets", "grating.remove_assets"]

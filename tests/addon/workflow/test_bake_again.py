# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking a grating again: its materials show the new bake, and keep their names and the artist's settings."""

import bpy
import numpy as np
import pytest

from precompute.base.exr_reader import open_picture
from precompute.table.atlas import read_header


@pytest.fixture
def grating(scene, scan):
    """A grating, imported and baked coarsely."""
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    made = scene.natural_gratings.active()
    made.delta_e = 6.0
    bpy.ops.grating.bake()
    return made


def blocks():
    """The names of the used data-blocks that bakes and materials add."""
    kinds = (bpy.data.images, bpy.data.node_groups, bpy.data.materials)
    return sorted(one.name for each in kinds for one in each if one.users)


def shown_image(group):
    """(rows, cols, 3) of the picture that a Diffraction group reads."""
    response = next(node.node_tree for node in group.nodes if node.label == "Response")
    (image,) = {node.image for node in response.nodes if node.type == "TEX_IMAGE"}
    return np.array(image.pixels[:], np.float32).reshape(image.size[1], image.size[0], 4)[..., :3]


def image_in(path):
    return open_picture(path).pixels().astype(np.float32)


def test_materials_show_the_new_bake_in_place(scene, grating, addon):
    plane = bpy.context.object
    bpy.ops.grating.assign()
    bpy.ops.mesh.primitive_plane_add()
    painted = bpy.context.object
    painted.data.materials.append(bpy.data.materials.new("Paint"))
    addon.compat.enable_nodes(painted.active_material)
    bpy.ops.grating.add_diffraction()
    (node,) = addon.material.diffraction_nodes(painted.active_material)
    tree = painted.active_material.node_tree
    value = tree.nodes.new("ShaderNodeValue")
    tree.links.new(value.outputs[0], node.inputs["Roughness"])
    node.inputs["Rotation"].default_value = 0.3
    first, names, material, group = grating.bake_path, blocks(), grating.material, grating.group
    np.testing.assert_array_equal(shown_image(group), image_in(grating.baked_file()))
    coarse = shown_image(group)

    grating.delta_e = 0.5
    assert bpy.ops.grating.bake() == {"FINISHED"}
    assert grating.bake_path != first
    assert (grating.material, grating.group) == (material, group)
    assert blocks() == names
    fine = image_in(grating.baked_file())
    assert not np.array_equal(fine, coarse)
    np.testing.assert_array_equal(shown_image(group), fine)
    assert plane.active_material == material
    assert addon.material.diffraction_nodes(painted.active_material) == [node]
    assert node.node_tree == group
    assert node.inputs["Rotation"].default_value == pytest.approx(0.3)
    assert node.inputs["Roughness"].links[0].from_node == value
    assert node.inputs["Base"].is_linked and node.outputs["Shader"].is_linked


@pytest.mark.night("test_what_is_set_during_a_bake_is_not_noted_as_baked")
def test_an_image_that_an_artist_uses_elsewhere_stays(scene, grating, addon):
    bpy.ops.grating.assign()
    image = bpy.data.images["waves"]
    kept = bpy.data.textures.new("Kept", "IMAGE")
    kept.image = image
    grating.delta_e = 0.5
    bpy.ops.grating.bake()
    assert kept.image == image
    bpy.data.textures.remove(kept)


@pytest.mark.night("test_what_is_set_during_a_bake_is_not_noted_as_baked")
def test_gratings_of_one_file_have_their_own_bakes(scene, grating, scan, addon):
    """The same file at another size is another surface."""
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=5, height_nm=100)
    other = scene.natural_gratings.active()
    other.delta_e = 6.0
    bpy.ops.grating.bake()
    grating = scene.natural_gratings.items[0]
    sizes = [read_header(each.baked_file())[1]["request"]["scans"][0]["size_um"] for each in (grating, other)]
    assert sizes == [4, 5]


@pytest.mark.night("test_materials_show_the_new_bake_in_place")
def test_a_bake_written_over_is_assigned_anew(addon, scene, scan, tmp_path):
    """By the command line: the same file holds another bake at the second `assign`."""
    options = [str(scan), "--size-um", "4", "--height-nm", "100", "-o", str(tmp_path), "--no-cache"]
    file = tmp_path / "waves.exr"
    blend = ["--save", str(tmp_path / "a.blend")]
    for delta_e in ("6", "0.5"):
        assert addon.commands.execute(["bake", *options, "--delta-e", delta_e]) == 0
        assert addon.commands.execute(["assign", str(file), "--object", "Plane", *blend]) == 0
        grating = scene.natural_gratings.active()
        np.testing.assert_array_equal(shown_image(grating.group), image_in(file))


@pytest.mark.night("test_settings_that_changed_since_the_bake_are_noticed")
def test_a_metals_bake_holds_its_reflectance(grating):
    assert not read_header(grating.baked_file())[0].holds_reflectance
    grating.matter = "GOLD"
    assert bpy.ops.grating.bake() == {"FINISHED"}
    assert read_header(grating.baked_file())[0].holds_reflectance


def test_a_grating_whose_bake_undo_took_away_knows_it_again(scene, grating, addon):
    path, summary = grating.bake_path, grating.bake_summary
    grating.bake_path = grating.bake_summary = ""  # as undo leaves it
    assert addon.bakes.recall_bakes in bpy.app.handlers.undo_post
    assert addon.bakes.recall_bakes in bpy.app.handlers.redo_post
    addon.bakes.recall_bakes()
    assert (grating.bake_path, grating.bake_summary) == (path, summary)
    grating.bake_path, grating.delta_e = "", 0.7  # differs from the bake that was made
    addon.bakes.recall_bakes()
    assert grating.bake_path == ""


def test_settings_that_changed_since_the_bake_are_noticed(scene, grating, addon, tmp_path):
    assert not addon.bakes.is_asked_otherwise(grating)
    others = {"delta_e": 0.7, "coherence_um": 5.0, "spread_deg": 2.0, "size_um": 5.0, "matter": "GOLD"}
    for name, other in others.items():
        before = getattr(grating, name)
        setattr(grating, name, other)
        assert addon.bakes.is_asked_otherwise(grating), name
        setattr(grating, name, before)
        assert not addon.bakes.is_asked_otherwise(grating), name
    levelling = grating.levelling
    grating.levelling = "plane:robust"
    assert addon.bakes.is_asked_otherwise(grating)
    grating.levelling = levelling
    grating.source = str(tmp_path / grating.source.rsplit("/", 1)[-1])  # the same file, moved
    assert not addon.bakes.is_asked_otherwise(grating)


def test_what_is_set_during_a_bake_is_not_noted_as_baked(scene, grating, addon):
    request = grating.bake_request()
    facts = addon.baking.finished_bake(grating, request=request)
    grating.delta_e = 0.7
    addon.baking.record_bake(grating, facts, request)
    assert addon.bakes.is_asked_otherwise(grating)
    grating.delta_e = 6.0
    assert not addon.bakes.is_asked_otherwise(grating)


def test_what_was_given_for_one_file_is_not_offered_for_the_next(scene, scan):
    """Blender fills a dialog with the operator's last arguments."""
    properties = bpy.ops.grating.import_height_map.get_rna_type().properties
    for name in ("filepath", "size_um", "height_nm", "channel"):
        assert properties[name].is_skip_save, name


def test_a_scripts_engine_comes_back_where_compiling_fails(scene, addon, monkeypatch):
    from importlib import import_module

    shadow = import_module(f"{addon.package.__name__}.materials.shadow")
    monkeypatch.setattr(addon.compat, "HAS_RAYCAST", False)

    def fails():
        raise OSError("no such file")

    monkeypatch.setattr(shadow, "_text", fails)
    scene.render.engine = addon.compat.eevee_engine()
    tree = addon.builder.Tree(bpy.data.node_groups.new("Group", "ShaderNodeTree"))
    with pytest.raises(OSError):
        shadow.hit(tree, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), distance=1.0)
    assert scene.render.engine == addon.compat.eevee_engine()


def test_samples_have_their_proper_names(scene):
    from precompute.surface.samples.catalogue import SAMPLES, title_of

    titles = [title_of(name) for name in SAMPLES]
    assert titles == ["Flat", "Sinusoidal", "Binary", "Blazed", "Elaphe", "Xenopeltis", "CD", "DVD", "Blu-ray"]

# SPDX-License-Identifier: GPL-3.0-or-later
"""What Adopt recovers of a grating that another file has: its bake, its matter and the look of its material."""

import json

import bpy
import pytest

from tests.addon.conftest import select


def gratings():
    return bpy.context.scene.natural_gratings.items


def values(material, addon):
    """The numbers of a material's Diffraction node, its pattern's, and its base's."""
    (node,) = addon.material.diffraction_nodes(material)
    base = node.inputs["Base"].links[0].from_node
    pattern = addon.hologram_nodes.hologram_of(node)
    held = [node, base, *([] if pattern is None else [pattern])]
    return [
        (each.bl_idname, socket.name, tuple(value) if socket.type in ("RGBA", "VECTOR") else value)
        for each in held
        for socket in each.inputs
        if not socket.is_linked and (value := getattr(socket, "default_value", None)) is not None
    ]


def fields(grating):
    """What a grating's panel and materials go by, except its names and data-blocks."""
    names = (
        "matter", "layers", "plate_ior", "delta_e", "coherence_um", "spread_deg", "levelling", "lights", "shadows",
        "footprint",
    )  # fmt: skip
    look = grating.look
    kept = tuple(look.base_color), look.base_roughness, look.inputs
    return [getattr(grating, name) for name in names], grating.summary, grating.bake_summary, kept


@pytest.fixture
def copied(scene, addon, tmp_path):
    """A function that puts a preset on the plane, changes its material, brings the plane into an empty file by copying
    and pasting, or by an append where there is no window, and returns what it had."""

    def bring_preset(preset, pasted, changes):
        assert bpy.ops.grating.add_preset(preset=preset, assign=True) == {"FINISHED"}
        grating = scene.natural_gratings.active()
        (node,) = addon.material.diffraction_nodes(grating.material)
        for name, value in changes.items():
            addon.hologram_nodes.input_set_by_artist(node, name).default_value = value
        had = values(grating.material, addon), fields(grating)
        if pasted:
            select(bpy.data.objects["Plane"])
            bpy.ops.view3d.copybuffer()
            bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
            bpy.ops.view3d.pastebuffer()
        else:
            file = tmp_path / "object.blend"
            bpy.data.libraries.write(str(file), {bpy.data.objects["Plane"]})
            bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
            bpy.ops.wm.append(directory=f"{file}/Object/", filename="Plane")
        return had

    yield bring_preset
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


@pytest.mark.night("test_what_an_artist_set_is_the_look")
@pytest.mark.parametrize("pasted", [True, False])
@pytest.mark.parametrize("preset", ["gold_foil", "security_hologram"])
def test_a_pasted_preset_keeps_its_look(copied, addon, preset, pasted):
    had, held = copied(preset, pasted, {})
    assert not bpy.context.scene.render.use_high_quality_normals
    assert bpy.ops.grating.adopt() == {"FINISHED"}
    (made,) = gratings()
    assert fields(made) == held and made.baked_file().is_file()
    assert values(made.material, addon) == had
    assert bpy.context.scene.render.use_high_quality_normals
    assert not addon.bakes.is_asked_otherwise(made)
    bpy.ops.mesh.primitive_plane_add()
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert bpy.context.object.active_material == bpy.data.objects["Plane"].active_material
    assert bpy.ops.grating.new_material() == {"FINISHED"}
    assert made.material != bpy.data.objects["Plane"].active_material
    assert values(made.material, addon) == had


def test_what_an_artist_set_is_the_look(copied, addon):
    """Also where a pattern feeds the input. A value that no preset may have is left out."""
    had, _ = copied("security_hologram", False, {"Strength": 0.7, "Roughness": 0.25, "Rotation": 0.4})
    (material,) = bpy.data.materials
    (node,) = addon.material.diffraction_nodes(material)
    base = node.inputs["Base"].links[0].from_node
    base.inputs["Base Color"].default_value, base.inputs["Roughness"].default_value = (0.1, 0.2, 0.3, 1.0), 0.4
    pattern = addon.hologram_nodes.hologram_of(node)
    pattern.inputs["Seed"].default_value = 7.0
    node.inputs["IOR"].default_value = float("inf")
    assert bpy.ops.grating.adopt() == {"FINISHED"}
    look = gratings()[0].look
    assert json.loads(look.inputs) == {"Strength": 0.7, "Roughness": 0.25, "Rotation": 0.4}
    assert json.loads(look.hologram) == {"pattern": "dot_matrix", "inputs": {"Turn": 0.785, "Seed": 7.0}}
    assert tuple(look.base_color) == pytest.approx((0.1, 0.2, 0.3)) and look.base_roughness == pytest.approx(0.4)


def test_an_artists_own_material_gives_no_base(scene, grating, addon):
    """Its base belongs to its other nodes, for example to a coat."""
    paint = bpy.data.materials.new("Paint")
    addon.compat.enable_nodes(paint)
    bpy.context.object.data.materials.append(paint)
    bpy.ops.grating.add_diffraction()
    (node,) = addon.material.diffraction_nodes(paint)
    node.inputs["Base"].links[0].from_node.inputs["Roughness"].default_value = 0.9
    node.inputs["Strength"].default_value = 2.0
    scene.natural_gratings.items.clear()
    assert bpy.ops.grating.adopt() == {"FINISHED"}
    (made,) = gratings()
    assert made.material is None and json.loads(made.look.inputs) == {"Strength": 2.0}
    assert made.look.base_roughness == pytest.approx(0.6)


def test_the_matter_of_a_scans_bake_comes_from_its_header(scene, mirror, addon):
    """The header does not have the scan's folder, so the grating has no height map."""
    made = scene.natural_gratings.items.add()
    made.name, made.bake_path = "waves", str(mirror)
    bpy.ops.grating.assign()
    scene.natural_gratings.items.clear()
    assert bpy.ops.grating.adopt() == {"FINISHED"}
    (made,) = gratings()
    assert (made.matter, made.source) == ("MIRROR", "") and "without waves.png" in made.summary
    assert "colour error" in made.bake_summary

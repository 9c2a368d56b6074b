# SPDX-License-Identifier: GPL-3.0-or-later
"""Data-blocks of diffraction that an artist can delete, replace, edit, rename or unpack: every button and the panel
then work, repair the loss, or give the remedy in one line."""

import shutil
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from precompute.bake.request import request_from
from precompute.table.atlas import read_header
from precompute.table.sample_set import path_beside
from tests.addon.conftest import add_camera, reports
from tests.addon.layout import Layout, context_of

COMB = "grating_comb"


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """The folder of the file and bakes with which every test begins, and the folder to which the bakes are copied."""
    return tmp_path_factory.mktemp("kept"), tmp_path_factory.mktemp("bakes")


@pytest.fixture
def skin(scene, baked, kept, addon):
    """Two gratings in a separate folder, the first over paint on the plane, varied by the second; camera and world."""
    (held, folder), blend = kept, kept[0] / "skin.blend"
    for path in folder.iterdir():
        path.unlink()
    if not blend.exists():
        for name in ("waves", "second"):
            shutil.copy(baked, held / f"{name}.exr")
            shutil.copy(path_beside(baked), path_beside(held / f"{name}.exr"))
        with (held / "second.exr").open("ab") as file:  # a different file, like a different bake
            file.write(b"\0")
    for path in held.glob("*.exr"):
        shutil.copy(path, folder)
    if not blend.exists():
        build(scene, folder, addon)
        bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True)
    else:
        bpy.ops.wm.open_mainfile(filepath=str(blend))
    scene = bpy.context.scene
    first, second = scene.natural_gratings.items
    plane, painted = bpy.data.objects["Plane"], bpy.data.objects["Plane.001"]
    yield SimpleNamespace(scene=scene, addon=addon, plane=plane, painted=painted, first=first, second=second)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def build(scene, folder, addon):
    for name in ("waves", "second"):
        made = scene.natural_gratings.items.add()
        # Blender 4.5 compiles a script for shadows, which takes a second.
        made.name, made.bake_path, made.shadows = name, str(folder / f"{name}.exr"), False
    scene.natural_gratings.active_index = 0
    bpy.ops.grating.assign()
    bpy.ops.grating.vary(second="second", second_share=0.3)
    plane = bpy.context.object
    bpy.ops.mesh.primitive_plane_add(location=(3, 0, 0))
    painted = bpy.context.object
    painted.data.materials.append(bpy.data.materials.new("Paint"))
    addon.compat.enable_nodes(painted.active_material)
    bpy.ops.grating.add_diffraction()
    add_camera(scene, (0, 0, 10))
    scene.world = scene.world or bpy.data.worlds.new("World")
    plane.select_set(True)


def response(it, grating=None):
    return it.addon.response.response_in((grating or it.first).group)


def second_response(it):
    return response(it, it.second).group


def picture(it):
    return next(node.image for node in response(it).group.nodes if node.type == "TEX_IMAGE")


def sample_set(it):
    return next(node.image for node in response(it).world.nodes if node.type == "TEX_IMAGE" and node.label == "q")


def without_pictures(it):
    for tree in (response(it).group, response(it).world):
        for node in tree.nodes:
            if node.type == "TEX_IMAGE":
                node.image = None


def exchanged(it):
    picture(it).user_remap(bpy.data.images.new("Other", 8, 8))


def edited(it):
    image = picture(it)
    image.pixels[0] = 3.0
    image.update()


def edited_and_packed(it):
    image = picture(it)
    edited(it)
    image.pack()


def unpacked(_):
    """Like File > External Data > Unpack, into a folder that is lost later."""
    for image in bpy.data.images:
        if image.packed_file:
            image.filepath = "//gone/nothing.exr"
            image.unpack(method="REMOVE")


def frame_map(it):
    image = it.addon.tangent_frame.new_map("Direction Map", 16)
    it.addon.tangent_frame.note_mesh(image, it.plane, "UVMap")
    it.first.take_frame_source(it.addon.direction_source.DirectionSource("FRAME_MAP", frame_map=image))
    it.addon.skin.set_up(it.first.group, frame=it.first.frame_source())
    bpy.data.images.remove(image)


def comb(it):
    values = it.plane.data.attributes.new(COMB, "FLOAT_VECTOR", "CORNER")
    it.addon.making_materials.read_combs()
    it.plane.data.attributes.remove(values)


def renamed(_):
    for kind in ("images", "node_groups", "materials", "texts", "objects", "scenes", "worlds", "meshes", "lights"):
        for number, block in enumerate(list(getattr(bpy.data, kind))):
            block.name = f"Renamed {number}"


def bake_files(it):
    for path in (it.first.baked_file(), it.second.baked_file()):
        path_beside(path).unlink()
        path.unlink()


def bake_files_and_pictures(it):
    bake_files(it)
    bpy.data.batch_remove(list(bpy.data.images))


def bake_replaced(it):
    bpy.data.images.remove(picture(it))
    it.first.baked_file().write_bytes(b"no picture")


def scene_properties(it):
    it.scene.animation_data_clear()
    for key in [key for key, _ in it.scene.items() if key.startswith("ng_")]:
        del it.scene[key]


def everything_but_the_objects(_):
    for kind in ("images", "node_groups", "materials", "texts", "worlds"):
        bpy.data.batch_remove(list(getattr(bpy.data, kind)))


def of(kind, find):
    return lambda it: getattr(bpy.data, kind).remove(find(it))


# What an artist does, and a word of the line that Assign to Selected then reports; empty if it repairs everything.
DONE = {
    "the picture is deleted": (of("images", picture), ""),
    "the sample set's picture is deleted": (of("images", sample_set), ""),
    "the picture of wavelengths is deleted": (of("images", lambda it: bpy.data.images["Wavelengths D65"]), ""),
    "the picture of the second is deleted": (of("images", lambda it: bpy.data.images["second"]), "Mend Materials"),
    "all pictures are deleted": (lambda it: bpy.data.batch_remove(list(bpy.data.images)), "Mend Materials"),
    "nodes have no picture": (without_pictures, ""),
    "another picture takes its place": (exchanged, ""),
    "the picture is painted on": (edited, ""),
    "the picture is painted on and packed": (edited_and_packed, ""),
    "the pictures are unpacked and lost": (unpacked, "Mend Materials"),
    "the response is deleted": (of("node_groups", lambda it: response(it).group), ""),
    "the response to the world is deleted": (of("node_groups", lambda it: response(it).world), ""),
    "the second's response is deleted": (of("node_groups", second_response), "Variation again"),
    "the Diffraction group is deleted": (of("node_groups", lambda it: it.first.group), ""),
    "the second's Diffraction group is deleted": (of("node_groups", lambda it: it.second.group), ""),
    "the Lamp group is deleted": (of("node_groups", lambda it: it.addon.lamp_group.lamp_group()), ""),
    "the scripts are deleted": (lambda it: bpy.data.batch_remove(list(bpy.data.texts)), ""),
    "the material is deleted": (of("materials", lambda it: it.first.material), ""),
    "the direction map is deleted": (frame_map, "choose its Direction again"),
    "the comb is deleted": (comb, ""),
    "the lamp is deleted": (of("lights", lambda it: bpy.data.lights["Sun"]), ""),
    "the world is deleted": (of("worlds", lambda it: it.scene.world), ""),
    "the camera is deleted": (of("cameras", lambda it: it.scene.camera.data), ""),
    "the UV map is deleted": (lambda it: it.plane.data.uv_layers.remove(it.plane.data.uv_layers[0]), "no UV map"),
    "the scene's properties and drivers are deleted": (scene_properties, ""),
    "everything is renamed": (renamed, ""),
    "the bakes' files are deleted": (bake_files, ""),
    "the bakes' files and all pictures are deleted": (bake_files_and_pictures, "load it again"),
    "the bake's file is replaced, the picture deleted": (bake_replaced, "not a readable OpenEXR"),
    "the painted object's mesh is deleted": (of("meshes", lambda it: it.painted.data), ""),
    "everything but the objects is deleted": (everything_but_the_objects, ""),
}


def drawn(it):
    """Draw the panel with all of its steps; returns its warnings as one text."""
    layout = Layout(folded=False)
    it.addon.panel.GratingPanel.draw(SimpleNamespace(layout=layout), context_of())
    return layout.noted("ERROR")


def pressed(name, **options):
    """Press a button that works, is greyed out, or fails in one line; returns the line."""
    button = getattr(bpy.ops.grating, name)
    if not button.poll():
        return ""
    try:
        button(**options)
    except RuntimeError as fault:
        lines = str(fault).strip().splitlines()
        assert len(lines) == 1 and "Traceback" not in lines[0], fault
        return lines[0]
    return ""


def shown_pixels(it):
    image = picture(it)
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values


@pytest.mark.short(
    "the sample set's picture is deleted",
    "[all pictures are deleted",
    "nodes have no picture",
    "painted on and packed",
    "the response to the world",
    "the Lamp group",
    "the direction map",
    "properties and drivers",
    "everything is renamed",
)
@pytest.mark.parametrize("done", DONE)
def test_assign_mends_or_says_what_to_do(skin, done, capfd):
    wanted = shown_pixels(skin)
    DONE[done][0](skin)
    bpy.context.view_layer.update()
    drawn(skin)
    assigned(skin, done, wanted, capfd)


def assigned(it, done, wanted, capfd):
    """Press Assign to Selected, which must restore the picture's pixels or give the remedy."""
    capfd.readouterr()
    line = pressed("assign")
    assert DONE[done][1] in line + capfd.readouterr().out, "a word of the remedy"
    drawn(it)
    if not line and it.first.own_group:
        own = it.first.group
        assert not it.addon.lost_parts.lost_of_own(own) and not it.addon.lost_parts.lost_of_nodes(own)
        assert it.plane.active_material == it.first.material
        np.testing.assert_array_equal(shown_pixels(it), wanted)


@pytest.mark.short("the bakes' files")
@pytest.mark.parametrize("done", [
    "all pictures are deleted", "the response is deleted", "the second's response is deleted",
    "the Diffraction group is deleted", "the bakes' files and all pictures are deleted",
    "everything but the objects is deleted",
])  # fmt: skip
def test_every_other_button_and_the_panel_work(skin, done, capfd):
    wanted, request, facts = shown_pixels(skin), request_from({}, "test"), facts_of(skin.first)
    DONE[done][0](skin)
    bpy.context.view_layer.update()
    pressed("lights", lights="LAMPS")  # rebuilds the groups
    assigned(skin, done, wanted, capfd)
    for button, options in (
        ("vary", {"second": "second", "turn": 0.2}), ("add_diffraction", {}), ("add_diffraction_lamp", {}),
        ("mend", {}), ("show_direction", {}), ("remove_diffraction", {}),
    ):  # fmt: skip
        pressed(button, **options)
    drawn(skin)
    for event in ("save_pre", "load_post", "undo_post"):
        skin.addon.handlers.HANDLERS[event]()
    try:
        skin.addon.baking.record_bake(skin.first, facts, request)
    except skin.addon.child.GratingError as fault:
        assert len(str(fault).splitlines()) == 1
    drawn(skin)


def facts_of(grating):
    _, header = read_header(grating.baked_file())
    return {"delta_e": header["delta_e"], "coherence_um": 4.0, "tiles": 4, "blender_bytes": 1,
            "files": [grating.bake_path]}  # fmt: skip


@pytest.mark.night("tests/addon/operators/test_bake_needs.py")
def test_a_bake_after_its_picture_was_deleted(scene, scan):
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    grating = scene.natural_gratings.active()
    grating.delta_e = 6.0
    bpy.ops.grating.bake()
    bpy.ops.grating.assign()
    names = sorted(bpy.data.images.keys())
    bpy.data.batch_remove(list(bpy.data.images))
    assert bpy.ops.grating.bake() == {"FINISHED"}
    assert sorted(bpy.data.images.keys()) == names


@pytest.mark.night("tests/addon/ui/test_panel.py")
def test_the_panel_says_what_is_lost_and_offers_to_mend_it(skin, capfd):
    assert "Mend Materials" not in drawn(skin)
    bpy.data.batch_remove(list(bpy.data.images))
    assert "Diffraction waves: its picture was deleted; press Mend Materials" in drawn(skin)
    assert "mended: " in reports(bpy.ops.grating.mend, capfd)
    assert "Mend Materials" not in drawn(skin)
    assert "every diffraction material is whole" in reports(bpy.ops.grating.mend, capfd)


def test_a_group_of_no_grating_is_mended_from_its_pictures(skin):
    """The grating was removed from the list."""
    skin.scene.natural_gratings.items.clear()
    bpy.data.batch_remove([group for group in bpy.data.node_groups if group.name.startswith("Diffraction World")])
    bpy.ops.grating.mend()
    groups = [group for group in bpy.data.node_groups if skin.addon.skin.is_diffraction(group)]
    assert skin.addon.lost_parts.lost(groups) == []


def test_the_bake_s_files_come_back_from_the_pictures(skin):
    """Byte for byte: the pictures are packed as the files were."""
    first = skin.first.baked_file()
    contents = first.read_bytes(), path_beside(first).read_bytes()
    bake_files(skin)
    found = skin.addon.finding_bakes.bake_of(skin.first)
    assert found != first and (found.read_bytes(), path_beside(found).read_bytes()) == contents
    assert skin.first.baked_file() == found

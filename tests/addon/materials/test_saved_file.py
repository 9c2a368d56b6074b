# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole file that an earlier version of the extension saved, tests/addon/fixtures/format_9.blend.

Commit 5e2151b made it in Blender 4.5: its bakes have format 9, its responses the input Energy Conserving. In a checkout
of that commit beside this one, this script ran as `NATURAL_GRATINGS_CACHE=cache python make.py CHECKOUT`. The sample
set has 64 instead of 256 texels a side, for a small file.

    import importlib, json, os, sys, types
    import bpy, numpy as np
    from PIL import Image

    def module(name):
        return importlib.import_module(f"natural_gratings.{name}")

    package = sys.modules["natural_gratings"] = types.ModuleType("natural_gratings")
    package.__path__ = [sys.argv[1]]
    module("addon").register()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scan = os.path.abspath("waves.png")
    row = 0.5 + 0.5 * np.sin(2 * np.pi * 8 * (np.arange(64) + 0.5) / 64)
    Image.fromarray(np.tile(np.rint(row * 65535).astype(np.uint16), (64, 1))).save(scan)
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN")))
    bpy.ops.grating.import_height_map(filepath=scan, size_um=4, height_nm=100)
    grating = bpy.context.scene.natural_gratings.active()
    grating.delta_e, grating.coherence_um = 50, 0.6
    module("precompute.table.sample_set").SIZE = 64
    options = ["--size-um", "4", "--height-nm", "100", "--delta-e", "50", "--coherence-um", "0.6"]
    options += ["-o", "bakes", "--no-cache", "--json", "facts.json"]
    module("precompute.cli.parser").main(["bake", scan, *options])
    with open("facts.json") as file:
        module("addon.workflow.baking").record_bake(grating, json.load(file), grating.bake_request())
    bpy.ops.grating.assign()
    node = next(node for node in grating.material.node_tree.nodes if node.type == "GROUP")
    node.inputs["Energy Conserving"].default_value, node.inputs["Strength"].default_value = 0.25, 0.5
    for image in bpy.data.images:
        image.filepath_raw = f"//bakes/{image.name}.exr"
    grating.source, grating.bake_path = "//waves.png", "//bakes/waves.exr"
    bpy.data.batch_remove([each for each in bpy.data.workspaces if each != bpy.context.workspace])
    bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath("format_9.blend"), compress=True)
"""

import shutil
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from tests.addon.conftest import add_camera, reports, select
from tests.addon.layout import Layout, context_of

SAVED = Path(__file__).parents[1] / "fixtures" / "format_9.blend"
OLD = "Energy Conserving"
LINE = (
    "Diffraction waves: made by an earlier version of this extension, and shown as saved; "
    "to renew it, press Bake Grating, then Assign to Selected"
)


@pytest.fixture
def opened(extension, scan, tmp_path):
    """The file, opened in a folder with its scan and without its bake. Its plane is selected."""
    shutil.copy(SAVED, tmp_path)
    shutil.copy(scan, tmp_path)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / SAVED.name))
    select(bpy.data.objects["Plane"])
    yield tmp_path
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def active():
    """The active grating, looked up again because undo frees Python's references."""
    return bpy.context.scene.natural_gratings.active()


def drawn(addon):
    layout = Layout(folded=False)
    addon.panel.GratingPanel.draw(SimpleNamespace(layout=layout), context_of())
    return layout


def parts(tree):
    """The nodes of a group with their unlinked values, its links, and its pictures' bytes."""
    nodes = {
        node.name: (node.bl_idname, [_value(each) for each in node.inputs if not each.is_linked]) for node in tree.nodes
    }
    links = sorted(
        (link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier)
        for link in tree.links
    )
    pictures = {bytes(node.image.packed_file.data) for node in tree.nodes if node.type == "TEX_IMAGE"}
    return nodes, links, pictures


def _value(socket):
    value = getattr(socket, "default_value", None)
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def as_saved(name):
    """The parts of a node group in the file itself. No handler of the extension changes a linked group."""
    with bpy.data.libraries.load(str(SAVED), link=True) as (_, into):
        into.node_groups = [name]
    found = parts(into.node_groups[0])
    bpy.data.libraries.remove(into.node_groups[0].library)
    return found


def brightest():
    """The largest value that a small picture of the plane has."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 4, False
    scene.render.resolution_x = scene.render.resolution_y = 16
    bpy.data.objects["Sun"].rotation_euler.y = 0.3  # u = 0.3: the first orders of 500 nm are near
    add_camera(scene, (0, 0, 5))
    scene.render.filepath = bpy.path.abspath("//seen.exr")
    scene.render.image_settings.file_format = "OPEN_EXR"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    values = np.array(image.pixels[:]).reshape(-1, 4)[:, :3]
    bpy.data.images.remove(image)
    bpy.data.objects.remove(scene.camera)
    return values.max()


def is_as_saved(addon):
    (node,) = addon.material.diffraction_nodes(bpy.data.materials["Diffraction waves"])
    kept = {"Diffraction Direct waves", "Diffraction World waves"}
    assert {each.name for each in addon.response.own_trees(active().group)} == kept
    same = all(parts(bpy.data.node_groups[name]) == as_saved(name) for name in kept)
    return same and (node.inputs[OLD].default_value, node.inputs["Strength"].default_value) == (0.25, 0.5)


def used():
    """The names of the node groups and pictures that are used."""
    return sorted(each.name for each in (*bpy.data.node_groups, *bpy.data.images) if each.users)


def test_it_is_shown_as_saved_and_one_line_says_how_to_renew_it(addon, opened, capfd):
    assert bpy.data.objects["Plane"].active_material == active().material and is_as_saved(addon)
    assert addon.lost_parts.lost([active().group]) == [LINE]
    layout = drawn(addon)
    assert LINE in layout.noted("ERROR") and layout.noted("INFO").startswith("Baked by an earlier version")
    assert layout.operators.index("grating.bake") < layout.operators.index("grating.assign")
    assert reports(bpy.ops.grating.assign, capfd).count(LINE) == 1
    with pytest.raises(RuntimeError, match=LINE):
        bpy.ops.grating.mend()
    assert is_as_saved(addon)
    assert brightest() > 0.01
    (opened / "waves.png").unlink()
    with pytest.raises(RuntimeError, match=r"waves.png: cannot be read \(No such file or directory\)"):
        bpy.ops.grating.bake()
    assert is_as_saved(addon)


def test_a_bake_renews_it(addon, opened):
    assert bpy.ops.grating.bake() == {"FINISHED"} and bpy.ops.grating.assign() == {"FINISHED"}
    assert addon.lost_parts.lost([active().group]) == [] and "earlier" not in " ".join(drawn(addon).labels)
    (node,) = addon.material.diffraction_nodes(bpy.data.objects["Plane"].active_material)
    assert OLD not in node.inputs and node.inputs["Strength"].default_value == 0.5
    assert active().baked_file().is_file() and brightest() > 0.01


def test_undo_takes_the_new_bake_back(addon, opened):
    """In Blender 4.5 about half of such undos crashed, until replaced node groups were no longer deleted."""
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.grating.bake() == {"FINISHED"} and bpy.ops.grating.assign() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="renewed")
    names = used()
    bpy.ops.ed.undo()
    assert is_as_saved(addon) and addon.lost_parts.lost([active().group]) == [LINE]
    bpy.ops.ed.redo()
    assert addon.lost_parts.lost([active().group]) == [] and used() == names


def test_a_bake_of_an_earlier_version_without_a_material_says_what_to_do(addon, opened):
    """As after Remove, or for a grating that was baked and never assigned."""
    grating = active()
    bpy.data.batch_remove([grating.group, grating.material])
    folder = opened / "bakes"
    folder.mkdir()
    for image in bpy.data.images:
        if image.packed_file and image.name.startswith("waves"):
            (folder / f"{image.name}.exr").write_bytes(image.packed_file.data)
    with pytest.raises(RuntimeError, match=r"made by another version \(format 9\); bake it again"):
        bpy.ops.grating.assign()
    assert "grating.bake" in drawn(addon).operators
    assert bpy.ops.grating.bake() == {"FINISHED"} and bpy.ops.grating.assign() == {"FINISHED"}
    assert addon.lost_parts.lost([grating.group]) == []

# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons: import, bake, new material, assign, and the messages of their refusals."""

import importlib
import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

from devtools import EXTENSION, ROOT
from precompute.surface.readers.reader_registry import READERS
from precompute.table.atlas import read_header

# Enables the extension in an empty user folder and prints the modules that this loaded.
ENABLE = """
import json, os, sys, tempfile
from pathlib import Path
with tempfile.TemporaryDirectory() as folder:
    os.environ["BLENDER_USER_RESOURCES"] = folder
    import bpy
    import addon_utils
    from devtools import EXTENSION
    from devtools.extension import link_extension
    link_extension(Path(folder))
    before = set(sys.modules)
    assert addon_utils.enable(EXTENSION) is not None
    own = [name for name in set(sys.modules) - before if name.startswith(EXTENSION)]
    packages = sorted({"OpenEXR", "PIL", "xatlas"} & (set(sys.modules) - before))
    print(json.dumps([len(own), packages]))
"""


def request_module():
    """The extension's own module of requests; its classes differ from the ones this test could import."""
    return importlib.import_module(f"{EXTENSION}.precompute.bake.request")


def add_baked(scene, baked):
    grating = scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "waves", str(baked)
    scene.natural_gratings.active_index = 0
    return grating


def all_nodes(tree):
    """The nodes of a tree and of the groups in it."""
    for node in tree.nodes:
        yield node
        if node.type == "GROUP":
            yield from all_nodes(node.node_tree)


def test_import_adds_a_grating_with_its_facts(scene):
    assert bpy.ops.grating.import_height_map(filepath="sample:cd") == {"FINISHED"}
    grating = scene.natural_gratings.active()
    assert grating.name == "CD"
    assert "period 1600 nm at 0 deg" in grating.summary


def test_a_picture_without_a_size_is_refused(scene, scan):
    with pytest.raises(RuntimeError, match=r"Width \(um\) in the import dialog") as told:
        bpy.ops.grating.import_height_map(filepath=str(scan))
    assert "--" not in str(told.value)
    assert len(scene.natural_gratings.items) == 0


def test_a_real_scan_imports(scene, shared_data):
    bpy.ops.grating.import_height_map(filepath=str(shared_data / "nanosurf" / "grid.nid"))
    assert "period 317 nm" in scene.natural_gratings.active().summary


def test_the_skins_show_the_periods_of_their_gratings_and_where_their_relief_comes_from(scene, shared_data):
    for name, height_nm, told in (
        ("elaphe", 375, "relief 408 nm levelled (375 nm as scanned)\nperiod 1130 nm at 0 deg"),
        ("xenopeltis", 818.69, "relief 805 nm levelled (809 nm as scanned)\nperiod 1501 nm at 87 deg"),
    ):
        scan = shared_data / "snake" / f"{name}_65um.png"
        bpy.ops.grating.import_height_map(filepath=str(scan), size_um=65, height_nm=height_nm)
        assert scene.natural_gratings.active().summary == f"65 x 65 um\n{told}"


def test_bake_runs_and_is_recorded(scene, scan, tmp_path):
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    assert bpy.ops.grating.bake(directory=str(tmp_path)) == {"FINISHED"}
    grating = scene.natural_gratings.active()
    assert grating.bake_path == str(tmp_path / "waves.exr")
    assert grating.baked_file().is_file()
    assert grating.bake_summary.startswith("colour error ")


def test_a_bake_that_fails_tells_its_one_line(scene, scan, tmp_path):
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    scene.natural_gratings.active().coherence_um = 5000
    with pytest.raises(RuntimeError, match="waves.png: coherence of 5e.03 um: longer than the scan"):
        bpy.ops.grating.bake(directory=str(tmp_path))
    assert scene.natural_gratings.active().bake_path == ""
    assert list(tmp_path.iterdir()) == []


def test_cancelling_leaves_no_process_and_no_file(addon, scene, tmp_path):
    bpy.ops.grating.import_height_map(filepath="sample:elaphe")
    job = addon.baking.start_bake(scene.natural_gratings.active(), str(tmp_path))
    assert job.running
    job.cancel()
    assert not job.running
    assert list(tmp_path.iterdir()) == []


@pytest.mark.night("tests/addon/operators/test_add_grating.py")
def test_a_child_bakes_into_the_extension_s_own_cache(addon, scene, scan, tmp_path, monkeypatch):
    """Unless the user has set another; either way nothing is baked twice."""
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(tmp_path / "own"))
    assert addon.child.child_environment()["NATURAL_GRATINGS_CACHE"] == str(tmp_path / "own")
    monkeypatch.delenv("NATURAL_GRATINGS_CACHE")
    folder = Path(bpy.utils.extension_path_user(addon.cache_folder.EXTENSION, path="cache"))
    assert addon.child.child_environment()["NATURAL_GRATINGS_CACHE"] == str(folder)
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    grating = scene.natural_gratings.active()
    found = [addon.baking.bake_and_wait(grating, str(tmp_path / name))["cached"] for name in ("one", "two")]
    assert found == [False, True]
    assert len(list((folder / "entries").iterdir())) == 1
    assert addon.baking.bake_and_wait(grating, str(tmp_path), use_cache=False)["cached"] is False


@pytest.mark.night("tests/addon/operators/test_add_grating.py")
@pytest.mark.parametrize(
    ("options", "kept"),
    [
        ({"--illuminant": "E", "--delta-e": "2.3"}, {"illuminant": "E", "delta_e": 2.3}),
        (
            {"--model": "patch", "--coherence-um": "1.1", "--delta-e": "6", "--patch-um": "1.5,2"},
            {"model": "patch", "delta_e": 6.0, "patch_um": [1.5, 2.0]},
        ),
        ({"--spread-deg": "3.3", "--delta-e": "2"}, {"spread_deg": 3.3}),
        ({"--needs": {"format": 1, "u": [-1, 1], "light_radius_deg": 0.265}}, {"model": "ensemble"}),
    ],
)
def test_the_button_repeats_a_bake_of_the_command_line(addon, scene, scan, tmp_path, monkeypatch, options, kept):
    """With all options, shown in the panel or not: like precompute's command line it finds the cached bake."""
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(tmp_path / "cache"))
    if "--needs" in options:
        needs = tmp_path / "needs.json"
        needs.write_text(json.dumps(options["--needs"]))
        options = {"--needs": str(needs)}
    given = [str(scan), "--size-um", "4.1", "--height-nm", "100", *(word for pair in options.items() for word in pair)]
    report = tmp_path / "facts.json"
    assert addon.commands.execute(["bake", *given, "-o", str(tmp_path / "one"), "--json", str(report)]) == 0
    assert json.loads(report.read_text())["cached"] is False
    grating = scene.natural_gratings.active()
    asked = grating.bake_request().as_dict()
    assert {key: asked[key] for key in kept} == kept
    _, header = read_header(grating.baked_file())
    assert header["request"] == asked

    assert addon.baking.bake_and_wait(grating, str(tmp_path / "two"))["cached"] is True
    command = [sys.executable, "-m", "precompute", "bake", *given, "-o", str(tmp_path / "three"), "--json", str(report)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    assert json.loads(report.read_text())["cached"] is True


def test_a_grating_holds_a_whole_request(scene, scan):
    """It also holds further scans, of which the panel shows the first."""
    request_from = request_module().request_from
    record = {
        "scans": [
            {"source": str(scan), "size_um": 4.1, "height_nm": 100.0, "channel": None},
            {"source": "sample:blazed", "size_um": None, "height_nm": None, "channel": None},
        ],
        "delta_e": 2.3,
        "coherence_um": 7.7,
        "spread_deg": 2.2,
        "illuminant": "E",
        "matter": "1.46/200nm, aluminium",
        "needs": {"format": 1, "u": [-1.0, 0.5], "v": [-0.2, 0.2], "w": [1.0, 1.9], "footprint": 0.01},
    }
    request = request_from(record, "test")
    grating = scene.natural_gratings.items.add()
    grating.take_request(request)
    assert (grating.source, grating.channel, grating.matter) == (str(scan), "", "LAYERS")
    assert grating.spread_deg == pytest.approx(2.2)
    assert grating.bake_request() == request


def test_a_grating_without_a_height_map_cannot_be_baked(scene, baked):
    add_baked(scene, baked)
    with pytest.raises(RuntimeError, match="waves: made from a bake, without a height map"):
        bpy.ops.grating.bake()


def test_a_request_that_no_bake_can_have_names_the_grating(scene, scan):
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    scene.natural_gratings.active().coherence_um = 0.05
    with pytest.raises(RuntimeError, match="waves: coherence_um: cannot be .*; give a number from 0.1 to 10000"):
        bpy.ops.grating.bake()


def test_the_import_dialog_names_every_format_that_can_be_read(scene):
    tooltip = bpy.types.GRATING_OT_import_height_map.description(bpy.context, SimpleNamespace(filepath=""))
    for reader in READERS:
        assert reader.name in tooltip


def test_enabling_loads_no_reader_and_no_optics():
    """In a separate process: slow modules load at first use. Before, half a second of Blender's start was 145 modules
    of this project, OpenEXR and Pillow among them."""
    done = subprocess.run([sys.executable, "-c", ENABLE], cwd=ROOT, check=True, capture_output=True, text=True)
    count, packages = json.loads(done.stdout.splitlines()[-1])
    assert packages == []
    assert count <= 100


def test_the_cache_of_an_add_on_that_is_no_extension(addon, monkeypatch):
    monkeypatch.delenv("NATURAL_GRATINGS_CACHE")
    monkeypatch.setattr(addon.cache_folder, "EXTENSION", "natural_gratings")
    assert addon.cache_folder.cache_folder() == Path.home() / ".cache" / "natural-gratings"


def test_the_material_needs_no_extension(scene, baked):
    add_baked(scene, baked)
    assert bpy.ops.grating.new_material() == {"FINISHED"}
    material = scene.natural_gratings.active().material
    assert material.animation_data is None and material.node_tree.animation_data is None
    assert material.cycles.emission_sampling == "NONE"
    assert material.cycles.use_bump_map_correction is False
    assert sorted(image.name for image in bpy.data.images) == ["Wavelengths D65", "waves", "waves.lobes"]
    for image in bpy.data.images:
        assert image.packed_file is not None
        assert image.colorspace_settings.name == "Non-Color"
    look_ups = [node for node in all_nodes(material.node_tree) if node.type == "TEX_IMAGE"]
    assert {node.image for node in look_ups} == set(bpy.data.images)


def test_assign_fills_the_active_slot_alone(scene, baked):
    add_baked(scene, baked)
    plane = bpy.context.object
    kept = bpy.data.materials.new("Kept")
    for _ in range(2):
        plane.data.materials.append(kept)
    plane.active_material_index = 1
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert plane.material_slots[0].material == kept
    assert plane.material_slots[1].material == scene.natural_gratings.active().material


def test_assigning_twice_makes_one_material(scene, baked):
    add_baked(scene, baked)
    bpy.ops.grating.assign()
    bpy.ops.grating.assign()
    assert [m.name for m in bpy.data.materials] == ["Diffraction waves"]


def test_assign_without_a_uv_map_changes_nothing(scene, baked):
    add_baked(scene, baked)
    plane = bpy.context.object
    layer = plane.data.uv_layers[0]
    plane.data.uv_layers.remove(layer)
    with pytest.raises(
        RuntimeError, match="no UV map.*; press Comb Grating, or choose Object Axis as Direction, or unwrap"
    ):
        bpy.ops.grating.assign()
    assert not plane.material_slots and not bpy.data.materials


@pytest.mark.night("test_assigning_twice_makes_one_material")
@pytest.mark.parametrize("button", ["comb", "direction"])
def test_the_remedies_for_a_missing_uv_map_work(scene, baked, button):
    """The remedies that the refusal names and that need no UV map."""
    add_baked(scene, baked)
    plane = bpy.context.object
    plane.data.uv_layers.remove(plane.data.uv_layers[0])
    if button == "comb":
        bpy.ops.grating.comb(source="X")
    else:
        bpy.ops.grating.direction(kind="AXIS", axis="X")
    assert bpy.ops.grating.assign() == {"FINISHED"}


def test_assign_without_a_lamp(scene, baked):
    add_baked(scene, baked)
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert bpy.ops.grating.add_sun() == {"FINISHED"}
    assert "ng_key_0_place" in scene


def test_buttons_say_why_they_are_grey(scene, baked):
    assert not bpy.ops.grating.bake.poll() and not bpy.ops.grating.assign.poll()
    add_baked(scene, baked)
    assert bpy.ops.grating.bake.poll() and bpy.ops.grating.assign.poll()
    bpy.ops.object.select_all(action="DESELECT")
    assert not bpy.ops.grating.assign.poll()


def test_a_bake_that_is_gone_is_told(scene, tmp_path):
    add_baked(scene, tmp_path / "gone.exr")
    with pytest.raises(RuntimeError, match=f"waves: its bake gone.exr is gone from the folder {tmp_path.name}; load"):
        bpy.ops.grating.assign()


def test_a_bake_that_is_gone_from_the_cache_is_named_without_its_path(scene, addon):
    grating = add_baked(scene, addon.cache_folder.cache_folder() / "bakes" / "0123456789abcdef" / "gone.exr")
    grating.source = "sample:flat"
    with pytest.raises(RuntimeError, match="waves: its bake gone.exr is gone from the cache; press Bake Grating again"):
        bpy.ops.grating.assign()
    assert not bpy.data.materials and grating.material is None


@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="Blender 4.5 does not show flattened trees")
@pytest.mark.parametrize(
    ("bake", "reflectances", "lamp_nodes", "rest_nodes"), [("baked", 0, 281, 95), ("mirror", 1, 284, 123)]
)
def test_a_lamp_costs_no_more_than_its_budget_of_nodes(scene, request, bake, reflectances, lamp_nodes, rest_nodes):
    """Measured with three terms. The budgets reveal any growth."""
    baked = request.getfixturevalue(bake)
    add_baked(scene, baked)
    bpy.ops.grating.new_material()
    bpy.ops.grating.lights(lights="LAMPS")
    material = scene.natural_gratings.active().material

    def nodes():
        flat = material.inline_shader_nodes()
        return [node.type for node in flat.node_tree.nodes]

    one = nodes()
    layout, _ = read_header(baked)
    # Two levels with one look-up for each term, and one for the zero order.
    assert one.count("TEX_IMAGE") == 2 * layout.terms + 1
    lamp = bpy.data.objects.new("Second", bpy.data.lights.new("Second", "POINT"))
    scene.collection.objects.link(lamp)
    bpy.context.view_layer.update()
    # Each term takes eight nodes.
    assert len(nodes()) - len(one) <= lamp_nodes + 8 * (layout.terms - 3)
    lamps_only = len(nodes())
    bpy.ops.grating.lights(lights="REST")
    rest = nodes()
    # One level of the table, two look-ups for q and W, one wavelength, the zero order, and a mirror's reflectance.
    # Lamps have no zero order here.
    of_rest = layout.terms + 2 + 1 + 1 + reflectances
    assert rest.count("TEX_IMAGE") == 2 * 2 * layout.terms + of_rest
    assert len(rest) - lamps_only <= rest_nodes + 8 * (layout.terms - 3)


def test_no_digits_at_the_pointer():
    """Blender shows digits at the pointer whenever progress_begin is called."""
    sources = [path for path in (ROOT / "addon").rglob("*.py") if "progress_begin" in path.read_text()]
    assert sources == []

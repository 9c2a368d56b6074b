# SPDX-License-Identifier: GPL-3.0-or-later
"""What a grating is made of: the fields of the panel, the bake's request, and the material's base."""

import importlib
import subprocess
import sys

import bpy
import pytest

from devtools import EXTENSION, ROOT
from precompute.reflectance.films import METALS

# The numbers of the menu's items in saved files. A line may join, and none may change.
NUMBERS = {
    "DIELECTRIC": 0, "ALUMINIUM": 1, "SILVER": 2, "GOLD": 3, "COPPER": 4, "CHROMIUM": 5, "NICKEL": 6, "TITANIUM": 7,
    "LAYERS": 8, "MIRROR": 9,
}  # fmt: skip
STACK = "6x(1.68/80nm, 1.56/90nm), 1.56"


def parse(text):
    return importlib.import_module(f"{EXTENSION}.precompute.reflectance.matter").parse(text)


@pytest.fixture
def waves(scene, scan):
    """A grating that is not baked yet."""
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    return scene.natural_gratings.active()


@pytest.mark.parametrize("name", ["DIELECTRIC", "MIRROR", *(metal.upper() for metal in METALS)])
def test_a_matter_of_the_menu_is_asked_for(waves, name):
    waves.matter = name
    assert waves.bake_request().matter == parse(name)


def test_layers_are_those_of_the_field(waves):
    waves.matter = "LAYERS"
    assert waves.bake_request().matter == parse(STACK)
    waves.layers = " Silica 1.46 / 0.2um,Aluminum "
    request = waves.bake_request()
    assert request.matter == parse("1.46/200nm, aluminium")
    waves.matter = "GOLD"
    waves.take_request(request)
    assert (waves.matter, waves.layers) == ("LAYERS", "1.46/200nm, aluminium")
    assert waves.bake_request() == request


@pytest.mark.parametrize("plate", ["", "plate 1.585, "])
@pytest.mark.parametrize("text", ["dielectric", "mirror", "gold", "1.56", STACK])
def test_a_request_is_taken_and_given_back(waves, text, plate):
    if text == "dielectric":
        plate = ""
    waves.matter = "LAYERS"
    waves.layers = plate + text
    request = waves.bake_request()
    waves.take_request(request)
    assert waves.matter == (text.upper() if text.isalpha() else "LAYERS")
    assert waves.plate_ior == pytest.approx(1.585 if plate else 1)  # a single-precision field
    assert waves.bake_request() == request


def test_the_field_of_the_plate_ends_where_plates_do(waves):
    plate = importlib.import_module(f"{EXTENSION}.precompute.optics.plate")
    field = type(waves).bl_rna.properties["plate_ior"]
    assert (field.hard_min, field.hard_max) == (plate.NO_PLATE, plate.PLATE_IOR_MAX)


def test_the_plate_of_the_field_is_over_all_but_a_dielectric(waves):
    waves.plate_ior = 1.5
    assert waves.bake_request().matter == parse("dielectric")
    waves.matter = "SILVER"
    assert waves.bake_request().matter == parse("plate 1.5, silver")
    waves.matter = "LAYERS"
    assert waves.bake_request().matter == parse(f"plate 1.5, {STACK}")
    waves.layers = "plate 1.6, 1.3/100nm, silver"  # the text's own
    assert waves.bake_request().matter == parse(waves.layers)


@pytest.mark.parametrize(
    ("text", "fault"),
    [("wood", "wood: is not a known matter"), ("1.5/0nm, gold", "1.5/0nm: is 0nm thick"), ("", "is empty; give")],
)
def test_wrong_layers_name_their_field(waves, text, fault):
    waves.matter, waves.layers = "LAYERS", text
    with pytest.raises(RuntimeError, match=f"waves: Layers: {fault}") as caught:
        bpy.ops.grating.bake()
    assert len(str(caught.value).strip().splitlines()) == 1


@pytest.mark.parametrize("sample", ["cd", "dvd", "bluray"])
def test_a_disc_is_of_aluminium_under_polycarbonate(scene, sample):
    bpy.ops.grating.import_height_map(filepath=f"sample:{sample}")
    assert scene.natural_gratings.active().bake_request().matter == parse("plate 1.585, aluminium")


def test_other_samples_are_dielectrics(scene):
    bpy.ops.grating.import_height_map(filepath="sample:blazed")
    assert scene.natural_gratings.active().matter == "DIELECTRIC"


def test_the_numbers_in_saved_files_stay(waves):
    items = type(waves).bl_rna.properties["matter"].enum_items
    assert {item.identifier: item.value for item in items} == NUMBERS
    assert len(set(NUMBERS.values())) == len(NUMBERS)


def test_a_file_with_the_former_metal_opens(scene, waves, tmp_path):
    """The former file holds the number of an item that is gone, which reads as an empty text."""
    path = tmp_path / "former.blend"
    held = waves.bl_system_properties_get(do_create=True) if hasattr(waves, "bl_system_properties_get") else waves
    held["matter"] = 77
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    opened = bpy.context.scene.natural_gratings.active()
    assert opened.matter == ""
    with pytest.raises(RuntimeError, match="waves: matter: is empty; give dielectric"):
        bpy.ops.grating.bake()
    opened.matter = "GOLD"
    assert opened.bake_request().matter == parse("gold")


@pytest.mark.night("tests/addon/assets/test_assets.py")
@pytest.mark.parametrize(("matter", "opaque"), [("dielectric", False), ("gold", True), (STACK, False)])
def test_nothing_is_seen_through_a_metal(scene, addon, scan, tmp_path, matter, opaque):
    """A group stores what its bake's matter reflects, but for a dielectric, which follows the IOR."""
    options = ["--size-um", "4", "--height-nm", "100", "--delta-e", "5", "--matter", matter, "-o", str(tmp_path)]
    command = [sys.executable, "-m", "precompute", "bake", str(scan), *options]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    grating = scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "waves", str(tmp_path / "waves.exr")
    bpy.ops.grating.new_material()
    assert addon.matter_nodes.is_opaque(addon.response.response_in(grating.group).group) is opaque
    curves = [node for node in grating.group.nodes if node.type == "VALTORGB"]
    assert len(curves) == (matter != "dielectric")


def test_a_forged_header_is_refused_in_one_line(scene, baked, tmp_path):
    from precompute.table import atlas

    table, record = atlas.read(baked)
    del record["format"], record["layout"]
    record["request"]["matter"] = "gold"
    path = tmp_path / "waves.exr"
    atlas.write_together({path: atlas.pack(table)}, record)
    grating = scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "waves", str(path)
    with pytest.raises(RuntimeError, match="its header's matter does not fit its picture; bake it again"):
        bpy.ops.grating.new_material()

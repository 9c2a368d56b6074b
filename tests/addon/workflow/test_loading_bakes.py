# SPDX-License-Identifier: GPL-3.0-or-later
"""Load Bake: the grating shows what the bake's header says, and a wrong file is refused in one line."""

import json
import shutil

import bpy
import numpy as np
import OpenEXR
import pytest

from precompute.bake.make import bake_to_folder
from precompute.bake.request import request_from
from precompute.base.exr_reader import open_picture
from precompute.measure.errors import stated_errors
from precompute.table.atlas import HEADER_KEY, read_header
from precompute.table.sample_set import path_beside


def load(path):
    return bpy.ops.grating.load_bake(filepath=str(path))


@pytest.fixture(scope="session")
def foil(tmp_path_factory):
    """A small bake of a grating by its parameters, in gold under lacquer, with settings of its own."""
    record = {
        "scans": [{"source": "grating:sinusoidal?period_um=1&depth_nm=80"}],
        "matter": "plate 1.5, gold",
        "delta_e": 6.0,
        "coherence_um": 3.0,
        "levelling": [],
        "illuminant": "E",
    }
    request = request_from(record, "test")
    folder = tmp_path_factory.mktemp("foil")
    bake_to_folder([scan.read() for scan in request.scans], request, folder)
    return next(path for path in folder.glob("*.exr") if not path.stem.endswith(".lobes"))


def test_a_bake_of_a_scan_shows_its_figures(scene, baked):
    """Its scan is not stored in the bake, so the grating has no source."""
    assert load(baked) == {"FINISHED"}
    grating = scene.natural_gratings.active()
    _, header = read_header(baked)
    assert (grating.name, grating.bake_path, grating.source) == ("waves", str(baked), "")
    assert grating.bake_summary.splitlines()[:2] == stated_errors(header["delta_e"])
    assert f"coherence {header['coherence_um']:.0f} um" in grating.bake_summary
    assert "look-ups" in grating.bake_summary and "MiB" in grating.bake_summary
    assert set(header["shown"]) == {"Rec.709", "Rec.2020", "ACEScg"}
    relief = f"relief {header['height_range_m'] * 1e9:.0f} nm levelled"
    assert grating.summary.splitlines() == ["4 x 4 um", relief, "from its bake, without waves.png"]
    assert (grating.matter, grating.delta_e, grating.coherence_um) == ("DIELECTRIC", 1.0, 0.0)
    assert bpy.ops.grating.assign() == {"FINISHED"}


@pytest.mark.night("tests/precompute/cli/test_bake_preset.py")
def test_a_bake_of_a_synthetic_surface_can_be_baked_again(scene, addon, foil):
    assert load(foil) == {"FINISHED"}
    grating = scene.natural_gratings.active()
    _, header = read_header(foil)
    assert grating.source == header["request"]["scans"][0]["source"]
    assert (grating.matter, grating.plate_ior) == ("GOLD", 1.5)
    assert (grating.delta_e, grating.coherence_um, grating.levelling) == (6.0, 3.0, "none")
    assert grating.bake_request().as_dict() == header["request"]
    assert not addon.bakes.is_asked_otherwise(grating)
    assert "period 1000 nm at 0 deg" in grating.summary and grating.quality


@pytest.mark.parametrize("kind", ["folder", "sample set"])
def test_the_folder_and_the_sample_set_lead_to_the_bake(scene, baked, kind):
    load(baked.parent if kind == "folder" else path_beside(baked))
    assert scene.natural_gratings.active().bake_path == str(baked)


def test_a_bake_in_the_list_is_selected(scene, baked, foil):
    load(baked)
    load(foil)
    load(baked)
    assert len(scene.natural_gratings.items) == 2 and scene.natural_gratings.active_index == 0


def test_two_bakes_of_one_name_have_two_names(scene, baked, tmp_path):
    load(baked)
    load(shutil.copy(baked, tmp_path / "waves.exr"))
    assert [grating.name for grating in scene.natural_gratings.items] == ["waves", "waves.001"]


def test_a_sample_set_alone_is_refused(scene, baked, tmp_path):
    alone = shutil.copy(path_beside(baked), tmp_path / "waves.lobes.exr")
    with pytest.raises(RuntimeError, match="waves.lobes.exr: half of a bake: its other .exr is not beside it"):
        load(alone)
    assert not scene.natural_gratings.items


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("text.exr", "not a readable OpenEXR file"),
        ("picture.exr", "not a Natural Gratings bake"),
        ("gone.exr", "no bake there"),
        ("", "holds 4 bakes"),
        ("nowhere", "no bake there"),
        ("forged.exr", "its header's provenance is incomplete"),
        ("unknown.exr", "sample"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(scene, foil, tmp_path, name, told):
    (tmp_path / "text.exr").write_text("a text")
    write(tmp_path / "picture.exr", np.zeros((8, 8, 3), np.float16), {})
    picture = open_picture(foil)
    record = json.loads(picture.texts[HEADER_KEY])
    forged = record | {"delta_e": record["delta_e"] | {"p99": "best"}}
    write(tmp_path / "forged.exr", picture.pixels(), {HEADER_KEY: json.dumps(forged)})
    unknown = record | {"request": record["request"] | {"scans": [{"source": "sample:unicorn"}]}}
    write(tmp_path / "unknown.exr", picture.pixels(), {HEADER_KEY: json.dumps(unknown)})
    with pytest.raises(RuntimeError) as caught:
        load(tmp_path / name)
    line = str(caught.value).strip()
    assert told in line and line.startswith(f"Error: {tmp_path / name}") and len(line.splitlines()) == 1
    assert not scene.natural_gratings.items


def test_a_bake_without_provenance_is_loaded_by_its_path(scene, foil, tmp_path):
    picture = open_picture(foil)
    record = json.loads(picture.texts[HEADER_KEY])
    del record["shape"]
    load(write(tmp_path / "bare.exr", picture.pixels(), {HEADER_KEY: json.dumps(record)}))
    grating = scene.natural_gratings.active()
    assert (grating.name, grating.bake_summary) == ("bare", "")


def write(path, image, attributes):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    with OpenEXR.File(header, {"RGB": np.ascontiguousarray(image[::-1])}) as file:
        file.write(str(path))
    return path


def test_no_file_is_not_the_working_folder(scene, baked, monkeypatch):
    monkeypatch.chdir(baked.parent)
    with pytest.raises(RuntimeError, match="no bake there"):
        load("")


def test_undo_takes_the_grating_out(scene, baked):
    bpy.ops.ed.undo_push(message="before")
    load(baked)
    bpy.ops.ed.undo_push(message="loaded")
    bpy.ops.ed.undo()
    assert not bpy.context.scene.natural_gratings.items
    bpy.ops.ed.redo()
    assert bpy.context.scene.natural_gratings.items[0].bake_summary.startswith("colour error ")


def test_the_panel_says_what_the_working_space_does_to_the_colours(addon):
    """Only where it is seen, and with the space that would show them better."""
    lines = addon.baking.shown_lines
    cd = {"Rec.709": {"outside": 0.35, "p50": 8.8, "p95": 22.4}, "Rec.2020": {"outside": 0.31, "p50": 2.1, "p95": 11.9}}
    told = "some of these colours are too pure for the screen; they are shown a little greyer"
    assert lines(cd, "Rec.709") == [told, "the working space Rec.2020 holds them better"]
    assert lines(cd, "Rec.2020") == lines({}, "Rec.709") == []
    skin = {"Rec.709": {"outside": 0.23, "p50": 3.1, "p95": 6.9}}
    assert lines(skin, "Rec.709") == []
    assert lines({"Rec.709": cd["Rec.709"]}, "Rec.709") == [told]

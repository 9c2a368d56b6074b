# SPDX-License-Identifier: GPL-3.0-or-later
"""Forged or damaged bakes: every button and the command line refuse them in one line and leave nothing behind."""

import json
from pathlib import Path

import bpy
import numpy as np
import OpenEXR
import pytest

from precompute.base.exr_reader import open_picture
from precompute.methods import dft_images
from precompute.methods.flss import build
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed
from precompute.table.atlas import HEADER_KEY, write_together

# The change to a bake's record, as text, and to its image; and a part of the error line.
FAULTS = {
    "20,000 terms": (lambda text: changed(text, terms=20_000, rows=10_000), None, "no picture of this kind"),
    "another picture's layout": (lambda text: changed(text, rows=9), None, "not the size"),
    "an unknown illuminant": (lambda text: changed(text, illuminant='D65"\n#include "x'), None, "its header"),
    "true for a number": (lambda text: changed(text, sigma_b=True), None, "its header's sigma_b is True"),
    "400 digits": (lambda text: text.replace('"scale": ', '"scale": ' + "9" * 400), None, "not JSON"),
    "deep nesting": (lambda text: "[" * 100_000 + "]" * 100_000, None, "nested too deeply"),
    "a picture that is no number": (None, lambda image: image.__setitem__((3, 3, 1), np.nan), "not numbers"),
}


def changed(text, **lies):
    record = json.loads(text)
    record["layout"] |= lies
    return json.dumps(record)


def spoilt(path, fault, whole):
    """Write a bake with a fault to a path."""
    picture = open_picture(whole)
    text, image = picture.texts[HEADER_KEY].decode(), picture.pixels()
    change, spoil, _ = FAULTS[fault]
    if spoil:
        spoil(image)
    record = change(text) if change else text
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, HEADER_KEY: record}
    with OpenEXR.File(header, {"RGB": np.ascontiguousarray(image[::-1])}) as file:
        file.write(str(path))
    return path


def everything():
    """Everything in a file that a material could leave behind."""
    data, scene = bpy.data, bpy.context.scene
    names = {kind: set(getattr(data, kind).keys()) for kind in ("materials", "node_groups", "images", "texts")}
    drivers = len(scene.animation_data.drivers) if scene.animation_data else 0
    slots = {o.name: [slot.material for slot in o.material_slots] for o in data.objects}
    return names, set(scene.keys()) - {"natural_gratings"}, drivers, slots, scene.render.use_high_quality_normals


@pytest.fixture(params=FAULTS)
def hostile(request, scene, baked, tmp_path):
    """The path of a spoilt bake, which the active grating has, and a part of the error line."""
    path = spoilt(tmp_path / "hostile.exr", request.param, baked)
    grating = scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "hostile", str(path)
    scene.natural_gratings.active_index = 0
    return path, FAULTS[request.param][2]


def refused(operator, path, told, **options):
    """Press a button that must refuse a file in one line."""
    before = everything()
    with pytest.raises(RuntimeError) as caught:
        operator(**options)
    line = str(caught.value).strip()
    assert line.startswith(f"Error: {path}: ") and told in line and "; " in line and len(line.splitlines()) == 1
    assert everything() == before


@pytest.mark.parametrize("button", ["new_material", "assign", "add_diffraction"])
def test_a_button_refuses_it(hostile, button):
    if button == "add_diffraction":
        bpy.context.object.data.materials.append(bpy.data.materials.new("Own"))
    refused(getattr(bpy.ops.grating, button), *hostile)
    grating = bpy.context.scene.natural_gratings.active()
    assert grating.material is None and grating.group is None


def test_the_reference_by_the_bake_refuses_it(hostile):
    if not bpy.app.build_options.cycles_osl:
        pytest.skip("this Blender is built without Open Shading Language")
    with cycles_with_osl():
        refused(bpy.ops.grating.osl_reference, *hostile, method="DIRECT")


def test_the_command_line_refuses_it(addon, hostile, tmp_path, capfd):
    path, told = hostile
    saved = tmp_path / "saved.blend"
    before = everything()
    assert addon.commands.execute(["assign", str(path), "--object", "Plane", "--save", str(saved)]) == 1
    (line,) = [each for each in capfd.readouterr().err.splitlines() if each.strip()]
    assert line.startswith(f"error: {path}: ") and told in line
    assert not saved.exists() and everything() == before


@pytest.mark.parametrize("fault", ["true for a number", "400 digits", "deep nesting", "a picture that is no number"])
def test_the_reference_by_images_refuses_them(scene, tmp_path, fault):
    if not bpy.app.build_options.cycles_osl:
        pytest.skip("this Blender is built without Open Shading Language")
    relief = prepare(blazed(periods=2, rows=8))
    whole, path = tmp_path / "whole.exr", tmp_path / "hostile.exr"
    write_together({whole: dft_images.pack(build(relief, dft_images.settings_for(coherence_length_m=5e-6)))}, {})
    picture = open_picture(whole)
    text, image = picture.texts[HEADER_KEY].decode(), picture.pixels()
    if fault == "a picture that is no number":
        image[3, 3, 0] = np.nan
    elif fault == "true for a number":
        text = changed(text, sigma_f=True)
    elif fault == "400 digits":
        text = text.replace('"power": ', '"power": ' + "9" * 400)
    else:
        text = "[" * 100_000
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, HEADER_KEY: text}
    with OpenEXR.File(header, {"RGB": np.ascontiguousarray(image[::-1])}) as file:
        file.write(str(path))
    with cycles_with_osl():
        refused(bpy.ops.grating.osl_reference, path, "", method="FLSS", filepath=str(path))


def test_a_damaged_bake_in_the_cache_is_named_without_its_path(addon, scene):
    path = addon.cache_folder.cache_folder() / "bakes" / "0123456789abcdef" / "cut.exr"
    path.parent.mkdir(parents=True)
    path.write_bytes(b"cut")
    grating = scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "cut", str(path)
    with pytest.raises(RuntimeError, match="Error: cut.exr in the cache: not a readable OpenEXR file; bake it again"):
        bpy.ops.grating.assign()


def test_a_damaged_bake_is_refused(scene, baked, tmp_path):
    path = Path(tmp_path / "cut.exr")
    whole = baked.read_bytes()
    grating = scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "cut", str(path)
    for share in (0.0, 0.3, 0.7, 0.99):
        path.write_bytes(whole[: int(share * len(whole))])
        refused(bpy.ops.grating.assign, path, "not a readable OpenEXR file")


class cycles_with_osl:  # noqa: N801, a context
    def __enter__(self):
        scene = bpy.context.scene
        self.engine, scene.render.engine = scene.render.engine, "CYCLES"
        scene.cycles.device, scene.cycles.shading_system = "CPU", True

    def __exit__(self, *_):
        bpy.context.scene.cycles.shading_system = False
        bpy.context.scene.render.engine = self.engine

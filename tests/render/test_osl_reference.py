# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator's OSL material compared with the node group of the patch model's bake; both are rendered."""

import bpy
import numpy as np
import pytest

from devtools.extension import AddonModules
from laboratory.benchmarks.blender import colour_differences, needs_of, render, set_up_cycles, view_of
from precompute.bake.make import make
from precompute.bake.request import BakeRequest
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare
from precompute.table.atlas import write_together


@pytest.fixture
def addon(extension):
    """The add-on's modules. The scene has the blazed sample, a sun, and Cycles with OSL."""
    modules = AddonModules(extension.__name__)
    if not bpy.app.build_options.cycles_osl:
        pytest.skip(modules.script.missing_for_osl(bpy.context.scene))
    scene = bpy.context.scene
    scene.natural_gratings.items.clear()
    bpy.ops.grating.import_height_map(filepath="sample:blazed")
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    scene.collection.objects.link(sun)
    set_up_cycles()
    yield modules
    scene.cycles.shading_system = False


def new_reference(**settings):
    """The Diffraction group of the material that the operator makes."""
    before = set(bpy.data.materials)
    assert bpy.ops.grating.osl_reference(**settings) == {"FINISHED"}
    (material,) = set(bpy.data.materials) - before
    (node,) = [n for n in material.node_tree.nodes if n.type == "GROUP"]
    return node.node_tree


def response_of(group):
    (response,) = {n.node_tree for n in group.nodes if n.label == "Response"}
    return response


@pytest.mark.night("tests/render/test_osl.py")
def test_flss_is_the_patch_bake(addon, tmp_path):
    """At 65 um the 95th percentile is 0.4."""
    view = view_of(20, 12, (-0.22, 0.0))
    relief = prepare(read_height_map("sample:blazed"))
    made = make([relief], BakeRequest(delta_e=0.5, needs=needs_of(view), model="patch"))
    path = tmp_path / "table.exr"
    write_together({path: (made.image, made.layout)}, {"precision": str(made.image.dtype)})
    table = addon.skin.group_around("Table", addon.making_materials.response_of(path), shadows=False)
    reference = new_reference()
    truth = render(addon, table, view, tmp_path / "truth.exr")
    differences = colour_differences(render(addon, reference, view, tmp_path / "reference.exr"), truth)
    print(f"dE00 p50 {np.median(differences):.2f}, p95 {np.percentile(differences, 95):.2f} of {len(differences)} lit")
    assert len(differences) > 20
    assert np.percentile(differences, 95) <= 1


@pytest.mark.night("tests/render/test_osl.py")
@pytest.mark.parametrize("method", ["CHEBYSHEV", "NMM", "PQ"])
def test_every_method_makes_a_material(addon, method):
    group = new_reference(method=method)
    assert f"OSL {method}" in response_of(group).name


def test_a_file_that_is_there_is_taken(addon, tmp_path):
    with pytest.raises(RuntimeError, match="none.exr: there is no such file"):
        bpy.ops.grating.osl_reference(filepath=str(tmp_path / "none.exr"))
    scene = bpy.context.scene
    path = addon.making_osl_references.write_images(scene.natural_gratings.active(), "pq")
    scene.natural_gratings.items.clear()
    assert "OSL PQ" in response_of(new_reference(filepath=str(path))).name
    with pytest.raises(RuntimeError, match="no grating in it"):
        bpy.ops.grating.osl_reference()


@pytest.mark.night("test_a_file_that_is_there_is_taken")
def test_the_surface_is_the_gratings(addon):
    """Its levelling counts, and an average of several scans is refused."""
    grating = bpy.context.scene.natural_gratings.active()
    first = addon.making_osl_references.write_images(grating, "pq")
    grating.levelling = "none" if grating.levelling != "none" else "plane"
    assert addon.making_osl_references.write_images(grating, "pq") != first
    grating.request = '{"scans": [{"source": "sample:cd", "size_um": null, "height_nm": null, "channel": null}]}'
    with pytest.raises(RuntimeError, match="averages several scans, and this method needs one"):
        bpy.ops.grating.osl_reference()


def test_the_button_says_what_is_missing(addon):
    bpy.context.scene.cycles.shading_system = False
    with pytest.raises(RuntimeError, match="Switch on Cycles' Open Shading Language"):
        bpy.ops.grating.osl_reference()

# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's algorithms in OSL, rendered by Cycles and compared with precompute.methods in every pixel.

A plane at z = 0 is seen from one metre above and lit by a sun. It has the whole Diffraction group, around a shader.
"""

import numpy as np
import pytest

from devtools.extension import AddonModules
from laboratory.benchmarks.blender import PlaneView, render, set_up_cycles
from precompute.colour.spaces import rgb_from_xyz
from precompute.methods import dft_images
from precompute.methods.dft_images import settings_for
from precompute.methods.method_registry import METHODS
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed, sinusoidal
from precompute.table.atlas import write_together

TO_SUN = np.array([0.3, -0.15, 1.0]) / np.linalg.norm([0.3, -0.15, 1.0])
# The plane's tangent frame is turned, so that none of its axes is a world axis.
VIEW = PlaneView(48, np.radians(90), TO_SUN, np.radians(20))
IRRADIANCE = (1.0, 1.5, 2.0)
IOR = 1.4


@pytest.fixture(scope="module")
def addon(extension):
    """The add-on's modules, with Cycles set up for its shaders."""
    import bpy

    set_up_cycles()
    modules = AddonModules(extension.__name__)
    if not bpy.app.build_options.cycles_osl:
        pytest.skip(modules.script.missing_for_osl(bpy.context.scene))
    yield modules
    bpy.context.scene.cycles.shading_system = False


def images_file(folder, height_map, name, **asked):
    """A method and the file of its images."""
    method = METHODS[name](prepare(height_map), settings_for(**asked))
    path = folder / f"{name}.exr"
    write_together({path: dft_images.pack(method)}, {})
    return method, path


LUMINANCE = np.linalg.inv(rgb_from_xyz("Rec.709"))[1]
SMALL = {"coherence_length_m": 10e-6, "step_m": 10e-9}
GRATING = blazed(periods=4, rows=128)
DEEP = sinusoidal(2.5e-6, 1500e-9, periods=4, rows=64)


@pytest.mark.short("flss", "chebyshev", "nmm-jacobian")
@pytest.mark.parametrize(
    ("name", "surface"),
    [("flss", GRATING), ("chebyshev", DEEP), ("nmm", GRATING), ("nmm-jacobian", GRATING), ("pq", GRATING)],
)
def test_cycles_renders_what_the_method_says(addon, tmp_path, name, surface):
    """On pixels above 1 % of the peak. The bounds allow for Cycles' sample position, up to 0.005 of a pixel off centre.
    There a lobe of sigma 1.3 pixels changes by 0.4 % on its flank, at 1 % of its peak. The measured error is 0.2 %."""
    method, path = images_file(tmp_path, surface, name, **SMALL)
    response = addon.thesis_methods.build_osl_response("test", path, rgb_from_xyz("Rec.709"))
    group = addon.skin.group_around("test", response, shadows=False)
    picture = render(addon, group, VIEW, tmp_path / "picture.exr", IRRADIANCE, IOR) @ LUMINANCE
    software = VIEW.radiance(lambda u, v, w: method.xyz(u, v, w) / w[:, None] ** 2, IOR)
    expected = software * IRRADIANCE @ LUMINANCE
    counted = expected > 0.01 * expected.max()
    assert counted.sum() > 20
    error = np.abs(picture - expected)[counted] / expected[counted]
    assert np.median(error) <= 0.005
    assert np.percentile(error, 95) <= 0.02


def test_a_scene_says_what_it_lacks(addon):
    import bpy

    scene, missing_for_osl = bpy.context.scene, addon.script.missing_for_osl
    assert missing_for_osl(scene) is None
    scene.cycles.shading_system = False
    assert "Open Shading Language" in missing_for_osl(scene)
    scene.cycles.shading_system = True


def test_a_shader_that_does_not_compile_is_an_error(addon, tmp_path, monkeypatch):
    import bpy

    _, path = images_file(tmp_path, GRATING, "flss", **SMALL)
    monkeypatch.setattr(addon.thesis_methods, "shader_text", lambda *_: "shader broken(")
    groups, texts = len(bpy.data.node_groups), len(bpy.data.texts)
    with pytest.raises(addon.script.GratingError, match="does not compile"):
        addon.thesis_methods.build_osl_response("test", path, rgb_from_xyz("Rec.709"))
    assert (len(bpy.data.node_groups), len(bpy.data.texts)) == (groups, texts)


def test_other_files_are_refused(addon, tmp_path):
    with pytest.raises(addon.script.GratingError, match="no such file"):
        addon.thesis_methods.build_osl_response("test", tmp_path / "none.exr", rgb_from_xyz("Rec.709"))

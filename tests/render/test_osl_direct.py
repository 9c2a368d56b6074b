# SPDX-License-Identifier: GPL-3.0-or-later
"""The OSL form of the Direct group, rendered by Cycles, against the group itself and against precompute."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

from precompute.table import atlas
from precompute.table.atlas import read_header

from .test_radiance import PIXELS, RGB_FROM_XYZ, TURN, assign, expected, head_on, relative_error, shape
from .test_shadows import shaded

# Bounds of the relative error on pixels above 1 % of the peak. Shader and node group read the same texels with the same
# weights: single precision leaves 0.001 % (median) and 0.006 % (p95), measured in Blender 4.5 and 5.2. A bug exceeds
# the bounds by far: linear instead of cubic look-ups give 3 % and 25 %.
MEDIAN, P95 = 0.005, 0.02


@pytest.fixture
def osl(stage, addon):
    """The stage, set up for OSL shaders."""
    if not bpy.app.build_options.cycles_osl:
        pytest.skip(addon.script.missing_for_osl(stage.scene))
    stage.scene.render.engine = "CYCLES"
    stage.scene.cycles.shading_system = True
    yield stage
    stage.scene.cycles.shading_system = False


def plane(stage, disc: float = 0.0):
    """A plane under a camera and a sun; `disc` is the width of the sun's disc in radians."""
    mesh, (location, target, angle) = shape(stage, "plane")
    stage.camera(location, target, angle=angle)
    stage.lamp("SUN", to=(0.35, -0.2, 1.0), energy=2.0, angle=disc, color=(1.0, 0.8, 0.6))
    return mesh


def response(addon, path):
    """The response of a bake's file as a shader."""
    return addon.osl_bake.build_osl_direct("test", path, read_header(path)[0], rgb_from_xyz=RGB_FROM_XYZ)


def agree(name: str, picture: np.ndarray, truth: np.ndarray) -> None:
    error = relative_error(picture, truth)
    median, p95 = np.median(error), np.percentile(error, 95)
    print(f"{name}: median {median:.4%}, p95 {p95:.4%}")
    assert median <= MEDIAN
    assert p95 <= P95


@pytest.fixture
def middle(baked, tmp_path):
    """The file and the bake of a table's middle, so that look-ups go beyond its edge: one level, no zero order."""
    _, table = baked
    rows, columns = (slice(n // 4, n - n // 4) for n in table.tile)
    (v, u), path = table.axes, tmp_path / "middle.exr"
    part = replace(
        table,
        terms=table.terms[:, rows, columns],
        first=(float(v[rows][0]), float(u[columns][0])),
        zero_order=np.zeros_like(table.zero_order),
        wider=(),
    )
    image, layout = atlas.pack(part)
    atlas.write_together({path: (image, layout)}, {})
    return path, atlas.unpack(image, layout)


@pytest.mark.short("baked-0.3", "middle")
@pytest.mark.parametrize(
    ("bake", "disc", "settings"),
    [
        ("baked", 0.0, {}),
        ("baked", 0.3, {"Roughness": 0.2, "Period Scale": 1.3, "Height Scale": 0.8}),
        ("middle", 0.0, {"IOR": 1.3}),
        ("baked", 0.0, {"IOR": 5.0}),
        ("gold", 0.3, {"IOR": 3.0, "Roughness": 0.2}),
        ("under_plate", 0.0, {}),
        ("under_plate", 0.3, {"Roughness": 0.2, "Period Scale": 0.8, "Height Scale": 0.8}),
    ],
)
def test_the_shader_is_the_node_group_and_the_table(osl, addon, request, bake, disc, settings):
    path, table = request.getfixturevalue(bake)
    mesh = plane(osl, disc)
    node = assign(osl, mesh, path, **settings)
    asked = {name.lower().replace(" ", "_"): value for name, value in settings.items()}
    truth, _ = expected(osl, mesh, table, **asked)
    osl.scene.cycles.shading_system = False
    by_nodes = osl.rgb("cycles", PIXELS)
    osl.scene.cycles.shading_system = True
    node.node_tree = addon.skin.group_around("test", response(addon, path), shadows=False)
    by_shader = osl.rgb("cycles", PIXELS)
    agree("precompute", by_shader, truth)
    agree("node group", by_shader, by_nodes)


def test_a_head_on_view_is_that_of_the_nodes(osl, addon, gold):
    """Turned by a quarter, so that the components along the surface are zeros of both signs."""
    mesh = head_on(osl)
    node = assign(osl, mesh, gold[0])
    node.inputs["Rotation"].default_value = np.pi / 2
    osl.scene.cycles.shading_system = False
    by_nodes = osl.rgb("cycles", 8)
    osl.scene.cycles.shading_system = True
    node.node_tree = addon.skin.group_around("test", response(addon, gold[0]), shadows=False)
    np.testing.assert_allclose(osl.rgb("cycles", 8), by_nodes, rtol=MEDIAN)


def test_a_card_shades_what_lies_under_it(osl, addon, baked):
    picture = shaded(osl, addon, response(addon, baked[0]), casts=True, osl=True)
    lit, under = np.split(picture, 2, axis=1)
    assert lit.min() > 0
    np.testing.assert_array_equal(under, 0)


def test_the_operator_makes_it_of_the_active_grating(osl, addon, baked):
    path, table = baked
    mesh = plane(osl)
    grating = osl.scene.natural_gratings.items.add()
    grating.name = "radiance"
    with pytest.raises(RuntimeError, match="radiance: not baked yet; press Bake Grating"):
        bpy.ops.grating.osl_reference(method="DIRECT")
    grating.bake_path = str(path)
    assert bpy.ops.grating.osl_reference(method="DIRECT") == {"FINISHED"}
    (material,) = bpy.data.materials
    (node,) = addon.material.diffraction_nodes(material)
    node.inputs["Rotation"].default_value = TURN
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0, 0, 0, 1)
    mesh.data.materials.append(material)
    agree("operator", osl.rgb("cycles", PIXELS), expected(osl, mesh, table)[0])


def test_a_file_that_is_no_bake_is_refused(osl, tmp_path):
    plane(osl)
    with pytest.raises(RuntimeError, match="none.exr: there is no such file"):
        bpy.ops.grating.osl_reference(method="DIRECT", filepath=str(tmp_path / "none.exr"))
    assert not bpy.data.materials

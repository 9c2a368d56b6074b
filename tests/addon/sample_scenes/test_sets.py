# SPDX-License-Identifier: GPL-3.0-or-later
"""The sets of the animal: what they hold, where crumbs lie, and that both engines show them."""

import bpy
import numpy as np
import pytest
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from sample_scenes import animal, sets, soil
from sample_scenes.noise import cracks, fractal_noise
from sample_scenes.sets import SETS
from sample_scenes.stage import add_surface, clean_scene, new_world, plain_material
from sample_scenes.studio import Towards, add_camera

HOLDS = {
    "soil": {"Soil", "Soil Mounds", "Soil Crumbs", "Soil Fibres", "Cork Bark"},
    "turntable": {"Plate", "Backdrop", "Grey Ball", "Chrome Ball", "Colours"},
}


def build(scene, name: str, view: str = "hero") -> bpy.types.Object:
    """The animal on a set; its mesh."""
    clean_scene()
    animal.build(scene, animal.VIEWS[view], "XENOPELTIS", faces=40_000, panorama=None, ground=name)
    bpy.context.view_layer.update()
    return bpy.data.objects["Snake"]


def crumbs() -> tuple[np.ndarray, np.ndarray]:
    """Middles (n, 3) and radii (n,) of the crumbs that Blender shows."""
    shown = bpy.context.evaluated_depsgraph_get().object_instances
    matrices = np.array([instance.matrix_world.copy() for instance in shown if instance.is_instance])
    return matrices[:, :3, 3], np.linalg.norm(matrices[:, :3, 0], axis=1)


@pytest.mark.night("tests/addon/sample_scenes/test_scenes.py")
@pytest.mark.parametrize("name", list(SETS))
def test_a_set_holds_what_it_is_named_for(scene, name, monkeypatch):
    monkeypatch.setattr(soil, "_CRUMBS", 5000)
    build(scene, name)
    assert HOLDS[name] <= set(bpy.data.objects.keys())


@pytest.mark.night("tests/addon/workflow/test_adding_snakes.py")
@pytest.mark.parametrize(("options", "name"), [((), "soil"), (("--set", "turntable"), "turntable")])
def test_the_command_line_chooses_a_set_else_the_view_does(scene, options, name, tmp_path, monkeypatch):
    monkeypatch.setattr(soil, "_CRUMBS", 5000)
    animal.main(["--output", str(tmp_path / "a.blend"), "--view", "hero", "--faces", "11000", *options])
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    assert HOLDS[name] <= set(bpy.data.objects.keys())
    assert ("Soil" in bpy.data.objects) == (name == "soil")
    # The meshes that the crumbs are copies of are saved too.
    shown = bpy.context.evaluated_depsgraph_get().object_instances
    assert any(instance.is_instance for instance in shown) == (name == "soil")


@pytest.mark.night("tests/addon/sample_scenes/test_scenes.py")
def test_crumbs_are_small_heaped_against_the_snake_and_touch_nothing(scene, monkeypatch):
    """Of a quarter of the crumbs, some 15,000 find a place."""
    monkeypatch.setattr(soil, "_CRUMBS", soil._CRUMBS // 4)
    snake = build(scene, "soil")
    points, radius = crumbs()
    assert len(points) > 12_000
    for body in (snake, bpy.data.objects["Cork Bark"]):
        corners = [body.matrix_world @ vertex.co for vertex in body.data.vertices]
        tree = BVHTree.FromPolygons(corners, [triangle.vertices[:] for triangle in body.data.loop_triangles])
        # Instances are stored as float32, as are vertices: 1e-6 m is far above their rounding at 0.3 m.
        near = [tree.find_nearest(Vector(p), r - 1e-6)[0] for p, r in zip(points.tolist(), radius, strict=True)]
        assert not any(near)
    # Around the body's middle line nothing is inside: a ray up from a crumb within it would leave it first.
    tree = BVHTree.FromObject(snake, bpy.context.evaluated_depsgraph_get())
    up = Vector((0, 0, 1))
    hits = [tree.ray_cast(Vector(p), up) for p in points.tolist()]
    assert all(place is None or normal.z < 0 for place, normal, _, _ in hits)
    assert 0.0003 <= radius.min() and radius.max() <= 0.00225 + 1e-6
    # The density of diameters falls with the power 3.7, so each octave has 2^2.7 times fewer: less than half.
    sizes = np.histogram(2000 * radius, [0.6, 1.2, 2.4, 4.8])[0]
    assert (np.diff(sizes) < -0.5 * sizes[:-1]).all()
    small = points[(radius < 0.0006) & (np.hypot(*points[:, :2].T) < 0.15)]
    found = [(tree.find_nearest(Vector(p))[3], tree.ray_cast(Vector(p), up)[0]) for p in small.tolist()]
    apart = np.array([distance if above is None else np.nan for distance, above in found])
    heap, open_soil = (np.median(small[chosen, 2]) for chosen in (apart < 0.004, apart > 0.02))
    assert heap > open_soil + 0.001


def test_soil_stays_below_a_body_of_any_place(scene):
    """A box 4 mm over the floor, moved and turned."""
    points = [(x, y, z) for x in (-0.03, 0.03) for y in (-0.02, 0.02) for z in (0, 0.02)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    box = add_surface(scene, "Box", points, faces=faces, material=plain_material("Box", (0.1,) * 3, 1.0))
    box.location, box.rotation_euler.z = (0.05, 0.02, 0.004), 0.5
    made = soil.ground_below([box], 0.15, 0.05)
    under = np.isfinite(made.underside)
    # 60 x 40 mm in cells of 1 mm; its outline crosses about 2 x 100 cells.
    assert under.sum() == pytest.approx(2400, abs=200)
    assert made.height[under].max() <= 0.004 - 1e-4 and made.height[~under].max() > 0.004


def test_noise_is_smooth_bounded_and_repeats():
    points = np.random.default_rng(0).uniform(-50, 50, (4000, 2))
    values = fractal_noise(points, 3, seed=2)
    np.testing.assert_array_equal(values, fractal_noise(points, 3, seed=2))
    assert np.abs(values).max() <= 1 and values.std() > 0.15
    assert np.abs(values.mean()) < 0.05
    # The fade's slope is at most 15/8, between values 2 apart: 3.75 an axis, for the noise and its octaves alike.
    moved = fractal_noise(points + (1e-4, 0), 3, seed=2)
    assert np.abs(moved - values).max() < 3.75 * 3 / 1.75 * 1e-4
    assert not np.allclose(values, fractal_noise(points, 3, seed=3))
    deep = cracks(points, 0.2)
    assert deep.min() == 0 and 0.9 < deep.max() <= 1


@pytest.mark.night("tests/addon/sample_scenes/test_scenes.py")
def test_both_engines_show_a_set(scene, tmp_path, monkeypatch):
    monkeypatch.setattr(soil, "_CRUMBS", 5000)  # without a GPU, EEVEE takes a minute for all of them
    build(scene, "soil")
    cycles, eevee = pictures(scene, tmp_path)
    # EEVEE leaves out most of the light between surfaces, about a fifth of it here.
    np.testing.assert_allclose(eevee.mean(axis=(0, 1)), cycles.mean(axis=(0, 1)), rtol=0.3)


@pytest.mark.night("tests/addon/sample_scenes/test_scenes.py")
def test_the_plate_is_exposed_as_grey(scene, tmp_path):
    """At the exposure of the plate's set, without the view's own stops, the open plate is 18 % grey in the picture."""
    build(scene, "turntable", "turntable")
    for name in ("Snake", "Colours"):
        bpy.data.objects.remove(bpy.data.objects[name])
    cycles = picture_by("CYCLES", scene, tmp_path)
    stops = scene.view_settings.exposure - animal.VIEWS["turntable"].exposure
    shown = cycles[14:24, 26:38].mean() * 2**stops
    assert shown == pytest.approx(0.18, rel=0.03)


@pytest.mark.night("tests/addon/sample_scenes/test_scenes.py")
def test_light_goes_through_a_pane_and_is_a_little_green(scene, tmp_path):
    clean_scene()
    scene.camera = add_camera(scene, Towards(-90.0, 0.0, 1.0), (0.0, 0.165, 0.05), 200.0)
    background = new_world(scene, "White")
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    corners = [(-1, 0.165, -1), (1, 0.165, -1), (1, 0.165, 1), (-1, 0.165, 1)]
    add_surface(scene, "Pane", corners, faces=[(0, 1, 2, 3)], material=sets.thin_glass())
    for picture in pictures(scene, tmp_path):
        middle = picture[16:20, 28:36].mean(axis=(0, 1))
        # Of a white world straight through: 92.4 % passed and coloured, and 7.6 % reflected; a white world is both.
        passed = 0.076 + 0.924 * np.array(sets.TINT)
        np.testing.assert_allclose(middle, passed, atol=0.02)
        assert middle[1] > middle[0] + 0.02


def pictures(scene, folder) -> list[np.ndarray]:
    """Small pictures (36, 64, 3) by Cycles and by EEVEE, linear."""
    eevee = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0) else "BLENDER_EEVEE"
    return [picture_by(engine, scene, folder) for engine in ("CYCLES", eevee)]


def picture_by(engine, scene, folder) -> np.ndarray:
    """A small picture (36, 64, 3) by an engine, linear."""
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 64, 36, 100
    render.image_settings.file_format = "OPEN_EXR"
    scene.cycles.samples, scene.cycles.use_denoising, scene.eevee.taa_render_samples = 16, False, 2
    render.engine, render.filepath = engine, str(folder / f"{engine}.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath)
    return np.array(image.pixels[:]).reshape(36, 64, 4)[..., :3]

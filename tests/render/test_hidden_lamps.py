# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that the render does not show do not diffract. A white diffuse plane lies beside a plane with a Lambertian
response; both must be equally bright, however a lamp is hidden, moved, changed or removed.

No button is pressed after a change: the add-on follows the lamps by itself.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import bpy
import numpy as np
import pytest

from .lamp_scenes import ENGINES, lambertian

PIXELS = 16


@dataclass
class Pair:
    """A white plane on the left, the diffraction plane on the right, and a lamp in its own collection."""

    stage: object
    lamp: object
    held: object
    layer: object = field(init=False)

    def __post_init__(self):
        self.layer = bpy.context.view_layer.layer_collection.children[self.held.name]

    def seen(self, engine="cycles") -> tuple[float, float]:
        """The mean light of the diffuse plane and of the diffraction plane."""
        picture = self.stage.rgb(engine, PIXELS, 64 if engine == "cycles" else 1)[..., 1]
        half = PIXELS // 2
        return picture[:, : half - 1].mean(), picture[:, half + 1 :].mean()


def plane(name, x, material):
    bpy.ops.mesh.primitive_plane_add(size=1, location=(x, 0, 0))
    bpy.context.object.name = name
    bpy.context.object.data.materials.append(material)


@pytest.fixture
def pair(stage, addon, request):
    """A function that builds the pair, lit by a lamp of a kind."""

    def make(kind="SUN") -> Pair:
        stage.camera((0, 0, 3), ortho=2.0).rotation_euler = (0, 0, 0)
        held = bpy.data.collections.new("Held")
        stage.scene.collection.children.link(held)
        lamp = stage.lamp(kind, (0, 0, 2), energy=2.0 if kind == "SUN" else 100.0)
        stage.scene.collection.objects.unlink(lamp)
        held.objects.link(lamp)
        white, tree = stage.material("White")
        shader = tree.node("ShaderNodeBsdfDiffuse")
        shader.inputs["Color"].default_value = (1, 1, 1, 1)
        tree.node("ShaderNodeOutputMaterial", tree.value(shader.outputs[0]))
        addon.lighting.update_lamps(stage.scene)
        group = addon.skin.group_around("lambertian", lambertian(addon), shadows=False)
        ours, tree = stage.material("Ours")
        tree.node("ShaderNodeOutputMaterial", tree.group(group, {"IOR": 1.0})["Shader"])
        plane("White", -0.5, white)
        plane("Ours", 0.5, ours)
        return Pair(stage, lamp, held)

    return make


def alike(theirs: float, ours: float) -> None:
    """Assert that both are dark or equally bright: Cycles samples the lamps' discs, and EEVEE's area lamps and half
    floats are off by 3 % (test_lamps.py checks the values)."""
    assert (theirs == 0) == (ours == 0), f"diffuse light {theirs}, diffraction {ours}"
    assert ours == pytest.approx(theirs, rel=0.05)


def second_collection(pair: Pair, **settings):
    """Put the lamp into another collection too."""
    other = bpy.data.collections.new("Second")
    pair.stage.scene.collection.children.link(other)
    other.objects.link(pair.lamp)
    for key, value in settings.items():
        setattr(other, key, value)


def excluded(pair: Pair) -> None:
    pair.layer.exclude = True


def excluded_there_shown_here(pair: Pair) -> None:
    second_collection(pair)
    pair.layer.exclude = True


def excluded_there_hidden_here(pair: Pair) -> None:
    second_collection(pair, hide_render=True)
    pair.layer.exclude = True


def under_a_hidden_parent(pair: Pair) -> None:
    parent = bpy.data.collections.new("Parent")
    scene = pair.stage.scene
    scene.collection.children.link(parent)
    scene.collection.children.unlink(pair.held)
    parent.children.link(pair.held)
    parent.hide_render = True


def moved_to_a_hidden_collection(pair: Pair) -> None:
    second_collection(pair, hide_render=True)
    pair.held.objects.unlink(pair.lamp)


def moved_to_a_shown_collection(pair: Pair) -> None:
    """Hide the collection that the lamp leaves."""
    second_collection(pair)
    pair.held.objects.unlink(pair.lamp)
    pair.held.hide_render = True


# The ways to hide a lamp, and whether a final render still shows it.
WAYS: dict[str, tuple[Callable[[Pair], None], bool]] = {
    "camera icon": (lambda pair: setattr(pair.lamp, "hide_render", True), False),
    "monitor icon": (lambda pair: setattr(pair.lamp, "hide_viewport", True), True),
    "eye": (lambda pair: pair.lamp.hide_set(True), True),
    "collection's camera icon": (lambda pair: setattr(pair.held, "hide_render", True), False),
    "collection's monitor icon": (lambda pair: setattr(pair.held, "hide_viewport", True), True),
    "collection's eye": (lambda pair: setattr(pair.layer, "hide_viewport", True), True),
    "excluded": (excluded, False),
    "holdout": (lambda pair: setattr(pair.layer, "holdout", True), True),
    "indirect only": (lambda pair: setattr(pair.layer, "indirect_only", True), True),
    "excluded there, shown here": (excluded_there_shown_here, True),
    "excluded there, hidden here": (excluded_there_hidden_here, False),
    "under a hidden parent": (under_a_hidden_parent, False),
    "moved to a hidden collection": (moved_to_a_hidden_collection, False),
    "moved to a shown collection": (moved_to_a_shown_collection, True),
    "in no collection": (lambda pair: pair.held.objects.unlink(pair.lamp), False),
    "deleted": (lambda pair: bpy.data.objects.remove(pair.lamp), False),
    "its data deleted": (lambda pair: bpy.data.lights.remove(pair.lamp.data), False),
    "its collection deleted": (lambda pair: bpy.data.collections.remove(pair.held), False),
    "without strength": (lambda pair: setattr(pair.lamp.data, "energy", 0.0), False),
}


@pytest.mark.parametrize("way", WAYS)
def test_what_the_render_does_not_show_does_not_diffract(pair, way):
    made = pair()
    alike(*made.seen())
    hide, shown = WAYS[way]
    hide(made)
    theirs, ours = made.seen()
    alike(theirs, ours)
    assert (ours > 0) == shown


@pytest.mark.short("camera icon")
@pytest.mark.parametrize("way", ["camera icon", "eye", "excluded", "deleted"])
def test_nor_in_eevee(pair, way):
    made = pair()
    alike(*made.seen("eevee"))
    hide, shown = WAYS[way]
    hide(made)
    theirs, ours = made.seen("eevee")
    alike(theirs, ours)
    assert (ours > 0) == shown


@pytest.mark.parametrize("engine", ENGINES)
def test_a_scene_without_lamps_is_dark_until_one_comes(pair, engine):
    made = pair()
    bpy.data.objects.remove(made.lamp)
    assert made.seen(engine) == (0, 0)
    made.stage.lamp("SUN", to=(0.2, 0, 1), energy=1.0, angle=0.0)
    alike(*made.seen(engine))
    assert bpy.ops.grating.add_sun() == {"FINISHED"}
    theirs, ours = made.seen(engine)
    alike(theirs, ours)


@pytest.mark.parametrize("kind", ["SUN", "POINT", "SPOT", "AREA"])
@pytest.mark.parametrize("scale", [(0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 0)])
def test_lamps_scaled_to_nothing(pair, kind, scale):
    made = pair(kind)
    made.lamp.scale = scale
    alike(*made.seen())


@pytest.mark.parametrize("after", ["SUN", "POINT", "SPOT", "AREA"])
@pytest.mark.parametrize("before", ["SUN", "AREA"])
def test_a_lamp_made_another_kind(pair, before, after):
    made = pair(before)
    made.lamp.data.type = after
    made.lamp.data.energy = 2.0 if after == "SUN" else 100.0
    theirs, ours = made.seen()
    assert theirs > 0
    alike(theirs, ours)


def test_a_lamp_with_other_data(pair):
    made = pair()
    made.lamp.data = bpy.data.lights.new("Other", "POINT")
    made.lamp.data.energy = 50.0
    theirs, ours = made.seen()
    assert theirs > 0
    alike(theirs, ours)


def test_glossy_visibility(pair):
    """A lamp that is invisible to glossy rays does not diffract; one that is invisible to diffuse rays still does."""
    made = pair()
    before = made.seen()[1]
    made.lamp.visible_diffuse = False
    assert made.seen()[1] == before
    made.lamp.visible_glossy = False
    assert made.seen()[1] == 0


def test_each_view_layer_shows_its_own_lamps(pair):
    made = pair()
    scene = made.stage.scene
    first = scene.view_layers[0]
    second = scene.view_layers.new("Second")
    try:
        second.layer_collection.children["Held"].exclude = True
        for layer, lit in ((second, False), (first, True)):
            first.use, second.use = layer == first, layer == second
            theirs, ours = made.seen()
            alike(theirs, ours)
            assert (ours > 0) == lit
    finally:
        scene.view_layers.remove(second)
        first.use = True


def test_another_scene_of_the_file_shows_its_own_lamps(pair):
    """The other scene is rendered; its planes are also in the open scene."""
    made = pair()
    other = bpy.data.scenes.new("Other")
    try:
        for thing in ("White", "Ours", "Camera"):
            other.collection.objects.link(bpy.data.objects[thing])
        other.camera = bpy.data.objects["Camera"]
        here = made.seen()
        there = Pair.seen(_of_scene(made, other))
        assert here[0] > 0 and there == (0, 0)
        lamp = bpy.data.lights.new("There", "SUN")
        lamp.energy = 0.5
        other.collection.objects.link(bpy.data.objects.new("There", lamp))
        theirs, ours = Pair.seen(_of_scene(made, other))
        alike(theirs, ours)
        assert 0 < ours < here[1]
    finally:
        bpy.data.scenes.remove(other)


def _of_scene(made, scene):
    """The pair as another scene renders it."""
    import copy

    shown = copy.copy(made)
    shown.stage = copy.copy(made.stage)
    shown.stage.scene = scene

    def rgb(*arguments):
        with bpy.context.temp_override(scene=scene):
            return type(made.stage).rgb(shown.stage, *arguments)

    shown.stage.rgb = rgb
    return shown


@pytest.mark.parametrize("persistent", [False, True])
def test_a_lamp_hidden_in_some_frames(pair, persistent):
    made = pair()
    scene = made.stage.scene
    scene.render.use_persistent_data = persistent
    try:
        for frame, hidden in ((1, False), (2, True), (3, False)):
            made.lamp.hide_render = hidden
            made.lamp.keyframe_insert("hide_render", frame=frame)
        for frame, lit in ((1, True), (2, False), (3, True)):
            scene.frame_set(frame)
            theirs, ours = made.seen()
            alike(theirs, ours)
            assert (ours > 0) == lit
    finally:
        scene.render.use_persistent_data = False


def test_more_lamps_than_count_are_named(pair, monkeypatch):
    """The brightest suns light; one more is left out until another is deleted."""
    made = pair()
    monkeypatch.setattr(made.stage.addon.brightest_lamps, "FOLLOWED_MAX", 8)
    for k in range(8):
        made.stage.lamp("SUN", energy=1.0 + k, name=f"S{k}", angle=0.0)
    made.seen()
    addon, scene = made.stage.addon, made.stage.scene
    (line,) = addon.brightest_lamps.unfollowed_features(scene, addon.follow.counted_lamps(scene))
    assert line.startswith("diffraction uses at most 8 lamps; left out: S0;")
    bpy.data.objects.remove(bpy.data.objects["S1"])
    theirs, ours = made.seen()
    np.testing.assert_allclose(ours, theirs, rtol=0.02)  # Cycles samples one of eight lamps per sample


@pytest.mark.parametrize("way", ["camera icon", "collection's camera icon", "excluded"])
def test_of_nine_lamps_the_eight_that_are_shown_light(pair, way, monkeypatch):
    """The brightest is hidden. If it kept its place, an eighth of the light would be missing."""
    made = pair()
    monkeypatch.setattr(made.stage.addon.brightest_lamps, "FOLLOWED_MAX", 8)
    for k in range(8):
        made.stage.lamp("SUN", energy=1.0, name=f"S{k}", angle=0.0)
    theirs, ours = made.seen()
    np.testing.assert_allclose(ours / theirs, 0.9, rtol=0.02)  # 2 and seven times 1, of 2 and eight times 1
    WAYS[way][0](made)
    theirs, ours = made.seen()
    np.testing.assert_allclose(ours, theirs, rtol=0.02)  # as above

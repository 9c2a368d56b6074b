# SPDX-License-Identifier: GPL-3.0-or-later
"""EEVEE's limit for a material's constants: what counts towards it, and what is left out beyond it."""

from pathlib import Path

import bpy
import numpy as np
import pytest

from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.surface.readers.reader_registry import read_height_map
from precompute.world_sources.sources import Source
from tests.addon.conftest import reports
from tests.addon.layout import Layout, context_of


@pytest.fixture
def group(addon, scene, grating):
    """The Diffraction group of the plane, under a sun and a world of three sources, all answered to."""
    grating.every_lamp = True
    scene.world = bpy.data.worlds.new("World")
    addon.compat.enable_nodes(scene.world)
    source = Source(np.array((0.0, 0.6, 0.8)), np.array((3.0, 2.0, 1.0)), 1e-4)
    now = addon.fitting_worlds._fingerprint(scene)
    addon.sky.hold_sources(scene, [source] * 3, fingerprint=now, missed=0.0)
    bpy.ops.grating.assign()
    yield grating.group
    scene.world = None


def answers(addon, group) -> int:
    """How many lamps and sources a sample answers to, by the last loop: one before it chooses them."""
    turns = [node.inputs[0].default_value for node in group.nodes if node.bl_idname == addon.interface.LOOP]
    return turns[-1] if turns else sum(node.label == "Response" for node in group.nodes)


def leave(addon, monkeypatch, room: int) -> None:
    """Set EEVEE's limit to this many bytes, plus the share reserved for the rest of a material."""
    monkeypatch.setattr(addon.skin, "ROOM", room + addon.skin._LEFT)


def test_what_takes_room(addon, scene):
    """A colour and a vector take 16 bytes each. A number takes 4, or fills a vector's gap."""
    tree = addon.builder.Tree(bpy.data.node_groups.new("Group", "ShaderNodeTree"))
    socket = addon.interface.Socket
    addon.interface.add_interface(tree.tree, (), (socket("Sum", "Vector", ""), socket("Spare", "Vector", "")))

    def room(tree: bpy.types.NodeTree) -> int:
        return addon.interface.size_of(tree).constant_bytes

    place = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Position"])
    once = tree.vector_math("ADD", place, (1.0, 2.0, 3.0))  # one vector, and an unused vector and number
    tree.output(once, once)
    assert room(tree.tree) == 2 * 16
    tree.node("ShaderNodeMath", 1.0, 2.0)  # leads nowhere
    assert room(tree.tree) == 2 * 16
    outer = addon.builder.Tree(bpy.data.node_groups.new("Outer", "ShaderNodeTree"))
    addon.interface.add_interface(outer.tree, (), (socket("Sum", "Vector", ""),))
    first, second = (outer.group(tree.tree)["Sum"] for _ in range(2))
    outer.output(first + second)
    assert room(outer.tree) == 2 * 2 * 16 + 16, "a group counts as often as it is used"
    assert addon.interface.size_of(outer.tree).nodes == 2 * 2 + 1
    mixed = addon.builder.Tree(bpy.data.node_groups.new("Mixed", "ShaderNodeTree"))
    addon.interface.add_interface(mixed.tree, (), (socket("Sum", "Vector", ""),))
    place = mixed.value(mixed.node("ShaderNodeNewGeometry").outputs["Position"])
    mixed.output(mixed.blend(0.5, 0.0, place))
    # Blender 5.2: a vector and a number in its gap. 4.5: two vectors, two colours and three numbers.
    evaluates = addon.compat.EEVEE_EVALUATES_CONSTANTS
    assert room(mixed.tree) == (16 if evaluates else 4 * 16 + 4), "of a Mix node, the sockets of other data types"
    moved = addon.builder.Tree(bpy.data.node_groups.new("Moved", "ShaderNodeTree"))
    addon.interface.add_interface(moved.tree, (), (socket("Sum", "Vector", ""),))
    place = moved.value(moved.node("ShaderNodeNewGeometry").outputs["Position"])
    computed = moved.value(moved.node("ShaderNodeMath", 1.0, 2.0).outputs[0])
    moved.output(moved.vector_math("ADD", place, moved.vector(computed, 2.0, 3.0)))
    # Blender 5.2: the computed vector, an unused one and a number. 4.5: an unused vector and six numbers.
    assert room(moved.tree) == (2 * 16 if evaluates else 16 + 5 * 4), "what depends on constants alone"


def test_sources_that_do_not_fit_are_left_to_the_rest(addon, scene, grating, group, monkeypatch, capfd):
    everything = addon.interface.size_of(group).constant_bytes
    assert answers(addon, group) == 1 + 3 and addon.skin.crowded(group) == []
    leave(addon, monkeypatch, everything - 1)
    addon.skin.refill(group, addon.response.responses_in(group))
    assert answers(addon, group) == 1 + 2
    a_source = everything - addon.interface.size_of(group).constant_bytes
    leave(addon, monkeypatch, everything - a_source - 1)
    addon.skin.refill(group, addon.response.responses_in(group))
    (line,) = addon.skin.crowded(group)
    assert answers(addon, group) == 1 + 1
    assert line == (
        "Diffraction waves: 2 of the world's 3 bright spots are noisy, because EEVEE has no room for them; use "
        "fewer lamps, or fewer gratings in its Variation"
    )
    assert line in reports(bpy.ops.grating.assign, capfd)
    layout, context = Layout(), context_of()
    addon.light_part.draw_warnings(layout, context, addon.facts.facts_of(context))
    assert line in layout.noted("ERROR")
    # Without a change the group is not rebuilt.
    monkeypatch.setattr(addon.skin, "fill_group", lambda *_, **__: pytest.fail("the group is built again"))
    addon.lighting.update_all_lamps()
    monkeypatch.undo()
    # The lamps alone exceed the limit.
    leave(addon, monkeypatch, 1000)
    addon.skin.refill(group, addon.response.responses_in(group))
    assert answers(addon, group) == 1
    (line,) = addon.skin.crowded(group)
    assert line.startswith("Diffraction waves: too large for EEVEE") and "use fewer lamps" in line


def test_a_heavy_material_says_so_before_the_first_picture(addon, scene, grating, group, monkeypatch, capfd):
    """Nodes and look-ups are those that reach the material's output, and of each group as often as it is used."""
    size = addon.interface.size_of(group)
    layout, context = Layout(folded=False), context_of()
    addon.quality_part.draw_quality(layout, context, grating)
    assert f"Nodes: {size.nodes}; look-ups a sample: {size.look_ups}" in layout.labels
    monkeypatch.setattr(addon.skin, "_HEAVY_LOOK_UPS", size.look_ups)
    assert addon.skin.heavy(group) == []
    monkeypatch.setattr(addon.skin, "_HEAVY_LOOK_UPS", size.look_ups - 1)
    (line,) = addon.skin.heavy(group)
    assert line.startswith(f"Diffraction waves: slow on a graphics card, by its {size.look_ups} look-ups a sample; use")
    assert line in reports(bpy.ops.grating.assign, capfd)
    addon.quality_part.draw_quality(layout, context, grating)
    assert line in layout.noted("INFO")


def test_a_disc_keeps_its_budget(addon, scene):
    """A graphics card takes a material's nodes one by one. The budgets are what a CD had when this test was written;
    growth needs a reason."""
    bpy.ops.grating.add_preset(preset="cd", assign=True)
    group, size_of = scene.natural_gratings.active().group, addon.interface.size_of
    nodes, look_ups, _ = size_of(group)
    # Blender 4.5 does not evaluate what depends on constants alone.
    assert nodes <= (634 if addon.compat.EEVEE_EVALUATES_CONSTANTS else 665)
    assert look_ups <= 19
    for _ in range(2):
        scene.collection.objects.link(bpy.data.objects.new("Further", bpy.data.lights.new("Further", "SUN")))
    addon.lighting.update_all_lamps()
    # A loop has the nodes that answer to a lamp once. In 4.5 each lamp has its own, and an emission that Cycles skips.
    assert size_of(group).nodes - nodes <= (45 if addon.compat.HAS_LOOPS else 2 * 291)
    assert size_of(group).look_ups == look_ups + 2 * 8, "in each turn"
    if addon.compat.HAS_LOOPS:
        for _ in range(5):
            scene.collection.objects.link(bpy.data.objects.new("Further", bpy.data.lights.new("Further", "SUN")))
        addon.lighting.update_all_lamps()
        assert size_of(group).nodes - nodes <= 317, "two answers"


@pytest.fixture(scope="module")
def skins(tmp_path_factory):
    """The bakes of two snakes, with about as many constants as bakes of dE 1."""
    folder, request = tmp_path_factory.mktemp("skins"), BakeRequest(coherence_length_m=6e-6, delta_e=5)
    surfaces = (read_height_map(f"sample:{name}") for name in ("elaphe", "xenopeltis"))
    return [bake_to_folder([each], request, folder)["files"][0] for each in surfaces]


@pytest.mark.night("test_sources_that_do_not_fit_are_left_to_the_rest")
def test_a_snake_of_two_bakes_reads_all_eight_sources(addon, scene, skins):
    """Its constants once took 67,264 of EEVEE's 65,536 bytes, and it was magenta."""
    gratings = scene.natural_gratings
    for path in skins:
        made = gratings.items.add()
        made.name, made.bake_path = Path(path).stem, path
    gratings.active_index = 0
    scene.world = bpy.data.worlds.new("World")
    addon.compat.enable_nodes(scene.world)
    source = Source(np.array((0.0, 0.6, 0.8)), np.array((3.0, 2.0, 1.0)), 1e-4)
    addon.sky.hold_sources(scene, [source] * 8, fingerprint=addon.fitting_worlds._fingerprint(scene), missed=0.0)
    assert bpy.ops.grating.assign() == {"FINISHED"}
    addon.making_materials.vary(
        scene, gratings.items[0], addon.grating.Variation(shares=(0.4,)), others=[gratings.items[1]]
    )
    group = gratings.items[0].group
    scene.world = None
    assert len(addon.response.responses_in(group)) == 2

    def fits(number: int, sources: int = 8) -> bool:
        held = addon.interface.size_of(gratings.items[0].material.node_tree).constant_bytes
        return answers(addon, group) == number and group["ng_sources_read"] == sources and held <= addon.interface.ROOM

    assert fits(2) and addon.skin.crowded(group) == []  # the label counts nodes of the first bake
    addon.skin.set_up(group, every_lamp=True)
    if addon.compat.EEVEE_EVALUATES_CONSTANTS:
        assert fits(1 + 8) and addon.skin.crowded(group) == []
    else:  # Blender 4.5 stores three times as many constants of a Mix node
        assert fits(1 + 6, sources=6) and len(addon.skin.crowded(group)) == 1


def test_a_base_that_leaves_no_room_is_told(addon, grating, group, monkeypatch, capfd):
    assert addon.material.overfull([grating.material]) == []
    room = addon.interface.size_of(group).constant_bytes + addon.skin._LEFT
    for module in (addon.skin, addon.material):
        monkeypatch.setattr(module, "ROOM", room)
    tree = addon.builder.Tree(grating.material.node_tree)
    base = next(node for node in tree.tree.nodes if node.label == "Skin")
    colour = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Position"])
    for _ in range(addon.skin._LEFT // 16):
        colour = tree.vector_math("ADD", colour, (1.0, 0.0, 0.0))
    tree.feed(base.inputs["Base Color"], colour)
    assert addon.skin.crowded(group) == []
    told = reports(bpy.ops.grating.add_diffraction, capfd)
    assert f"{grating.material.name}: too large for EEVEE, which may show it magenta; use fewer lamps" in told

# SPDX-License-Identifier: GPL-3.0-or-later
"""Varying a grating: the stored choice, refusals, what it needs of meshes, and the bakes of the other gratings."""

import shutil

import bpy
import pytest

from tests.addon.conftest import reports


@pytest.fixture
def others(scene, grating, baked, tmp_path):
    """The scene's three gratings; the first is active, and the plane shows it."""
    items = scene.natural_gratings.items
    for name in ("second", "third"):
        path = tmp_path / f"{name}.exr"
        shutil.copy(baked, path)
        made = items.add()
        made.name, made.bake_path = name, str(path)
    bpy.ops.grating.lights(lights="LAMPS")
    assert bpy.ops.grating.assign() == {"FINISHED"}
    return list(items)


def responses(addon, grating):
    return [response.group.name for response in addon.response.responses_in(grating.group)]


def test_the_choice_is_noted_told_and_asked_for_again(scene, others, addon, capfd):
    told = reports(lambda: bpy.ops.grating.vary(second="second", second_share=0.3, third="third", third_share=0.2,
                                                softness=0.1, turn=0.1, size_m=0.5), capfd)  # fmt: skip
    assert "waves: 50% + 30% + 20%, turned by 5.73°" in told
    choice = addon.skin.variation_of(others[0].group)
    assert choice.shares == pytest.approx((0.3, 0.2)) and choice.size_m == 0.5 and choice.pattern == "NOISE"
    assert [g.name for g in addon.making_materials.varied_with(scene, others[0])] == ["second", "third"]
    assert [name.split()[-1] for name in responses(addon, others[0])] == ["waves", "second", "third"]
    assert bpy.context.object.add_rest_position_attribute


def test_without_a_choice_all_is_as_before(scene, others, addon):
    def nodes():
        return sorted(node.bl_idname for node in others[0].group.nodes)

    before = nodes()
    bpy.ops.grating.vary(second="second", turn=0.1)
    assert len(nodes()) > len(before)
    bpy.ops.grating.vary()
    assert nodes() == before and addon.skin.variation_of(others[0].group) == addon.grating.Variation()
    assert responses(addon, others[0]) == responses(addon, others[0])[:1]


def test_a_turn_alone_asks_no_other_relief(scene, others, addon):
    bpy.ops.grating.vary(turn=0.1)
    assert len(responses(addon, others[0])) == 1
    assert [node.bl_idname for node in others[0].group.nodes].count("ShaderNodeTexNoise") == 1


def test_no_noise_for_an_attribute(scene, others):
    bpy.ops.grating.vary(second="second", pattern="ATTRIBUTE")
    kinds = [node.bl_idname for node in others[0].group.nodes]
    assert "ShaderNodeTexNoise" not in kinds


def test_a_mesh_without_the_attribute_is_told_of(scene, others, capfd):
    told = reports(lambda: bpy.ops.grating.vary(second="second", pattern="ATTRIBUTE"), capfd)
    assert "Plane: has no attribute scale_random; it shows the first grating alone" in told
    bpy.ops.mesh.primitive_plane_add()
    told = reports(bpy.ops.grating.assign, capfd)
    assert "Plane.001: has no attribute scale_random" in told and bpy.context.object.add_rest_position_attribute


@pytest.mark.parametrize(("choice", "told"), [
    ({"second": "waves"}, "waves: waves is named twice; choose another grating"),
    ({"second": "second", "third": "second"}, "waves: second is named twice"),
    ({"second": "fourth"}, "fourth: no such grating in the scene; there are waves, second, third"),
    ({"second": "second", "second_share": 0.7, "third": "third", "third_share": 0.5}, "waves: the others cover 120%"),
    ({"second": "second", "pattern": "ATTRIBUTE", "attribute": ""}, "waves: its Pattern needs an Attribute"),
])  # fmt: skip
def test_what_is_wrong_is_told_and_nothing_changes(scene, others, addon, choice, told):
    bpy.ops.grating.vary(third="third", turn=0.2)
    before = addon.skin.variation_of(others[0].group), responses(addon, others[0])
    with pytest.raises(RuntimeError, match=told) as fault:
        bpy.ops.grating.vary(**choice)
    assert len(str(fault.value).strip().splitlines()) == 1
    assert (addon.skin.variation_of(others[0].group), responses(addon, others[0])) == before


def test_one_that_is_not_baked_is_refused(scene, others, addon):
    others[2].bake_path = ""
    with pytest.raises(RuntimeError, match="third: not baked yet; press Bake Grating first"):
        bpy.ops.grating.vary(second="second", third="third")
    assert others[1].group is None and len(responses(addon, others[0])) == 1


def used():
    """The numbers of pictures and node groups that are used."""
    return [sum(one.users > 0 for one in kind) for kind in (bpy.data.images, bpy.data.node_groups)]


def test_another_bake_of_one_is_shown_by_all_that_vary_by_it(scene, others, addon, baked, tmp_path):
    bpy.ops.grating.vary(second="second", second_share=0.4)
    path = tmp_path / "again.exr"
    shutil.copy(baked, path)
    others[1].bake_path = str(path)
    before = used()
    addon.making_materials.refresh_group(others[1])
    own, other = addon.response.responses_in(others[0].group)
    assert other == addon.response.response_in(others[1].group) and other != own
    assert addon.skin.variation_of(others[0].group).shares == pytest.approx((0.4,))
    assert used() == before, "the old bake is gone"


def test_a_removed_grating_stays_where_it_is_shown(scene, others, addon):
    bpy.ops.grating.vary(second="second")
    scene.natural_gratings.active_index = 1
    bpy.ops.grating.remove()
    bpy.data.orphans_purge(do_recursive=True)
    assert len(responses(addon, scene.natural_gratings.items[0])) == 2


def test_lamps_that_come_later_light_all_reliefs(scene, others, addon):
    bpy.ops.grating.vary(second="second", third="third")
    scene.collection.objects.link(bpy.data.objects.new("Second", bpy.data.lights.new("Second", "POINT")))
    addon.lighting.update_all_lamps()
    labels = [node.label for node in others[0].group.nodes]
    made = 1 if addon.compat.HAS_LOOPS else 2
    assert [labels.count(label) for label in ("Response", "Response 2", "Response 3")] == [made] * 3


def test_bakes_of_one_layout_cost_little_more_than_one(scene, others, addon, baked, tmp_path):
    """Layers of one picture, which new lamps and files keep, a lost picture renews and other bakes replace."""
    for each in others[1:]:
        shutil.copy(baked.with_name("waves.lobes.exr"), tmp_path / f"{each.name}.lobes.exr")
    group, layered_in = others[0].group, addon.response.layered_in
    nodes = addon.interface.size_of(group).nodes
    bpy.ops.grating.vary(second="second", second_share=0.3, third="third", third_share=0.3)
    layers = layered_in(group)
    assert layers is not None and len(responses(addon, others[0])) == 3
    assert addon.interface.size_of(group).nodes < 1.15 * nodes
    scene.collection.objects.link(bpy.data.objects.new("Second", bpy.data.lights.new("Second", "POINT")))
    addon.lighting.update_all_lamps()
    assert layered_in(group) == layers
    made = 1 if addon.compat.HAS_LOOPS else 2
    assert [node.label for node in group.nodes].count("Layered Response") == made
    next(node for node in layers.group.nodes if node.type == "TEX_IMAGE").image = None
    assert "its picture was deleted" in str(*addon.lost_parts.faults_of([group]))
    bpy.ops.grating.mend()
    assert layered_in(group) is not None and not addon.lost_parts.faults_of([group])
    bpy.ops.grating.vary()
    assert layered_in(group) is None and not any("ng_layers" in each for each in bpy.data.node_groups)


def test_undo_takes_it_back(scene, others, addon):
    bpy.ops.ed.undo_push(message="Before")
    bpy.ops.grating.vary(second="second", turn=0.1)
    bpy.ops.ed.undo_push(message="Varied")
    bpy.ops.ed.undo()
    grating = bpy.context.scene.natural_gratings.items[0]
    assert addon.skin.variation_of(grating.group) == addon.grating.Variation()
    assert len(responses(addon, grating)) == 1


def test_the_verb_varies_and_saves(addon, scene, baked, tmp_path, capfd):
    second, blend = tmp_path / "second.exr", tmp_path / "varied.blend"
    shutil.copy(baked, second)
    assert addon.commands.execute(["assign", str(baked), "--object", "Plane", "--save", str(blend)]) == 0
    asked = ["vary", str(baked), "--with", f"{second}=0.25", "--turn", "10", "--size-mm", "50", "--save", str(blend)]
    assert addon.commands.execute(asked) == 0
    assert "waves: 75% + 25%, turned by 10°" in capfd.readouterr().out
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    grating = bpy.context.scene.natural_gratings.items[0]
    choice = addon.skin.variation_of(grating.group)
    assert choice.shares == (0.25,) and choice.size_m == pytest.approx(0.05) and len(responses(addon, grating)) == 2


@pytest.mark.parametrize(("asked", "told"), [
    (["--with", "second.exr"], "give BAKE=SHARE"),
    (["--with", "second.exr=2"], "give a number from 0 to 1"),
    (["--with", "nowhere.exr=0.3"], "nowhere.exr: no bake there"),
    (["--with", "a=0.1", "--with", "b=0.1", "--with", "c=0.1"], "--with c: one too many"),
    (["--turn", "nan"], "give a number from 0 to 90"),
])  # fmt: skip
def test_faults_of_the_verb_are_one_line(addon, scene, baked, tmp_path, capfd, asked, told):
    capfd.readouterr()
    assert addon.commands.execute(["vary", str(baked), *asked, "--save", str(tmp_path / "a.blend")]) != 0
    (line,) = [line for line in capfd.readouterr().err.splitlines() if line.startswith("error:")]
    assert told in line and list(tmp_path.iterdir()) == []

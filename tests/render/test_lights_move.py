# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that move, change and are animated after assignment, after save and reload, after append and link: each picture
against that of a scene whose lamps were so from the start."""

from dataclasses import dataclass, field

import bpy
import numpy as np
import pytest

from .conftest import Stage, clear, read_channels, rgb_of

PIXELS = 32
ENGINES = ["cycles", "eevee"]


@dataclass(frozen=True)
class Lamp:
    """What an artist sets of a lamp."""

    kind: str
    location: tuple = (0, 0, 1)
    to: tuple = (0, 0, 1)
    settings: dict = field(default_factory=dict)


BEFORE = {
    "Sun": Lamp("SUN", to=(0.1, 0.3, 1), settings={"energy": 1.0, "angle": 0.0}),
    "Point": Lamp("POINT", (0.5, 0.8, 0.9), settings={"energy": 30.0, "shadow_soft_size": 0.0}),
}
AFTER = {
    "Sun": Lamp("SUN", to=(0.4, -0.2, 1), settings={"energy": 2.5, "angle": 0.01, "color": (1.0, 0.7, 0.4)}),
    "Point": Lamp(
        "POINT", (-0.7, -0.9, 1.3), settings={"energy": 55.0, "shadow_soft_size": 0.01, "color": (0.3, 0.6, 1.0)}
    ),
}


def add_lamps(stage, lamps):
    for name, lamp in lamps.items():
        stage.lamp(lamp.kind, lamp.location, lamp.to, name=name, **lamp.settings)


def change(lamps):
    """Make the file's lamps of these names what is said, as an artist would: none is made anew."""
    from mathutils import Vector

    for name, lamp in lamps.items():
        made = bpy.data.objects[name]
        made.location = lamp.location
        made.rotation_euler = Vector(lamp.to).to_track_quat("Z", "Y").to_euler()
        for key, value in lamp.settings.items():
            setattr(made.data, key, value)


def add_camera(stage):
    stage.camera((0.1, -0.4, 0.9), (0.05, 0, 0), angle=np.radians(80))


def add_plane(name="Plane"):
    """A plane, which alone is selected."""
    bpy.ops.mesh.primitive_plane_add(size=2)
    bpy.context.object.name = name
    return bpy.context.object


def add_grating(stage, path, name="blazed"):
    gratings = stage.scene.natural_gratings
    grating = gratings.items.add()
    grating.name, grating.bake_path = name, str(path)
    gratings.active_index = len(gratings.items) - 1
    return grating


def build(stage, path, lamps):
    """Plane, camera and lamps, and the grating put on the plane by its button; the plane."""
    plane = add_plane()
    add_camera(stage)
    add_lamps(stage, lamps)
    add_grating(stage, path)
    assert bpy.ops.grating.assign() == {"FINISHED"}
    return plane


_truths = {}


def truth(stage, path, lamps, engine):
    """The picture of a scene whose lamps were so from the start; the stage is empty after it."""
    key = (engine, repr(lamps))
    if key not in _truths:
        build(stage, path, lamps)
        _truths[key] = stage.rgb(engine, PIXELS)
        clear(stage.addon, stage.scene)
    return _truths[key]


def agree(picture, wanted):
    """The same scene by the same renderer without noise. Lamps may come in another order, so that float32 sums of some
    tens of terms end otherwise; EEVEE's pictures are half floats, cut off: one step is 2^-10 of a value."""
    assert wanted.max() > 0.05
    differ = np.ptp(wanted.reshape(-1, 3), axis=0)
    assert differ.min() > 0.01, "a flat picture tells nothing"
    np.testing.assert_allclose(picture, wanted, rtol=2**-9, atol=1e-5 * wanted.max())


def differs(picture, other):
    assert np.abs(picture - other).max() > 0.05 * other.max()


@pytest.fixture
def files(stage):
    """The stage, and after the test an empty file of one scene, whatever was opened."""
    yield stage
    bpy.ops.wm.read_homefile(use_empty=True)


def now(stage):
    """The stage over the scene that is open now."""
    return Stage(stage.addon, stage.folder, bpy.context.scene)


def save(stage, name="scene"):
    path = stage.folder / f"{name}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.mark.parametrize(("engine", "persistent"), [("cycles", False), ("cycles", True), ("eevee", False)])
def test_a_lamp_changed_after_assignment(stage, baked, engine, persistent):
    wanted = truth(stage, baked[0], AFTER, engine)
    build(stage, baked[0], BEFORE)
    stage.scene.render.use_persistent_data = persistent
    try:
        differs(stage.rgb(engine, PIXELS), wanted)
        change(AFTER)
        agree(stage.rgb(engine, PIXELS), wanted)
    finally:
        stage.scene.render.use_persistent_data = False


def animate(frames):
    """Keyframes of all that the lamps have."""
    for frame, lamps in frames.items():
        change(lamps)
        for name, lamp in lamps.items():
            made = bpy.data.objects[name]
            for path in ("location", "rotation_euler"):
                made.keyframe_insert(path, frame=frame)
            for path in ("color", *lamp.settings):
                made.data.keyframe_insert(path, frame=frame)


@pytest.mark.parametrize(("engine", "persistent"), [("cycles", False), ("cycles", True), ("eevee", False)])
def test_animated_lamps(stage, baked, engine, persistent):
    """By frame_set, and frame by frame as an animation is rendered."""
    wanted = {1: truth(stage, baked[0], BEFORE, engine), 2: truth(stage, baked[0], AFTER, engine)}
    build(stage, baked[0], BEFORE)
    scene = stage.scene
    scene.render.use_persistent_data = persistent
    try:
        animate({1: BEFORE, 2: AFTER})
        for frame in (2, 1):
            scene.frame_set(frame)
            agree(stage.rgb(engine, PIXELS), wanted[frame])
        scene.frame_start, scene.frame_end = 1, 2
        scene.render.filepath = str(stage.folder / "frame_####.exr")
        bpy.ops.render.render(animation=True)
        for frame in (1, 2):
            agree(rgb_of(read_channels(stage.folder / f"frame_{frame:04}.exr")), wanted[frame])
    finally:
        scene.render.use_persistent_data = False


@pytest.mark.parametrize("engine", ENGINES)
def test_after_save_and_reload(files, baked, engine):
    wanted = truth(files, baked[0], AFTER, engine)
    build(files, baked[0], BEFORE)
    path = save(files)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    change(AFTER)
    agree(now(files).rgb(engine, PIXELS), wanted)


def library(stage, path, lamps=2, unlinked=False):
    """A file whose plane is lit by other lamps; not by the first, if `unlinked`. Its path."""
    others = {"A": Lamp("SUN", to=(0, 0.5, 1)), "B": Lamp("SUN", to=(0.5, 0, 1))}
    plane = build(stage, path, dict(list(others.items())[:lamps]))
    collection = bpy.data.collections.new("Held")
    stage.scene.collection.children.link(collection)
    collection.objects.link(plane)
    stage.scene.collection.objects.unlink(plane)
    if unlinked:
        keep_from(bpy.data.objects["A"], plane)
        bpy.ops.grating.update_lights()
    return save(stage, "library")


def keep_from(lamp, mesh, state="EXCLUDE"):
    """Light linking: the lamp's receivers, with one mesh."""
    receivers = bpy.data.collections.new("Receivers")
    receivers.objects.link(mesh)
    receivers.collection_objects[0].light_linking.link_state = state
    lamp.light_linking.receiver_collection = receivers


def other_file(stage, lamps=AFTER):
    """Another file with lamps and a camera, and nothing of the extension's."""
    bpy.ops.wm.read_homefile(use_empty=True)
    made = now(stage)
    clear(made.addon, made.scene)
    add_camera(made)
    add_lamps(made, lamps)
    return made


def bring_by_operator(path, kind, name, link):
    bring = bpy.ops.wm.link if link else bpy.ops.wm.append
    settings = {"instance_collections": False} if kind == "Collection" else {}
    bring(filepath=f"{path}/{kind}/{name}", directory=f"{path}/{kind}/", filename=name, **settings)


def bring_by_script(path, kind, name, link):
    members = {"Object": "objects", "Collection": "collections", "Material": "materials"}[kind]
    with bpy.data.libraries.load(str(path), link=link) as (_, target):
        setattr(target, members, [name])
    (made,) = getattr(target, members)
    if kind == "Object":
        bpy.context.scene.collection.objects.link(made)
    if kind == "Collection":
        bpy.context.scene.collection.children.link(made)
    return made


LINK = pytest.mark.parametrize("link", [False, True], ids=["append", "link"])


@pytest.mark.parametrize(
    ("bring", "engine"), [(bring_by_operator, "cycles"), (bring_by_operator, "eevee"), (bring_by_script, "cycles")]
)
@LINK
@pytest.mark.parametrize("kind", ["Object", "Collection"])
def test_brought_into_another_file(files, baked, bring, engine, kind, link):
    wanted = truth(files, baked[0], AFTER, engine)
    path = library(files, baked[0])
    made = other_file(files)
    bring(path, kind, "Held" if kind == "Collection" else "Plane", link)
    agree(made.rgb(engine, PIXELS), wanted)
    change(BEFORE)
    differs(made.rgb(engine, PIXELS), wanted)


@LINK
def test_a_material_brought_into_another_file(files, baked, link):
    wanted = truth(files, baked[0], AFTER, "cycles")
    path = library(files, baked[0])
    made = other_file(files)
    add_plane()
    material = bring_by_script(path, "Material", "Diffraction blazed", link)
    bpy.context.object.data.materials.append(material)
    agree(made.rgb("cycles", PIXELS), wanted)


def test_an_appended_material_learns_of_more_lamps(files, baked):
    wanted = truth(files, baked[0], AFTER, "cycles")
    path = library(files, baked[0], lamps=1)
    made = other_file(files)
    bring_by_operator(path, "Object", "Plane", link=False)
    agree(made.rgb("cycles", PIXELS), wanted)


@LINK
def test_the_light_linking_of_another_file_stays_there(files, baked, link):
    """The plane is lit by the first lamp here, though the first lamp there was kept from it."""
    wanted = truth(files, baked[0], AFTER, "cycles")
    path = library(files, baked[0], unlinked=True)
    made = other_file(files)
    made.addon.follow.follow_lamps(made.scene)
    bring_by_operator(path, "Object", "Plane", link)
    agree(made.rgb("cycles", PIXELS), wanted)


def test_a_linked_material_of_fewer_lamps_says_so(files, baked, capfd):
    """A linked group cannot grow: its file had one lamp, this scene has two."""
    path = library(files, baked[0], lamps=1)
    other_file(files)
    bring_by_operator(path, "Object", "Plane", link=True)
    assert bpy.ops.grating.update_lights() == {"FINISHED"}
    said = capfd.readouterr()
    assert "Diffraction blazed: linked, it knows 1 of 2 lamps" in said.out + said.err


@pytest.mark.parametrize(
    ("engine", "listed", "state"),
    [
        ("cycles", "Plane", "EXCLUDE"),
        ("cycles", "Plane", "INCLUDE"),
        ("cycles", "Other", "INCLUDE"),
        ("eevee", "Other", "INCLUDE"),
    ],
)
def test_light_linking(stage, baked, engine, listed, state):
    lit = listed == "Plane" and state == "INCLUDE"
    wanted = truth(stage, baked[0], AFTER if lit else {"Point": AFTER["Point"]}, engine)
    build(stage, baked[0], AFTER)
    stage.add("Other", bpy.data.meshes.new("Other"))
    keep_from(bpy.data.objects["Sun"], bpy.data.objects[listed], state)
    assert bpy.ops.grating.update_lights() == {"FINISHED"}
    agree(stage.rgb(engine, PIXELS), wanted)
    bpy.data.objects["Sun"].light_linking.receiver_collection = None
    assert bpy.ops.grating.update_lights() == {"FINISHED"}
    agree(stage.rgb(engine, PIXELS), truth_of_all(engine))


def truth_of_all(engine):
    return _truths[engine, repr(AFTER)]


def instance_a_lamp(stage):
    """A lamp that only an instance of its collection shows."""
    held = bpy.data.collections.new("Held")
    stage.add("Inside", bpy.data.lights.new("Inside", "SUN"), collection=held)
    shown = stage.add("Instance", None)
    shown.instance_type, shown.instance_collection = "COLLECTION", held


def test_instanced_lamps_are_named(stage, baked, capfd):
    instance_a_lamp(stage)
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="Inside.*Make Instances Real"):
        bpy.ops.grating.update_lights()
    build(stage, baked[0], AFTER)
    capfd.readouterr()
    assert bpy.ops.grating.update_lights() == {"FINISHED"}
    said = capfd.readouterr()
    assert "Inside; use Object > Apply > Make Instances Real" in said.out + said.err


@pytest.mark.parametrize("engine", ENGINES)
def test_a_lamp_added(stage, baked, engine):
    wanted = truth(stage, baked[0], AFTER, engine)
    build(stage, baked[0], {"Sun": AFTER["Sun"]})
    is_up_to_date = stage.addon.follow.is_up_to_date
    assert is_up_to_date(stage.scene)
    assert stage.addon.follow.followed_lamps(stage.scene) == [bpy.data.objects["Sun"]]
    differs(stage.rgb(engine, PIXELS), wanted)
    add_lamps(stage, {"Point": AFTER["Point"]})
    assert not is_up_to_date(stage.scene)
    assert bpy.ops.grating.update_lights() == {"FINISHED"}
    assert is_up_to_date(stage.scene)
    agree(stage.rgb(engine, PIXELS), wanted)
    bpy.data.objects.remove(bpy.data.objects["Point"])
    assert not is_up_to_date(stage.scene)


@pytest.mark.parametrize("kind", ["SUN", "POINT", "SPOT", "AREA"])
def test_only_nodes_that_change_a_lamp_are_reported(stage, kind):
    bpy.ops.object.light_add(type=kind)
    lamp = bpy.context.object
    if bpy.app.version < (5, 0, 0):
        lamp.data.use_nodes = True
    told = stage.addon.find.unfollowed_features
    assert told(stage.scene) == []
    emission = next(n for n in lamp.data.node_tree.nodes if n.type == "EMISSION")
    emission.inputs["Strength"].default_value = 2.0
    assert told(stage.scene) == [f"{lamp.name}: its shader nodes are not followed"]


def dump(material) -> list[str]:
    """All that an artist set in a material, but where its nodes lie."""
    tree = material.node_tree
    lines = [f"emission_sampling {material.cycles.emission_sampling}", f"own {sorted(material.keys())}"]
    for node in tree.nodes:
        lines.append(f"{node.bl_idname} {node.name!r} {node.label!r} mute {node.mute}")
        for socket in (*node.inputs, *node.outputs):
            if hasattr(socket, "default_value"):
                value = socket.default_value
                value = tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
                lines.append(f"{node.name} {socket.identifier} {value} {socket.hide} {socket.is_output}")
    ends = ((link.from_socket, link.to_socket) for link in tree.links)
    lines += [f"{a.node.name}.{a.identifier} -> {b.node.name}.{b.identifier}" for a, b in ends]
    return sorted(lines)


def artists_material(addon):
    """Two outputs, a bump, a group of the artist's own, values off their defaults."""
    material = bpy.data.materials.new("Artist's")
    addon.compat.enable_nodes(material)
    material.node_tree.nodes.clear()
    nodes, links = material.node_tree.nodes, material.node_tree.links
    principled = nodes.new("ShaderNodeBsdfPrincipled")
    principled.name, principled.label = "Mine", "Paint"
    principled.inputs["Base Color"].default_value = (0.3, 0.1, 0.05, 1)
    principled.inputs["Roughness"].default_value = 0.37
    noise, bump = nodes.new("ShaderNodeTexNoise"), nodes.new("ShaderNodeBump")
    links.new(noise.outputs[0], bump.inputs["Height"])
    links.new(bump.outputs[0], principled.inputs["Normal"])
    own = nodes.new("ShaderNodeGroup")
    own.node_tree = bpy.data.node_groups.new("Own", "ShaderNodeTree")
    for target in ("CYCLES", "EEVEE"):
        output = nodes.new("ShaderNodeOutputMaterial")
        output.target = target
        output.location = (300, 0)
        links.new(principled.outputs[0], output.inputs["Surface"])
    links.new(noise.outputs[0], output.inputs["Displacement"])
    material.cycles.emission_sampling = "FRONT"
    return material


def on_a_plane(stage, path, material):
    plane = add_plane()
    plane.data.materials.append(material)
    add_lamps(stage, AFTER)
    return add_grating(stage, path)


def test_diffraction_added_swapped_and_removed_leaves_a_material_as_it_was(stage, baked, addon):
    material = artists_material(addon)
    first = on_a_plane(stage, baked[0], material)
    before = dump(material)
    places = {n.name: tuple(n.location) for n in material.node_tree.nodes}
    assert bpy.ops.grating.add_diffraction() == {"FINISHED"}
    assert material.cycles.emission_sampling == "NONE"
    nodes = addon.material.diffraction_nodes(material)
    assert len(nodes) == 2
    nodes[0].inputs["Rotation"].default_value = 0.3

    second = add_grating(stage, baked[0], "second")
    assert bpy.ops.grating.add_diffraction() == {"FINISHED"}
    nodes = addon.material.diffraction_nodes(material)
    assert {n.node_tree for n in nodes} == {second.group} != {stage.scene.natural_gratings.items[0].group}
    assert first is not second
    assert sorted(round(n.inputs["Rotation"].default_value, 6) for n in nodes) == [0.0, 0.3]
    assert all(n.inputs["Base"].is_linked and n.inputs["Normal"].is_linked for n in nodes)

    assert bpy.ops.grating.remove_diffraction() == {"FINISHED"}
    assert dump(material) == before
    assert {n.name: tuple(n.location) for n in material.node_tree.nodes} == places


def test_diffraction_over_an_output_without_a_shader_is_removed_whole(stage, baked, addon):
    material = artists_material(addon)
    tree = material.node_tree
    for link in list(tree.links):
        tree.links.remove(link)
    on_a_plane(stage, baked[0], material)
    before = dump(material)
    bpy.ops.grating.add_diffraction()
    bpy.ops.grating.remove_diffraction()
    assert dump(material) == before


def test_a_diffraction_node_deleted_by_hand_does_not_lose_the_artists_setting(stage, baked, addon):
    material = artists_material(addon)
    on_a_plane(stage, baked[0], material)
    bpy.ops.grating.add_diffraction()
    for node in addon.material.diffraction_nodes(material):
        material.node_tree.nodes.remove(node)
    bpy.ops.grating.add_diffraction()
    bpy.ops.grating.remove_diffraction()
    assert material.cycles.emission_sampling == "FRONT"

# SPDX-License-Identifier: GPL-3.0-or-later
"""Every operator in every mode on every selection: it works, is grey with a reason, or fails in one line and changes
nothing."""

import bpy
import numpy as np
import pytest

from tests.addon.direction.test_seams import grid, turn_uv

# Arguments that make an operator quick, or let it do something.
GIVEN = {
    "add_preset": {"preset": "jewel_beetle"},
    "add_snake": {"faces": 11_000},
    "add_shed_skin": {"faces": 11_000},
    "bake_direction_map": {"size": 16},
    "comb": {"source": "X"},
    "direction": {"kind": "AXIS"},
    "hologram": {"pattern": "DOT_MATRIX"},
    "import_height_map": {"filepath": "sample:flat"},
    "lights": {"lights": "LAMPS"},
    "make_assets": {"presets": "unknown"},
    "unwrap": {"size": 16, "method": "MINIMUM_STRETCH"},
    "vary": {"turn": 0.3},
}
MODES = ("SCULPT", "VERTEX_PAINT", "WEIGHT_PAINT", "POSE")


def link_of(mesh, path):
    """Link an object with this mesh from another file."""
    bpy.data.libraries.write(str(path), {bpy.data.objects.new("Guest", mesh)}, fake_user=True)
    bpy.data.objects.remove(bpy.data.objects["Guest"])
    with bpy.data.libraries.load(str(path), link=True) as (_, into):
        into.objects = ["Guest"]
    return into.objects[0]


@pytest.fixture
def stage(scene, grating, tmp_path):
    """A mesh with the grating and seams, a camera, no world, and further objects to select."""
    body = grid(8)
    body.name = "Body"
    turn_uv(body.data, np.array([polygon.center.x for polygon in body.data.polygons]) < 0, 1)
    scene.collection.objects.link(bpy.data.objects.new("Hollow", bpy.data.meshes.new("Hollow")))
    scene.collection.objects.link(link_of(body.data, tmp_path / "guest.blend"))
    bones = bpy.data.objects.new("Bones", bpy.data.armatures.new("Bones"))
    curve = bpy.data.objects.new("Curve", bpy.data.curves.new("Curve", "CURVE"))
    curve.data.splines.new("BEZIER").bezier_points.add(1)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location.z = 10
    for thing in (bones, curve, camera):
        scene.collection.objects.link(thing)
    scene.camera, world, scene.world = camera, scene.world, None
    begin("OBJECT", "Body")
    bpy.ops.grating.lights(lights="LAMPS")  # has the fewest nodes
    yield scene
    begin("OBJECT", "Body")
    scene.camera, scene.world = None, world


def begin(mode, *names):
    """Select objects and enter a mode with the first that supports it; without names the body is only active."""
    layer = bpy.context.view_layer
    if layer.objects.active is not None and bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    for each in layer.objects:
        each.select_set(each.name in names)
    things = [bpy.data.objects[name] for name in names] or [bpy.data.objects["Body"]]
    layer.objects.active = things[0]
    if mode == "POSE":
        layer.objects.active = bpy.data.objects["Bones"]
    elif mode != "OBJECT" and (things[0].library or (things[0].type != "MESH" and mode != "EDIT")):
        layer.objects.active = bpy.data.objects["Body"]
    if mode != "OBJECT":
        bpy.ops.object.mode_set(mode=mode)
        for each in layer.objects:
            each.select_set(each.name in names)


def contents():
    """Everything that operators may change in a file."""
    kinds = ("objects", "meshes", "materials", "node_groups", "images", "lights", "scenes", "armatures")
    held = {kind: sorted((one.name, one.library is None) for one in getattr(bpy.data, kind)) for kind in kinds}
    for thing in bpy.data.objects:
        held[thing.name] = [slot.material and slot.material.name for slot in thing.material_slots]
        held[thing.name] += sorted(thing.keys()) + [thing.mode]
    for scene in bpy.data.scenes:
        for grating in scene.natural_gratings.items:
            held[scene.name, grating.name] = {key: str(value) for key, value in grating.items()}
    for mesh in bpy.data.meshes:
        held["maps", mesh.name] = sorted(layer.name for layer in mesh.uv_layers)
    return held


SITUATIONS = {
    "nothing selected": (),
    "a mesh with the grating": ("Body",),
    "a linked object": ("Guest",),
    "a mesh without faces": ("Hollow",),
    "a curve": ("Curve",),
    "no camera and no lamp": ("Body",),
}


@pytest.mark.short("a mesh with the grating-OBJECT", "a mesh with the grating-EDIT")
@pytest.mark.parametrize(("situation", "mode"), [
    *((situation, mode) for situation in SITUATIONS for mode in ("OBJECT", "EDIT")),
    *(("a mesh with the grating", mode) for mode in MODES),
])  # fmt: skip
def test_no_operator_raises(stage, addon, capfd, monkeypatch, situation, mode):
    monkeypatch.setattr("webbrowser.open", lambda address: True)
    names = SITUATIONS[situation]
    if situation == "no camera and no lamp":
        stage.camera = None
        bpy.data.objects.remove(bpy.data.objects["Sun"])
    identifiers = [cls.bl_idname for cls in addon.package.CLASSES if issubclass(cls, bpy.types.Operator)]
    assert len(identifiers) > 20
    faults = []
    begin("OBJECT", "Body")
    assert bpy.ops.grating.assign() == {"FINISHED"}
    for name in (each.removeprefix("grating.") for each in identifiers):
        # Each further lamp costs the node groups half a second. Show Me uses a scene of its own, and fits its world.
        if (name == "add_sun" and mode != "EDIT") or (name == "show_me" and situation != "nothing selected"):
            continue
        begin(mode, *names)
        stage.natural_gratings.active_index = len(stage.natural_gratings.items) - 1 if name == "remove" else 0
        faults += [f"{name} {fault}" for fault in press(name, capfd)]
    assert faults == []


def press(name, capfd):
    """Run an operator; yields its faults."""
    before = contents()
    capfd.readouterr()
    try:
        getattr(bpy.ops.grating, name)(**GIVEN.get(name, {}))
    except RuntimeError as error:
        refusal = str(error).strip()
        if "\n" in refusal:
            yield f"raises: {refusal.splitlines()[-2]}"
        if "context is incorrect" in refusal:
            yield "is grey without a reason"
        if contents() != before:
            yield f"refuses ({refusal.splitlines()[-1]}), and something changed"
    printed = capfd.readouterr()
    if "Traceback" in printed.out + printed.err:
        yield f"prints a traceback: {printed.err[-300:]}"

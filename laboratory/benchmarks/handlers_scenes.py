# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes for handlers.py: a plane with a grating under a sun, plus a large number of one thing."""

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from precompute.world_sources.sources import Source

_SUN = Source(np.array((0.0, 0.6, 0.8)), np.array((3.0, 2.0, 1.0)), 1e-4)
_WORLD_NODES, _INSTANCES_A_SIDE, _COLLECTIONS, _SCANS, _MANY = 1000, 300, 1200, 9000, 1000


def plain(addon: SimpleNamespace, bake: Path) -> None:
    """A new file: a plane with a grating of the bake, under a sun and a sky whose sun was found."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add()
    scene.collection.objects.link(bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN")))
    scene.world = bpy.data.worlds.new("Sky")
    addon.compat.enable_nodes(scene.world)
    grating = scene.natural_gratings.items.add()
    grating.name, grating.source, grating.bake_path = "blazed", "sample:blazed", str(bake)
    grating.asked = addon.bakes._settings(grating.bake_request())
    # A timer would compute the scan's preview once; timers do not run here.
    from_sample = addon.levelling._asked(grating)
    addon.levelling._shown[from_sample] = addon.levelling._made(from_sample)
    bpy.context.object.select_set(True)
    assert bpy.ops.grating.assign() == {"FINISHED"}
    bpy.context.view_layer.update()


def _many_world_nodes(addon: SimpleNamespace) -> None:
    import bpy

    tree = bpy.context.scene.world.node_tree
    last = tree.nodes.new("ShaderNodeTexSky").outputs[0]
    for _ in range(_WORLD_NODES - 1):
        node = tree.nodes.new("ShaderNodeVectorMath")
        tree.links.new(last, node.inputs[0])
        last = node.outputs[0]
    tree.links.new(last, next(n for n in tree.nodes if n.type == "BACKGROUND").inputs["Color"])
    now = addon.world_probe.fingerprint(bpy.context.scene.world)
    addon.sky.hold_sources(bpy.context.scene, [_SUN], fingerprint=now, missed=0.0)


def _many_instances(addon: SimpleNamespace) -> None:
    import bpy

    bpy.ops.mesh.primitive_grid_add(x_subdivisions=_INSTANCES_A_SIDE - 1, y_subdivisions=_INSTANCES_A_SIDE - 1)
    grid = bpy.context.object
    bpy.ops.mesh.primitive_plane_add(size=1e-3)
    bpy.context.object.parent = grid
    grid.instance_type = "VERTS"


def _many_collections(addon: SimpleNamespace) -> None:
    """Collections on three levels with an object in each; the sun is in the deepest, with seven more lamps."""
    import bpy

    scene, sun = bpy.context.scene, bpy.data.objects["Sun"]
    above = [scene.collection]
    for number in range(_COLLECTIONS):
        child = bpy.data.collections.new(f"Collection {number}")
        child.objects.link(bpy.data.objects.new(f"Empty {number}", None))
        above[number % len(above)].children.link(child)
        if number in (9, 99):
            above = list(scene.collection.children_recursive)
    scene.collection.objects.unlink(sun)
    child.objects.link(sun)
    for number in range(7):
        lamp = bpy.data.objects.new(f"Lamp {number}", bpy.data.lights.new("Lamp", "POINT"))
        bpy.data.collections[f"Collection {100 + number}"].objects.link(lamp)


def _many_scans(addon: SimpleNamespace) -> None:
    """One grating that averages many scans."""
    import bpy

    grating = bpy.context.scene.natural_gratings.active()
    scans = [{"source": f"/scans/{n}.nid", "size_um": 9.0, "height_nm": None, "channel": None} for n in range(_SCANS)]
    grating.request = json.dumps({"scans": scans})


def _many_lamps(addon: SimpleNamespace) -> None:
    import bpy

    for number in range(_MANY):
        lamp = bpy.data.objects.new(f"Lamp {number}", bpy.data.lights.new("Lamp", "POINT"))
        bpy.context.scene.collection.objects.link(lamp)


def _many_materials(addon: SimpleNamespace) -> None:
    """One grating's materials, each on its own mesh."""
    import bpy

    grating = bpy.context.scene.natural_gratings.active()
    for number in range(_MANY):
        material = addon.material.new_diffraction_material(f"{number}", grating.group)
        mesh = bpy.data.meshes.new(f"Mesh {number}")
        mesh.materials.append(material)
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(f"Mesh {number}", mesh))


# Each function makes the plain scene large in one way.
SCENES: dict[str, Callable[[SimpleNamespace], None]] = {
    "plain": lambda addon: None,
    "1,000 world nodes": _many_world_nodes,
    "90,000 instances": _many_instances,
    "1,200 collections": _many_collections,
    "9,000 scans": _many_scans,
    "1,000 lamps": _many_lamps,
    "1,000 materials with a grating": _many_materials,
}

# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffraction appended or linked from another file, lit by the lamps of the receiving file.

Each picture is compared with that of a scene built with these lamps.
"""

from itertools import product

import bpy
import numpy as np
import pytest

from .conftest import clear
from .lamp_scenes import (
    AFTER,
    BEFORE,
    PIXELS,
    Lamp,
    add_camera,
    add_lamps,
    add_plane,
    agree,
    build,
    change,
    differs,
    keep_from,
    now,
    save,
    truth,
)
from .world_scenes import add_world


def library(stage, path, lamps=2, unlinked=False, lights="REST"):
    """Save a file whose plane is lit by other lamps, except the first if `unlinked`; returns its path."""
    others = {"A": Lamp("SUN", to=(0, 0.5, 1)), "B": Lamp("SUN", to=(0.5, 0, 1))}
    plane = build(stage, path, dict(list(others.items())[:lamps]), lights)
    collection = bpy.data.collections.new("Held")
    stage.scene.collection.children.link(collection)
    collection.objects.link(plane)
    stage.scene.collection.objects.unlink(plane)
    if unlinked:
        keep_from(bpy.data.objects["A"], plane)
        bpy.context.view_layer.update()
    return save(stage, "library")


def other_file(stage, lamps=AFTER):
    """Another file with lamps and a camera, and no data of the extension."""
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


LIGHTS = pytest.mark.parametrize("lights", ["REST", "ALL"])
LINK = pytest.mark.parametrize("link", [False, True], ids=["append", "link"])


@pytest.mark.short("Object-append-bring_by_operator-cycles", "Object-link-bring_by_operator-cycles")
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


@pytest.mark.short("REST")
@LIGHTS
def test_closures_brought_into_another_file(files, skin, lights):
    """It shows the same, with equal noise, as a scene built with the receiving file's lamps and world."""
    sky = (1.0, 1.5, 2.0)
    build(files, skin[0], AFTER, lights)
    add_world(files, sky)
    wanted = files.rgb("cycles", PIXELS)
    clear(files.addon, files.scene)
    path = library(files, skin[0], lights=lights)
    for kind, link in product(("Object", "Collection"), (False, True)):
        made = other_file(files)
        add_world(made, sky)
        bring_by_operator(path, kind, "Held" if kind == "Collection" else "Plane", link)
        agree(made.rgb("cycles", PIXELS), wanted)
    made.scene.world = None
    assert np.median(made.rgb("cycles", PIXELS)) < 0.8 * np.median(wanted)


def test_an_appended_material_learns_of_more_lamps(files, baked):
    wanted = truth(files, baked[0], AFTER, "cycles")
    path = library(files, baked[0], lamps=1)
    made = other_file(files)
    bring_by_operator(path, "Object", "Plane", link=False)
    agree(made.rgb("cycles", PIXELS), wanted)


@LINK
def test_the_light_linking_of_another_file_stays_there(files, baked, link):
    """The first lamp here lights the plane, even though light linking excluded it from the first lamp there."""
    wanted = truth(files, baked[0], AFTER, "cycles")
    path = library(files, baked[0], unlinked=True)
    made = other_file(files)
    made.addon.follow.follow_lamps(made.scene)
    bring_by_operator(path, "Object", "Plane", link)
    agree(made.rgb("cycles", PIXELS), wanted)


def test_a_linked_material_of_fewer_lamps_says_so(files, baked):
    """A linked group cannot grow: its file has one lamp, this scene two."""
    path = library(files, baked[0], lamps=1)
    other_file(files)
    bring_by_operator(path, "Object", "Plane", link=True)
    scene = bpy.context.scene
    told = files.addon.lighting.warnings_about(scene, bpy.context.evaluated_depsgraph_get())
    assert told == ["Diffraction blazed: linked with only 1 of 2 lamps; make it local"]


def test_a_linked_material_that_shows_left_out_lamps_says_so(files, skin):
    """A linked group cannot get the nodes that see nothing of them."""
    path = library(files, skin[0])
    other_file(files)
    bring_by_operator(path, "Object", "Plane", link=True)
    assert bpy.ops.grating.count_lamp(lamp="Point") == {"FINISHED"}
    told = files.addon.lighting.warnings_about(bpy.context.scene, bpy.context.evaluated_depsgraph_get())
    assert told == ["Diffraction blazed: linked, so it shows lamps that you leave out; make it local"]

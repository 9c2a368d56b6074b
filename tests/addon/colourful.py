# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene that shows diffraction colours, and what the tests of causes of missing colours do with it."""

import math

import bpy
import pytest


@pytest.fixture
def colourful(scene, watched):
    """The plane under a sun 60 degrees off the normal: it shows the first order of 0.87 x 500 = 433 nm, in pure
    colours."""
    bpy.data.objects["Sun"].rotation_euler = (0, math.radians(60), 0)
    kept, world = scene.view_settings.view_transform, scene.world and scene.world.name
    scene.view_settings.view_transform = "Standard"
    bpy.context.view_layer.update()
    yield watched
    scene = bpy.context.scene  # an undo frees the former one
    scene.view_settings.view_transform, scene.world = kept, world and bpy.data.worlds[world]
    scene.view_settings.exposure, scene.cycles.film_exposure = 0.0, 1.0
    for child in list(scene.collection.children):
        bpy.data.collections.remove(child)


def found(addon):
    """The causes in the open scene."""
    bpy.context.view_layer.update()
    return addon.finding_causes.findings(bpy.context).causes


def kinds(addon):
    return [cause.kind for cause in found(addon)]


def press(button):
    """Press a cause's button, as the popup does but without a window."""
    group, name = button.operator.split(".")
    return getattr(getattr(bpy.ops, group), name)(**button.properties)


def node_of(thing):
    return next(node for node in thing.material_slots[0].material.node_tree.nodes if node.label == "Diffraction")


def sun():
    return bpy.data.objects["Sun"]

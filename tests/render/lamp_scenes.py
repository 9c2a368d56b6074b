# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of a plane under two lamps, before and after changes, and the comparison of their pictures."""

import math
from dataclasses import dataclass, field

import bpy
import numpy as np

from .conftest import Stage, clear

PIXELS = 32
ENGINES = ["cycles", "eevee"]


@dataclass(frozen=True)
class Lamp:
    """A lamp's settings."""

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
    """Change the file's lamps of these names in place, as an artist would."""
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
    """Add a plane and select only it."""
    bpy.ops.mesh.primitive_plane_add(size=2)
    bpy.context.object.name = name
    return bpy.context.object


def add_grating(stage, path, name="blazed"):
    gratings = stage.scene.natural_gratings
    grating = gratings.items.add()
    grating.name, grating.bake_path = name, str(path)
    gratings.active_index = len(gratings.items) - 1
    return grating


def build(stage, path, lamps, lights="REST"):
    """Build plane, camera and lamps, and assign the grating with its button; returns the plane."""
    plane = add_plane()
    add_camera(stage)
    add_lamps(stage, lamps)
    add_grating(stage, path)
    assert bpy.ops.grating.lights(lights=lights) == {"FINISHED"}
    assert bpy.ops.grating.assign() == {"FINISHED"}
    return plane


_truths = {}


def truth(stage, path, lamps, engine):
    """The picture of a scene built with these lamps. The stage is empty afterwards."""
    key = (engine, repr(lamps))
    if key not in _truths:
        build(stage, path, lamps)
        _truths[key] = stage.rgb(engine, PIXELS)
        clear(stage.addon, stage.scene)
    return _truths[key]


def agree(picture, wanted):
    """Assert that two noise-free pictures by one renderer show the same scene. The order of a sum over lamps changes
    its float32 rounding; EEVEE truncates to half floats, in steps of 2^-10 of a value."""
    assert wanted.max() > 0.05
    differ = np.ptp(wanted.reshape(-1, 3), axis=0)
    assert differ.min() > 0.01, "a flat picture proves nothing"
    np.testing.assert_allclose(picture, wanted, rtol=2**-9, atol=1e-5 * wanted.max())


def differs(picture, other):
    assert np.abs(picture - other).mean() > 0.05 * other.mean()


def now(stage):
    """The stage for the scene that is open now."""
    return Stage(stage.addon, stage.folder, bpy.context.scene)


def save(stage, name="scene"):
    path = stage.folder / f"{name}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def keep_from(lamp, mesh, state="EXCLUDE"):
    """Link the lamp to receivers that hold one mesh."""
    receivers = bpy.data.collections.new("Receivers")
    receivers.objects.link(mesh)
    receivers.collection_objects[0].light_linking.link_state = state
    lamp.light_linking.receiver_collection = receivers


def lambertian(addon):
    """A Response: the radiance of a white diffuse surface."""
    response = addon.response
    group = bpy.data.node_groups.new("Lambertian", "ShaderNodeTree")
    asked = (response.NORMAL, response.TO_LIGHT, response.IRRADIANCE)
    addon.interface.add_interface(group, asked, response.ONE_RADIANCE)
    tree = addon.builder.Tree(group)
    n, wi, irradiance = tree.inputs().values()
    tree.output(irradiance * (tree.maximum(tree.dot(n, wi), 0.0) * (1 / math.pi)))
    return response.Response(group)

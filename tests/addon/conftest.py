# SPDX-License-Identifier: GPL-3.0-or-later
"""A clean scene with a plane and a sun, and the extension's modules."""

import math

import numpy as np
import pytest
from PIL import Image


@pytest.fixture(scope="session")
def first_engine(extension) -> str:
    """The render engine of a new file."""
    import bpy

    return bpy.context.scene.render.engine


@pytest.fixture(autouse=True)
def _verbs_have_no_window(request, monkeypatch):
    """Run the verbs without a window, as Blender does once a file is open."""
    import bpy

    if "addon" in request.fixturenames:
        commands = request.getfixturevalue("addon").commands
        execute = commands.execute

        def without_window(argv):
            with bpy.context.temp_override(window=None):
                return execute(argv)

        monkeypatch.setattr(commands, "execute", without_window)


@pytest.fixture
def scene(addon, first_engine):
    """The scene, emptied except for a plane (selected, with its UV map) and a sun."""
    import bpy

    from tests.clean_scene import put_back

    data = bpy.data
    for collection in (data.objects, data.meshes, data.lights, data.materials, data.node_groups, data.images):
        data.batch_remove(list(collection))
    scene = bpy.context.scene
    data.batch_remove([other for other in data.scenes if other != scene])
    scene.render.engine = first_engine
    scene.cycles.property_unset("samples")
    put_back(addon, scene)
    scene.eevee.taa_render_samples = 64  # cannot be unset
    scene.natural_gratings.items.clear()
    scene.natural_gratings.active_index = 0
    if scene.animation_data:
        scene.animation_data_clear()
    for key in [key for key, _ in scene.items() if key.startswith("ng_")]:
        del scene[key]
    bpy.ops.mesh.primitive_plane_add()
    lamp = data.lights.new("Sun", "SUN")
    lamp.energy = 1.0
    scene.collection.objects.link(data.objects.new("Sun", lamp))
    return scene


@pytest.fixture(scope="session")
def scan(tmp_path_factory):
    """A small 16-bit scan: 64 x 64 pixels, 4 um, a sinusoid with a period of 500 nm along x, 100 nm deep."""
    path = tmp_path_factory.mktemp("scan") / "waves.png"
    x = (np.arange(64) + 0.5) / 64
    row = 0.5 + 0.5 * np.sin(2 * np.pi * 8 * x)
    Image.fromarray(np.tile(np.rint(row * 65535).astype(np.uint16), (64, 1))).save(path)
    return path


@pytest.fixture(scope="session")
def baked(scan, tmp_path_factory):
    """The scan's bake, by the same child process as the operator's."""
    return _bake(scan, tmp_path_factory.mktemp("bake"))


@pytest.fixture(scope="session")
def mirror(scan, tmp_path_factory):
    """The scan's bake of a mirror."""
    return _bake(scan, tmp_path_factory.mktemp("mirror"), "--matter", "mirror")


def _bake(scan, folder, *more):
    import subprocess
    import sys

    from devtools import ROOT

    command = [sys.executable, "-m", "precompute", "bake", scan, "--size-um", "4", "--height-nm", "100", "-o", folder]
    subprocess.run([str(part) for part in (*command, *more)], cwd=ROOT, check=True, capture_output=True)
    return folder / "waves.exr"


@pytest.fixture
def grating(scene, baked):
    """A baked grating, the scene's active one."""
    made = scene.natural_gratings.items.add()
    made.name, made.bake_path = "waves", str(baked)
    scene.natural_gratings.active_index = 0
    return made


@pytest.fixture
def watched(scene, grating):
    """The plane, 2 m wide, with a grating lit only by lamps; a camera of 50 mm 10 m above its middle; a sun 40 degrees
    off the normal, on the side of +X."""
    import bpy

    bpy.ops.grating.lights(lights="LAMPS")
    assert bpy.ops.grating.assign() == {"FINISHED"}
    plane = bpy.context.object
    add_camera(scene, (0, 0, 10))
    bpy.data.objects["Sun"].rotation_euler = (0, math.radians(40), 0)
    bpy.data.objects["Sun"].data.angle = 0.0
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 160, 90, 100
    scene.frame_start, scene.frame_end, scene.frame_current = 1, 24, 1
    bpy.context.view_layer.update()
    yield plane
    bpy.context.scene.camera = None
    bpy.context.scene.frame_set(1)


def add_camera(scene, place):
    """Add a camera that looks down, as the scene's camera."""
    import bpy

    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = place
    scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def select(*things):
    """Select only these objects; the first is active."""
    import bpy

    bpy.ops.object.select_all(action="DESELECT")
    for thing in things:
        thing.select_set(True)
    bpy.context.view_layer.objects.active = things[0]


def reports(operator, capfd) -> str:
    """An operator's reports, including warnings: in background mode Blender prints its reports."""
    capfd.readouterr()
    assert operator() == {"FINISHED"}
    return capfd.readouterr().out

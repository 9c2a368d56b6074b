# SPDX-License-Identifier: GPL-3.0-or-later
"""The light rig's light: far more colour than from the panel's sun, and a grey card of the promised brightness."""

import math

import bpy
import numpy as np
import pytest

from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.measure.best_lamp_directions import colour_of
from precompute.reflectance.matter import parse
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare
from precompute.table import atlas

from .lamp_scenes import add_grating

PIXELS = 48
KINDS = ["SUN", "STUDIO", "WINDOW", "POINTS", "GRID"]


@pytest.fixture(scope="module")
def compact_disc(tmp_path_factory):
    """The file of a quick bake of the CD sample, a mirror under its plate."""
    asked = BakeRequest(coherence_length_m=8e-6, matter=parse("plate 1.585, mirror"))
    relief = prepare(read_height_map("sample:cd"), plate_ior=asked.matter.plate_ior)
    path = tmp_path_factory.mktemp("rig") / "cd.exr"
    atlas.write_together({path: atlas.pack(bake(relief, asked))}, {"request": asked.as_dict()})
    return path


@pytest.fixture
def cube(stage, compact_disc):
    """Blender's default cube and camera, with the grating."""
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    stage.camera((7.36, -6.93, 4.96), angle=np.radians(40))
    add_grating(stage, compact_disc, "cd")
    assert bpy.ops.grating.lights(lights="LAMPS") == {"FINISHED"}
    assert bpy.ops.grating.assign() == {"FINISHED"}
    return cube


def colour(stage, engine) -> float:
    """The mean colour of the picture's pixels."""
    channels = stage.render(engine, PIXELS, 16)
    rgb = np.stack([channels[c] for c in "RGB"], axis=-1)
    return float(np.maximum(colour_of(rgb), 0).mean())


@pytest.mark.night("tests/addon/workflow/test_adding_light_rigs.py")
@pytest.mark.parametrize("engine", ["cycles", "eevee"])
def test_it_shows_more_colour_than_the_panels_sun(stage, cube, engine):
    bpy.ops.grating.add_sun()
    before = colour(stage, engine)
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    # Each number of lamps is a shader of its own, and EEVEE's take seconds.
    for kind in (*KINDS, "ORDERS") if engine == "cycles" else KINDS[:1]:
        assert bpy.ops.grating.light_rig(kind=kind) == {"FINISHED"}
        after = colour(stage, engine)
        print(f"{engine} {kind}: {after:.4f}, the panel's sun {before:.4f}")
        # Measured: 250 times as much and more. Against black, a factor alone would prove nothing.
        assert after > max(50 * before, 0.01)


@pytest.mark.night("tests/addon/workflow/test_adding_light_rigs.py")
@pytest.mark.parametrize("kind", KINDS)
def test_grey_is_as_bright_as_promised(stage, cube, kind):
    """A diffuse 50 % grey card in the middle of what the camera sees, facing the key, without the cube."""
    assert bpy.ops.grating.light_rig(kind=kind) == {"FINISHED"}
    key, *others = bpy.data.collections["Light Rig"].objects
    for other in (*others, cube):
        other.hide_render = True
    bpy.context.view_layer.update()
    to = key.matrix_world.to_3x3().col[2].normalized()
    # As far from a lamp as the rig says: four radii of the cube's bounding box, sqrt(3).
    place = key.location - 4 * math.sqrt(3) * to
    bpy.ops.mesh.primitive_plane_add(size=0.02, location=place, rotation=key.rotation_euler)
    material, tree = stage.material("Card")
    shader = tree.node("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    tree.node("ShaderNodeOutputMaterial", tree.value(shader.outputs[0]))
    bpy.context.object.data.materials.append(material)
    stage.camera(place + 1.0 * to, place, ortho=0.01)
    # The lamp does not hide behind the camera. 64 samples of a soft box vary by less than 1 %.
    assert stage.rgb("cycles", 16, 64).mean() == pytest.approx(0.4, rel=0.02)

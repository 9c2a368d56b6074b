# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that the artist leaves out of the diffraction: what renders show of them, also in reopened files."""

import bpy
import numpy as np
import pytest

from .lamp_scenes import AFTER, PIXELS, agree, build, differs, now, save
from .world_scenes import add_ball, assign, look_at_ball

# A compact lamp, whose light the table shows; and wide and long ones, which also closures see.
LAMPS = {
    "soft sun": ("SUN", {"energy": 3.0, "angle": np.radians(6)}),
    "large area": ("AREA", {"energy": 300.0, "size": 3.0}),
    "long area": ("AREA", {"energy": 300.0, "shape": "RECTANGLE", "size": 0.2, "size_y": 3.0}),
}


def choose(lamp):
    assert bpy.ops.grating.count_lamp(lamp=lamp) == {"FINISHED"}


def test_with_lamps_only_it_gives_no_light(files, skin):
    """Over a black base. With one of two left out, the picture is that of a scene without it, also once reopened."""
    plane = build(files, skin[0], AFTER, "LAMPS")
    base = next(node for node in plane.active_material.node_tree.nodes if node.label == "Skin")
    base.inputs["Base Color"].default_value = (0, 0, 0, 1)
    both = files.rgb("cycles", PIXELS)
    choose("Point")
    left = files.rgb("cycles", PIXELS)
    differs(left, both)
    bpy.ops.wm.open_mainfile(filepath=str(save(files)))
    made = now(files)
    agree(made.rgb("cycles", PIXELS), left)
    bpy.data.objects.remove(bpy.data.objects["Point"])
    agree(made.rgb("cycles", PIXELS), left)


@pytest.mark.short("long area")
@pytest.mark.parametrize("name", LAMPS)
def test_with_lamps_and_world_only_its_mirror_image_is_left(stage, skin, name):
    """Colours that the lamp gives when it counts vanish: away from the mirror image all pixels are black. Cycles' few
    samples of the mirror image reach the pixels beside it."""
    counted, left, mirror = pictures(stage, skin, name, "cycles", samples=64)
    away = is_away_from(mirror.max(axis=-1) > 0)
    assert away.mean() > 0.5 and counted[away].mean() > 1e-3
    assert left[away].max() == 0


@pytest.mark.night("test_with_lamps_and_world_only_its_mirror_image_is_left")
def test_with_lamps_and_world_in_eevee(stage, skin):
    """EEVEE's mirror image has a halo, so the pictures are compared: with the random order cut to black, the picture of
    the left-out lamp hardly changes. The limit is a tenth of what the lamp gives when it counts. EEVEE 4.5 picks one
    closure a sample at random, so the mirror image alone changes by 3 % of that. A random order that sees the lamp
    changes it by more than a half."""
    counted, left, mirror = pictures(stage, skin, "soft sun", "eevee", samples=16)
    given = counted.mean() - mirror.mean()
    assert given > 1e-3 and abs(left.mean() - mirror.mean()) < 0.1 * given


def pictures(stage, skin, name, engine, *, samples):
    """A ball under a lamp that counts, under the same lamp left out, and the mirror image of this lamp alone."""
    kind, settings = LAMPS[name]
    add_ball()
    assign(stage, skin[0], "REST")
    look_at_ball(stage)
    stage.lamp(kind, (-3, -3, 1), to=(-1, -1, 0.3), **settings)
    counted = stage.rgb(engine, 48, samples)
    choose("Lamp")
    left = stage.rgb(engine, 48, samples)
    blacken_draws()
    return counted, left, stage.rgb(engine, 48, samples)


def blacken_draws():
    """Make the random order's colour in the file's material black."""
    (world,) = [each for each in bpy.data.node_groups if each.name.startswith("Diffraction World")]
    lobe = next(node for node in world.nodes if node.type == "GROUP_OUTPUT").inputs["Lobe"]
    least = world.nodes.new("ShaderNodeVectorMath")
    least.operation, least.inputs[1].default_value = "MINIMUM", (0.0, 0.0, 0.0)
    world.links.new(lobe.links[0].from_socket, least.inputs[0])
    world.links.new(least.outputs[0], lobe)


def is_away_from(lit):
    """Which pixels are not lit, nor is a neighbour of theirs."""
    near = [np.roll(lit, (y, x), (0, 1)) for y in (-1, 0, 1) for x in (-1, 0, 1)]
    return ~np.any(near, axis=0)


def test_with_all_by_samples_every_lamp_counts(stage, skin):
    add_ball()
    assign(stage, skin[0], "ALL")
    look_at_ball(stage)
    stage.lamp("SUN", to=(-1, -1, 0.3), energy=3.0, angle=np.radians(6))
    counted = stage.rgb("cycles", 32, 4)
    choose("Lamp")
    agree(stage.rgb("cycles", 32, 4), counted)

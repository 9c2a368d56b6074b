# SPDX-License-Identifier: GPL-3.0-or-later
"""The base under a relief: it has what the matter over it does not reflect, and a metal without a relief is a smooth
metal. Planes at many angles, with many settings, are one picture with a pixel for each. In a white world the picture of
a shining base and of smooth metals has no noise."""

import bpy
import numpy as np
import pytest

from precompute.colour.spaces import smooth_colour
from precompute.optics.brdf import fresnel_reflectance
from precompute.reflectance.matter import parse

from .test_variation import answering
from .world_scenes import add_world

ANGLES = np.radians((0, 45, 75, 85))
# Base Blend and Strength.
SETTINGS = ((0, 1), (0, 0.5), (0, 0), (0, 2), (0.1, 1), (0.5, 1), (0.5, 0.5), (1, 1))
# That of a Color Ramp (matter_nodes.py).
LIMIT = 0.01


@pytest.fixture
def planes(stage):
    """Planes in a white world, seen along -z: a row for each angle, a column for each of SETTINGS. They lean
    towards higher ones, so that none mirrors another."""
    add_world(stage)
    stage.camera((3.5, 3.5, 20), ortho=8).rotation_euler = (0, 0, 0)
    bpy.ops.mesh.primitive_plane_add(size=0.9)
    data = bpy.context.object.data
    bpy.data.objects.remove(bpy.context.object)
    for row, angle in enumerate(ANGLES):
        for column, (blend, strength) in enumerate(SETTINGS):
            plane = stage.add("Plane", data, (column, 7 - row, 2 * column), rotation=(0, angle, 0))
            plane["blend"], plane["strength"] = float(blend), float(strength)
    return data


def picture_of(stage, data, engine, matters, ior=1.56, **variation):
    """The pixels (angle, setting, 3) of the planes over a base that shines with a radiance of 1."""
    addon = stage.addon
    responses = []
    for matter in matters:
        responses.append(answering(addon, matter, lambda tree, _: tree.vector(0.0, 0.0, 0.0)))
        addon.matter_nodes.note_matter(responses[-1].group, parse(matter), "D65")
    group = addon.skin.group_around("base", responses[0], shadows=False, lights="LAMPS")
    addon.skin.set_variation(group, addon.grating.Variation(**variation), responses[1:])
    material, tree = stage.material("Base")
    data.materials.clear()
    data.materials.append(material)
    base = tree.emission(tree.vector(1.0, 1.0, 1.0), 1.0)
    blend, strength = (tree.dot(tree.attribute(name, "OBJECT")[0], (1.0, 0.0, 0.0)) for name in ("blend", "strength"))
    given = {"Base": base, "Base Blend": blend, "Strength": strength, "IOR": ior}
    tree.node("ShaderNodeOutputMaterial", tree.group(group, given)["Shader"])
    return stage.rgb(engine, 24)[1:12:3, 1::3]


def wanted(matter, ior):
    """What the pixels (angle, setting, 3) should be, by the formula of skin_nodes.py."""
    matter, cosines = parse(matter), np.cos(ANGLES)
    blend, strength = (np.array(each)[:, None] for each in zip(*SETTINGS, strict=True))
    covered = (1 - blend) * np.minimum(strength, 1)
    colour = smooth_colour(matter, cosines)[:, None] if matter.baked else None
    if matter.opaque:
        return blend + (1 - blend - covered) * colour[..., :3]
    reflectance = fresnel_reflectance(cosines, ior)[:, None, None] if colour is None else colour[..., 3:]
    return np.broadcast_to(1 - covered * reflectance, (len(ANGLES), len(SETTINGS), 3))


MATTERS = (
    *(("dielectric", ior) for ior in (1.1, 1.56, 3.0)),
    ("6x(1.68/80nm, 1.56/90nm), 1.56", 1.56),
    ("ZnS 2.37/60nm, 1.5", 1.56),
    ("plate 1.5, ZnS 2.37/60nm, 1.5", 1.56),
    ("gold", 1.56),
    ("plate 1.585, aluminium", 1.56),
)


@pytest.mark.short("cycles-dielectric-3.0", "cycles-plate 1.585", "cycles-ZnS", "eevee-gold")
@pytest.mark.parametrize(("matter", "ior"), MATTERS)
@pytest.mark.parametrize("engine", ["cycles", "eevee"])
def test_the_base_has_what_is_not_reflected(stage, planes, engine, matter, ior):
    shown = picture_of(stage, planes, engine, [matter], ior)
    np.testing.assert_allclose(shown, wanted(matter, ior), atol=LIMIT)


def test_the_base_under_several_matters(stage, planes):
    """Each matter hides its share of the base."""
    attribute = planes.attributes.new("ramp", "FLOAT", "POINT")
    attribute.data.foreach_set("value", [0.5] * len(planes.vertices))
    # With a softness of 1, a place in the middle between two bounds has 0.25, 0.5 and 0.25 of the three.
    matters, choice = ("gold", "dielectric", "ZnS 2.37/60nm, 1.5"), {"shares": (0.5, 0.25), "softness": 0.5}
    shown = picture_of(stage, planes, "cycles", matters, pattern="ATTRIBUTE", attribute="ramp", **choice)
    t = 0.5 - 0.25 / 0.5  # of the smooth step of each bound
    beyond = (1 - t) ** 2 * (1 + 2 * t), t**2 * (3 - 2 * t)
    shares = 1 - beyond[0], beyond[0] - beyond[1], beyond[1]
    expected = sum(share * wanted(matter, 1.56) for share, matter in zip(shares, matters, strict=True))
    np.testing.assert_allclose(shown, expected, atol=LIMIT)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Artists' substitutes for a measured surface, compared with the same integrals as the measured one.

| name        | what it is |
|-------------|------------|
| three lobes | glossy closures in red, green and blue, as made by hand in Redshift. Each normal is tilted along T by
                half of lambda / d, so that the closure mirrors its colour's first order. The closures are anisotropic,
                as the orders of a line grating lie in one plane |
| rainbow     | of GPU Gems, chapter 8 (Stam 2004): orders of u d, each a rainbow of three bumps, and a highlight. It
                needs lamps, so sun lamps stand in for the world's fitted sources |
| thin film   | Blender's Principled coat of keratin under a film |

A fake has no absolute brightness, so each picture is scaled to the integrals' light before colours are compared;
`light` is the picture's own light relative to the integrals'. The period d is the relief's. `us` is the processor time
of a sample of a pixel in microseconds, where the sphere fills the picture.
"""

import argparse
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from precompute.methods.gem import ORDERS
from precompute.optics.brdf import KERATIN_IOR
from precompute.surface.quality import grating_period
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare
from precompute.table import atlas
from precompute.world_sources.sources import Source

from . import lights_scenes as scenes
from . import report
from .hemisphere import Surface
from .lights_truth import PIXELS, compared, integrals, two_halves
from .lights_worlds import SURFACES, Worlds

FAKES = ("ours", "three lobes", "rainbow", "thin film")
_SUBJECTS = ("snake", "sphere")
_LOBES_NM = {(1, 0, 0): 610, (0, 1, 0): 545, (0, 0, 1): 465}
_ROUGHNESS, _ANISOTROPY = 0.25, 0.7
_FILM_NM, _FILM_IOR = 400, 1.33
_SHARPNESS, _HIGHLIGHT = 4.0, 20.0  # sharpness of the rainbow's bumps and of its highlight
_TIMED_SAMPLES = 64
# A custom property that marks sun lamps standing in for sources of the world, and their largest number.
_STANDS_IN, _SOURCES = "ng_stands_in", 4


def fakes(studio: Worlds, arguments: argparse.Namespace) -> list[dict]:
    """A row for each subject, world and fake."""
    name, bake = next(studio.bakes(SURFACES[:1]))
    period_m = grating_period(prepare(read_height_map(name)), None)
    rows = []
    report.say(f"{'subject':8}{'world':14}{'material':13}{'dE50':>7}{'dE95':>7}{'light':>8}{'us':>8}", arguments.json)
    for subject in arguments.subject or _SUBJECTS:
        scenes.build(studio, subject)
        points = scenes.free_points(studio, PIXELS[subject], arguments.points)
        for world in arguments.world or scenes.WORLDS:
            light = scenes.light_by(studio, world)
            wanted = integrals(Surface.of(atlas.read(bake)[0]), points, {world: light})[world].sum(axis=0)
            for fake in FAKES:
                wear(studio, fake, bake=bake, period_m=period_m)
                picture = two_halves(studio, PIXELS[subject], arguments.samples)[:, *points.pixels]
                row = {"subject": subject, "world": world, "material": fake} | fitted(picture, wanted)
                row["us"] = _microseconds(studio) if subject == "sphere" else None
                rows.append(row)
                cost = "" if row["us"] is None else f"{row['us']:8.2f}"
                report.say(
                    f"{subject:8}{world:14}{fake:13}{row['de_median']:7.2f}{row['de_p95']:7.2f}{row['light']:8.3f}{cost}",
                    arguments.json,
                )
    return rows


def fitted(pictures: np.ndarray, expected: np.ndarray) -> dict:
    """The figures of `compared` for two renders (2, n, 3) scaled to the light of the integrals (n, 3); `light` is that
    of the unscaled renders. A black picture stays black."""
    light = compared(pictures, expected)["light"]
    return compared(pictures / light if light > 0 else pictures, expected) | {"light": light}


def wear(studio: Worlds, fake: str, *, bake: Path, period_m: float) -> None:
    """Give the mesh one of FAKES, and the scene the lamps that it needs."""
    import bpy

    suns = [lamp for lamp in bpy.data.objects if lamp.get(_STANDS_IN)]
    bpy.data.batch_remove(suns)
    if fake == "ours":
        material, skin = studio.material(bake, "REST")
        skin.inputs["Base Color"].default_value = (0, 0, 0, 1)
    elif fake == "three lobes":
        material = three_lobes(studio, period_m)
    elif fake == "rainbow":
        material = rainbow(studio, period_m)
        for source in studio.addon.world_probe.fit_of(studio.scene.world, studio.scene, _SOURCES).sources:
            _stand_in(studio, source)
    else:
        material = thin_film(studio)
    studio.mesh.material_slots[0].material = material
    studio.addon.fitting_worlds.fit_world(studio.scene)
    studio.addon.lighting.update_lamps(studio.scene)


def three_lobes(studio: Worlds, period_m: float):
    """A material of three tilted glossy closures."""
    material, tree = _empty(studio, "Three Lobes")
    tree.node("ShaderNodeOutputMaterial", lobes(tree, period_m))
    return material


def lobes(tree: Any, period_m: float, gain: Any = 1.0) -> Any:
    """Add three tilted glossy closures to a tree, multiplied by a gain."""
    n = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Normal"])
    t = tree.value(tree.node("ShaderNodeTangent", direction_type="UV_MAP").outputs[0])
    reflectance = tree.fresnel(KERATIN_IOR, n) * gain
    shader = None
    for colour, nanometres in _LOBES_NM.items():
        normal = tree.normalize(t.times_plus((nanometres * 1e-9 / period_m / 2,) * 3, n))
        node = tree.node("ShaderNodeBsdfAnisotropic", reflectance * tuple(map(float, colour)), _ROUGHNESS, _ANISOTROPY)
        tree.feed(node.inputs["Normal"], normal)
        tree.feed(node.inputs["Tangent"], t)
        shader = tree.add_shader(shader, tree.value(node.outputs[0]))
    return shader


def rainbow(studio: Worlds, period_m: float):
    """A material of GPU Gems' rainbow, under the scene's lamps."""
    addon, response = studio.addon, rainbow_response(studio.addon, period_m)
    skin = addon.skin.group_around("Rainbow", response, shadows=False, lights="LAMPS")
    made = addon.material.new_diffraction_material("Rainbow", skin)
    base = next(node for node in made.node_tree.nodes if node.label == "Skin")
    base.inputs["Base Color"].default_value = (0, 0, 0, 1)
    return made


def rainbow_response(addon: SimpleNamespace, period_m: float) -> Any:
    """A surface's response to one lamp by GPU Gems' rainbow."""
    import bpy

    socket = addon.response
    group = bpy.data.node_groups.new("Rainbow", "ShaderNodeTree")
    asked = socket.NORMAL, socket.TANGENT, socket.TO_LIGHT, socket.IRRADIANCE
    addon.interface.add_interface(group, asked, socket.ONE_RADIANCE)
    tree = addon.builder.Tree(group)
    n, t, wi, irradiance = tree.inputs().values()
    half = wi + tree.value(tree.node("ShaderNodeNewGeometry").outputs["Incoming"])
    u, w = tree.dot(half, t), tree.maximum(tree.dot(half, n), 1e-6)
    path_um = tree.math("ABSOLUTE", u) * (period_m * 1e6)
    off = tree.math("DIVIDE", u, w) * _HIGHLIGHT
    shown = tree.math("EXPONENT", off * off * -1.0)
    for order in range(1, ORDERS + 1):
        y = path_um.times_plus(2 / order, -1.0)
        x = (y - (0.75, 0.5, 0.25)) * _SHARPNESS
        shown = tree.vector_math("MAXIMUM", 1.0 - x * x, (0.0, 0.0, 0.0)) + shown
    tree.output(irradiance * shown)
    return socket.Response(group)


def thin_film(studio: Worlds):
    """A material of Blender's Principled coat under a thin film, over black."""
    material, tree = _empty(studio, "Thin Film")
    node = tree.node("ShaderNodeBsdfPrincipled")
    inputs = {"Base Color": (0.0, 0.0, 0.0, 1.0), "Roughness": _ROUGHNESS, "IOR": KERATIN_IOR}
    for name, value in (inputs | {"Thin Film Thickness": float(_FILM_NM), "Thin Film IOR": _FILM_IOR}).items():
        tree.feed(node.inputs[name], value)
    tree.node("ShaderNodeOutputMaterial", tree.value(node.outputs[0]))
    return material


def _stand_in(studio: Worlds, source: Source) -> None:
    """Add a sun lamp with the irradiance and width of a source."""
    import bpy
    from mathutils import Vector

    data = bpy.data.lights.new("Source", "SUN")
    data.energy = source.irradiance.max()
    data.color = source.irradiance / source.irradiance.max()
    data.angle = min(4 * source.variance**0.5, np.pi)  # a disc of radius r has the variance r^2 / 4
    lamp = bpy.data.objects.new("Source", data)
    lamp[_STANDS_IN] = True
    lamp.rotation_euler = Vector(source.direction).to_track_quat("Z", "Y").to_euler()
    studio.scene.collection.objects.link(lamp)


def _microseconds(studio: Worlds) -> float:
    """Processor time of a sample of a pixel in microseconds, in a picture filled by the sphere."""
    faces, camera = studio.mesh.data.polygons, studio.scene.camera.data
    chosen = np.empty(len(faces), np.int32)
    faces.foreach_get("material_index", chosen)
    angle, camera.angle = camera.angle, camera.angle / 4
    faces.foreach_set("material_index", np.zeros_like(chosen))
    start, end = (studio.render("cycles", samples)[0] for samples in (1, _TIMED_SAMPLES + 1))
    faces.foreach_set("material_index", chosen)
    camera.angle = angle
    return 1e6 * (end - start) / (_TIMED_SAMPLES * studio.pixels**2)


def _empty(studio: Worlds, name: str):
    """A material without nodes, and the builder of its tree."""
    import bpy

    material = bpy.data.materials.new(name)
    studio.addon.compat.enable_nodes(material)
    material.node_tree.nodes.clear()
    return material, studio.addon.builder.Tree(material.node_tree)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The sets on which the animal is shown: soil with a piece of cork bark, and the grey plate of a look development,
with a chrome ball and a strip of colours."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, log2, pi, radians, sin
from operator import mul

import bpy
import numpy as np

from .noise import cracks, fractal_noise, value_noise
from .soil import add_soil
from .stage import add_plane, add_surface, paint, plain_material

_BARK_COLOURS = (
    (0.018, 0.008, 0.0045), (0.24, 0.14, 0.066), (0.34, 0.22, 0.115), (0.25, 0.2, 0.14), (0.2, 0.1, 0.042),
    (0.13, 0.065, 0.03), (0.036, 0.0175, 0.0125),
)  # fmt: skip
_CRACK, _PALE, _CREST, _GREY, _STAIN, _INSIDE, _HOLLOW = (np.array(colour) for colour in _BARK_COLOURS)
_ALONG, _AROUND = 360, 240


@dataclass(frozen=True)
class Placed:
    """A place on the floor in metres, a turn seen from above, a roll about the bark's own axis, and a depth to which it
    is sunk."""

    x: float
    y: float
    turn_deg: float
    roll_deg: float = 0.0
    sunk_m: float = 0.0


# At the front right of the hero picture, as on the photograph of a living animal: it hides the edge of one loop.
HERO = Placed(0.062, -0.104, 15.0, roll_deg=-4.0, sunk_m=0.008)


def add_bark(
    scene: bpy.types.Scene, placed: Placed = HERO, *, length_m: float = 0.25, radius_m: float = 0.05, seed: int = 4
) -> bpy.types.Object:
    """Add a piece of bark, with its hollow side down."""
    s, a = np.meshgrid(np.linspace(-1, 1, _ALONG), np.linspace(-1, 1, _AROUND), indexing="ij")
    # Places on the bark unrolled, in metres, and bent so that ridges wander.
    flat = np.stack([s * length_m / 2, a * radius_m * np.pi / 2], axis=-1)
    sway = [fractal_noise(flat / (0.06, 0.035), 4, seed + k) for k in range(2)]
    bent = flat + (0.02, 0.014) * np.stack(sway, axis=-1)
    relief, depth = _bark_relief(bent, flat, seed)
    angle = a * (np.pi / 2) * (0.92 + 0.12 * fractal_noise(flat / (0.03, 1.0), 3, seed + 2))
    along = flat[..., 0] * (1 + 0.1 * s**4 * fractal_noise(flat / (1.0, 0.016), 3, seed + 3))
    bulge = 1 + 0.16 * fractal_noise(flat / 0.09, 2, seed + 4)
    thick = 0.008 + 0.002 * value_noise(flat / 0.02, seed + 5)
    skins = [_rolled(along, angle, radius_m * bulge + height) for height in (relief, relief * 0.3 - thick)]
    points = np.concatenate([skin.reshape(-1, 3) for skin in skins])
    points[:, 2] -= radius_m * 0.2 + placed.sunk_m
    bark = add_surface(scene, "Cork Bark", points, faces=_shell(_ALONG, _AROUND), material=_bark_material())
    bark.data.shade_smooth()
    colours = np.concatenate([_bark_colours(depth, flat, seed), np.broadcast_to(_INSIDE, (depth.size, 3))])
    paint(bark.data, "bark", colours, domain="POINT")
    bark.location = (placed.x, placed.y, 0.0)
    bark.rotation_euler = (radians(placed.roll_deg), 0.0, radians(placed.turn_deg))
    return bark


def _bark_relief(bent: np.ndarray, flat: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """The height of the bark's ridges over its tube, in metres, and how deep a place lies, from 0 to 1."""
    deep, shallow, fine = (
        cracks(bent / (1e-3 * np.array(size)), width, seed + k)
        for k, (size, width) in enumerate((((70, 17), 0.16), ((40, 8), 0.25), ((12, 3.5), 0.4)), start=2)
    )
    lumps = fractal_noise(bent / (0.045, 0.014), 3, seed + 9)
    rough = fractal_noise(flat / (0.008, 0.003), 4, seed + 11)
    relief = 0.005 * lumps - 0.007 * deep - 0.0035 * shallow - 0.0009 * fine + 0.003 * rough
    depth = np.clip(0.34 + 0.9 * deep + 0.7 * shallow + 0.25 * fine - 0.35 * lumps - 0.7 * rough, 0, 1)
    return relief, depth


def _rolled(along: np.ndarray, angle: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Points (..., 3) on a tube about the x axis; angle 0 is its top."""
    return np.stack([along, radius * np.sin(angle), radius * np.cos(angle)], axis=-1)


def _shell(rows: int, columns: int) -> np.ndarray:
    """Quads of two grids of points, outer and inner, and of the rim that joins them."""
    index = np.arange(2 * rows * columns).reshape(2, rows, columns)
    outer, inner = (
        np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4) for grid in index
    )
    edge = [
        np.concatenate([grid[0, :-1], grid[:-1, -1], grid[-1, :0:-1], grid[:0:-1, 0], grid[:1, 0]]) for grid in index
    ]
    rim = np.stack([edge[0][:-1], edge[0][1:], edge[1][1:], edge[1][:-1]], axis=-1)
    return np.concatenate([outer, inner[:, ::-1], rim])


def _bark_colours(depth: np.ndarray, flat: np.ndarray, seed: int) -> np.ndarray:
    """Colours (n, 3): dark cracks, pale crests, grey and brown patches, soil in hollows."""
    shade = np.clip(depth + 0.12 * fractal_noise(flat / 0.008, 3, seed + 12), 0, 1)[..., None]
    colour = np.where(
        shade < 0.45, _CREST + (_PALE - _CREST) * shade / 0.45, _PALE + (_CRACK - _PALE) * (shade - 0.45) / 0.55
    )
    for tint, seed_of_patch, least in ((_GREY, 13, 0.2), (_STAIN, 16, 0.15)):
        patch = np.clip(3 * (fractal_noise(flat / (0.05, 0.02), 4, seed + seed_of_patch) - least), 0, 0.8)[..., None]
        colour = colour + (tint * (1.2 - shade) - colour) * patch
    # Soil lies in the hollows.
    soiled = (
        np.clip(4 * (shade - 0.62), 0, 0.9) * np.clip(0.6 + 2 * value_noise(flat / 0.03, seed + 19), 0, 1)[..., None]
    )
    return (colour + (_HOLLOW - colour) * soiled).reshape(-1, 3)


def _bark_material() -> bpy.types.Material:
    """The colours of the mesh, with a fine grain as bumps."""
    material = plain_material("Cork Bark", tuple(_PALE), 0.9, specular=0.15)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = nodes["Principled BSDF"]
    colour, grain, where, bump = (
        nodes.new(f"ShaderNode{kind}") for kind in ("VertexColor", "TexNoise", "TexCoord", "Bump")
    )
    colour.layer_name = "bark"
    links.new(colour.outputs["Color"], shader.inputs["Base Color"])
    links.new(where.outputs["Object"], grain.inputs["Vector"])
    grain.inputs["Scale"].default_value, grain.inputs["Detail"].default_value = 300.0, 8.0
    bump.inputs["Distance"].default_value, bump.inputs["Strength"].default_value = 0.003, 1.0
    links.new(grain.outputs[0], bump.inputs["Height"])
    links.new(bump.outputs["Normal"], shader.inputs["Normal"])
    return material


TINT = (0.93, 0.975, 0.955)


def thin_glass() -> bpy.types.Material:
    """A pane as one surface: what it does not reflect passes straight on. Refraction would turn the light behind it
    into caustics, which Cycles finds only by chance."""
    material = plain_material("Thin Glass", (1.0, 1.0, 1.0), 0.0)
    material.surface_render_method = "BLENDED"
    nodes, links = material.node_tree.nodes, material.node_tree.links
    fresnel, both, passed, mirror, mixed = (
        nodes.new(f"ShaderNode{kind}") for kind in ("Fresnel", "Math", "BsdfTransparent", "BsdfGlossy", "MixShader")
    )
    fresnel.inputs["IOR"].default_value = 1.5
    # Both faces of the pane reflect.
    both.operation, both.inputs[1].default_value, both.use_clamp = "MULTIPLY", 1.9, True
    passed.inputs["Color"].default_value = (*TINT, 1.0)
    mirror.inputs["Roughness"].default_value = 0.0
    links.new(fresnel.outputs[0], both.inputs[0])
    for socket, output in zip(mixed.inputs, (both.outputs[0], passed.outputs[0], mirror.outputs[0]), strict=True):
        links.new(output, socket)
    links.new(mixed.outputs[0], nodes["Material Output"].inputs["Surface"])
    nodes.remove(nodes["Principled BSDF"])
    return material


# Reflects as much as the grey card by which photographers expose.
GREY = 0.18
_PLATE_M, _THICK_M, _BEVEL_M = 0.21, 0.008, 0.0015
_BALL_M, _BALLS_FROM_MIDDLE_M = 0.0135, 0.178
_PATCH_M, _PATCH_GAP_M = 0.0115, 0.0015
# Linear colours: greys, then strong hues, then those of snakes and soil. They are ours and of no maker's chart.
_PATCHES = (
    ((0.9,) * 3, (0.59,) * 3, (0.36,) * 3, (GREY,) * 3, (0.09,) * 3, (0.03,) * 3),
    ((0.4, 0.03, 0.03), (0.6, 0.35, 0.02), (0.1, 0.3, 0.05), (0.03, 0.3, 0.3), (0.04, 0.06, 0.4), (0.35, 0.06, 0.3)),
    ((0.06, 0.02, 0.01), (0.14, 0.07, 0.03), (0.36, 0.2, 0.1), (0.5, 0.2, 0.06), (0.1, 0.16, 0.25), (0.2, 0.15, 0.3)),
)  # fmt: skip


def add_plate(scene: bpy.types.Scene) -> None:
    """The plate, whose top is at z = 0, what stands on it, and a floor. There is no wall: lamps stand behind."""
    floor = plain_material("Backdrop", (0.6 * GREY,) * 3, 1.0, specular=0.0)
    add_plane(scene, "Backdrop", 6.0, floor, z=-_THICK_M)
    profile = [
        (0.0, 0.0), (_PLATE_M - _BEVEL_M, 0.0), (_PLATE_M - 0.3 * _BEVEL_M, -0.3 * _BEVEL_M), (_PLATE_M, -_BEVEL_M),
        (_PLATE_M, -_THICK_M),
    ]  # fmt: skip
    add_turned(scene, "Plate", np.array(profile), plain_material("Plate", (GREY,) * 3, 1.0, specular=0.0))
    chrome = plain_material("Chrome", (0.75, 0.75, 0.76), 0.02)
    chrome.node_tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 1.0
    for name, azimuth_deg, material in (
        ("Grey Ball", -33.0, plain_material("Grey Ball", (GREY,) * 3, 1.0, specular=0.0)),
        ("Chrome Ball", -14.0, chrome),
    ):
        turn = np.linspace(np.pi / 2, -np.pi / 2, 33)
        ball = add_turned(scene, name, _BALL_M * np.stack([np.cos(turn), 1 + np.sin(turn)], axis=1), material)
        azimuth = radians(azimuth_deg)
        ball.location = (_BALLS_FROM_MIDDLE_M * cos(azimuth), _BALLS_FROM_MIDDLE_M * sin(azimuth), 0.0)
    _add_colours(scene, (-0.04, -0.165))


def stops_for_grey(scene: bpy.types.Scene, dusk: float) -> float:
    """The exposure, in stops, at which the plate's mean of red, green and blue in the picture is its grey, under the
    scene's suns and a dusk of this irradiance in W/m2."""
    suns = [thing for thing in scene.objects if thing.type == "LIGHT" and thing.data.type == "SUN"]
    # A sun shines along its -Z, so the height of its +Z is the sine of its elevation.
    heights = (max(0.0, sun.rotation_euler.to_matrix()[2][2]) for sun in suns)
    strengths = (sun.data.energy * sum(sun.data.color) / 3 for sun in suns)
    irradiance = dusk + sum(map(mul, strengths, heights))
    return log2(pi / irradiance) if irradiance > 0 else 0.0


def add_turned(
    scene: bpy.types.Scene, name: str, profile: np.ndarray, material: bpy.types.Material, around: int = 128
) -> bpy.types.Object:
    """A smooth body of revolution from a profile (n, 2) of radius and height, from the top down."""
    turn = 2 * np.pi * np.arange(around) / around
    radius, height = profile.T[:, :, None]
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), height + 0 * turn], axis=-1)
    index = np.arange(len(profile) * around).reshape(len(profile), around)
    turned = np.roll(index, -1, axis=1)
    quads = np.stack([index[:-1], index[1:], turned[1:], turned[:-1]], axis=-1)
    body = add_surface(scene, name, points.reshape(-1, 3), faces=quads.reshape(-1, 4), material=material)
    body.data.shade_smooth()
    return body


def _add_colours(scene: bpy.types.Scene, place: tuple[float, float]) -> None:
    """The strip of colours: a face each, on a black card."""
    rows, columns = len(_PATCHES), len(_PATCHES[0])
    step = _PATCH_M + _PATCH_GAP_M
    row, column = np.indices((rows, columns)).reshape(2, -1)
    corner = np.stack([column - columns / 2, rows / 2 - row - 1], axis=1) * step + place
    square = _PATCH_M * np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) + _PATCH_GAP_M / 2
    patches = np.dstack([corner[:, None] + square, np.full((len(corner), 4), 0.0012)]).reshape(-1, 3)
    half = np.array([columns, rows]) * step / 2 + _PATCH_GAP_M
    card = [(*(half * sign + place), 0.001) for sign in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    points = np.concatenate([card, patches])
    strip = add_surface(
        scene, "Colours", points, faces=np.arange(len(points)).reshape(-1, 4), material=_patch_material()
    )  # fmt: skip
    colours = np.concatenate([[(0.015,) * 3], np.array(_PATCHES).reshape(-1, 3)])
    paint(strip.data, "patch", colours.repeat(4, axis=0), domain="CORNER")


def _patch_material() -> bpy.types.Material:
    material = plain_material("Colours", (GREY,) * 3, 1.0, specular=0.0)
    nodes = material.node_tree.nodes
    colour = nodes.new("ShaderNodeVertexColor")
    colour.layer_name = "patch"
    material.node_tree.links.new(colour.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    return material


SETS = ("soil", "turntable")


def add_set(scene: bpy.types.Scene, name: str, snake: bpy.types.Object) -> None:
    """Add the set of this name, one of SETS, around a snake that lies on the floor z = 0."""
    if name == "turntable":
        add_plate(scene)
    else:
        add_soil(scene, [snake, add_bark(scene)])


def stops(scene: bpy.types.Scene, name: str, dusk: float) -> float:
    """How many stops more the camera should expose for this set than for soil, once the lamps are there, under a dusk
    of this irradiance in W/m2."""
    return stops_for_grey(scene, dusk) if name == "turntable" else 0.0

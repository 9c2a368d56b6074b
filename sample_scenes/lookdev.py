# SPDX-License-Identifier: GPL-3.0-or-later
"""A neutral set for look development: a round grey plate, a grey ball, a chrome ball and a strip of colours."""

from __future__ import annotations

from math import cos, log2, pi, radians, sin

import bpy
import numpy as np

from .snake import plain_material
from .stage import add_plane, add_surface, paint

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
    _add_turned(scene, "Plate", np.array(profile), plain_material("Plate", (GREY,) * 3, 1.0, specular=0.0))
    chrome = plain_material("Chrome", (0.75, 0.75, 0.76), 0.02)
    chrome.node_tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 1.0
    for name, azimuth_deg, material in (
        ("Grey Ball", -33.0, plain_material("Grey Ball", (GREY,) * 3, 1.0, specular=0.0)),
        ("Chrome Ball", -14.0, chrome),
    ):
        turn = np.linspace(np.pi / 2, -np.pi / 2, 33)
        ball = _add_turned(scene, name, _BALL_M * np.stack([np.cos(turn), 1 + np.sin(turn)], axis=1), material)
        azimuth = radians(azimuth_deg)
        ball.location = (_BALLS_FROM_MIDDLE_M * cos(azimuth), _BALLS_FROM_MIDDLE_M * sin(azimuth), 0.0)
    _add_colours(scene, (-0.04, -0.165))


def stops_for_grey(scene: bpy.types.Scene) -> float:
    """The exposure, in stops, at which the plate is as bright in the picture as it is grey, under the scene's suns."""
    suns = [thing for thing in scene.objects if thing.type == "LIGHT" and thing.data.type == "SUN"]
    # A sun shines along its -Z, so the height of its +Z is the sine of its elevation.
    irradiance = sum(sun.data.energy * max(0.0, sun.rotation_euler.to_matrix()[2][2]) for sun in suns)
    return log2(pi / irradiance) if irradiance > 0 else 0.0


def _add_turned(
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

# SPDX-License-Identifier: GPL-3.0-or-later
"""A coiled snake with modelled scales, whose UV map gives the grating's direction.

U runs along the body from head to tail, in units of the largest girth. V runs once round the body, from the belly seam
over the back. So the UV tangent points tailwards, and (T, B, N) is right-handed. Lengths are in metres."""

from __future__ import annotations

from typing import NamedTuple

import bpy
import numpy as np

RADIUS_M = 0.026
HEAD_LENGTH_M = 0.062
BODY_FLATNESS = 0.8
BELLY_FLATNESS = 0.8
DORSAL_ROWS = 13
BELLY_ANGLE = 0.74 * np.pi
SCALE_LENGTH_PER_RADIUS = 0.66
EYE_RADIUS_M = 0.0034

# The resting pose from snout to tail: B-spline control points; x, y, height of the belly over the floor.
POSE_M = np.array(
    [
        (-0.205, -0.150, 0.000),
        (-0.232, -0.122, 0.000),
        (-0.246, -0.085, 0.000),
        (-0.243, -0.045, 0.006),
        (-0.220, -0.010, 0.036),
        (-0.180, 0.014, 0.056),
        (-0.130, 0.026, 0.046),
        (-0.075, 0.034, 0.012),
        (-0.025, 0.036, 0.000),
        (0.030, 0.036, 0.000),
        (0.080, 0.035, 0.000),
        (0.118, 0.012, 0.000),
        (0.118, -0.036, 0.000),
        (0.078, -0.062, 0.000),
        (0.015, -0.066, 0.000),
        (-0.060, -0.066, 0.000),
        (-0.130, -0.058, 0.000),
        (-0.172, -0.018, 0.000),
        (-0.170, 0.045, 0.000),
        (-0.120, 0.090, 0.000),
        (-0.040, 0.100, 0.000),
        (0.040, 0.103, 0.000),
        (0.120, 0.092, 0.000),
        (0.175, 0.050, 0.000),
        (0.184, -0.020, 0.000),
        (0.145, -0.085, 0.000),
        (0.080, -0.118, 0.000),
        (0.010, -0.125, 0.000),
        (-0.060, -0.128, 0.000),
        (-0.115, -0.118, 0.000),
    ]
)


class Spine(NamedTuple):
    """The body's axis and size at n arc lengths `s` from the snout. `scale_count` is the number of scales up to
    there."""

    s: np.ndarray
    centre: np.ndarray
    tangent: np.ndarray
    half_width: np.ndarray
    half_height: np.ndarray
    scale_count: np.ndarray


def bspline(points: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Uniform cubic B-spline from the first to the last of `points` (n, d), at t (m,) in [0, 1]."""
    padded = np.vstack([2 * points[0] - points[1], points, 2 * points[-1] - points[-2]])
    x = t * (len(points) - 1)
    span = np.minimum(x.astype(int), len(points) - 2)
    x = (x - span)[:, None]
    weights = ((1 - x) ** 3, 3 * x**3 - 6 * x**2 + 4, -3 * x**3 + 3 * x**2 + 3 * x + 1, x**3)
    return sum(w * padded[span + k] for k, w in enumerate(weights)) / 6


def smoothstep(x: np.ndarray) -> np.ndarray:
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


def rounded(x: np.ndarray) -> np.ndarray:
    """A quarter ellipse from 0 at x = 0 to 1 at x >= 1."""
    return np.sqrt(1 - (1 - np.clip(x, 0, 1)) ** 2)


def half_sizes(s: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Half width and half height (m) of a body of `length` at arc lengths s from the snout."""
    neck = 0.62 + 0.38 * smoothstep((s - HEAD_LENGTH_M) / (0.3 * length))
    tail = 1 - 0.92 * (1 - np.clip((length - s) / (0.55 * length), 0, 1)) ** 2.2
    tip = rounded((length - s) / (0.15 * RADIUS_M))
    jaw = np.exp(-(((s / HEAD_LENGTH_M - 0.68) / 0.3) ** 2))
    snout = rounded(s / (0.7 * HEAD_LENGTH_M))
    body = RADIUS_M * neck * tail * tip
    return body * (1 + 0.3 * jaw) * snout, BODY_FLATNESS * body * (1 - 0.05 * jaw) * snout**0.8


def make_spine(rings: int) -> Spine:
    """The body at `rings` arc lengths: evenly spaced in scales, more densely at the head."""
    t = np.linspace(0, 1, 20001)
    pose = bspline(POSE_M, t)
    steps = np.linalg.norm(np.diff(pose, axis=0), axis=1)
    arc = np.concatenate([[0], np.cumsum(steps)])
    scale_length = SCALE_LENGTH_PER_RADIUS * np.maximum(half_sizes(arc, arc[-1])[0], 0.3 * RADIUS_M)
    scale_count = np.concatenate([[0], np.cumsum(steps / scale_length[1:])])
    crowding = 1 + 2 * smoothstep(1.5 - arc / HEAD_LENGTH_M) + 6 * np.exp(-arc / 0.004)
    ring_count = np.concatenate([[0], np.cumsum(np.diff(scale_count) * crowding[1:])])

    tip_m = 1e-5
    s = np.interp(np.linspace(0, ring_count[-1], rings), ring_count, arc)
    s = np.clip(s, tip_m, arc[-1] - tip_m)
    centre = bspline(POSE_M, np.interp(s, arc, t))
    tangent = np.gradient(centre, s, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    width, height = half_sizes(s, arc[-1])
    centre[:, 2] += BELLY_FLATNESS * height
    return Spine(s, centre, tangent, width, height, np.interp(s, arc, scale_count))


def scatter(i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """A fixed pseudo-random number in [0, 1) for each pair (i, j)."""
    return np.sin(12.9898 * i + 78.233 * j) * 43758.5453 % 1


def scale_relief(along: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Relief of overlapping scales, in scale lengths, at most 0.

    `along` counts scales tailwards, `across` counts rows from the middle of the back. Odd rows are shifted by half a
    scale. The broad belly scales follow the last row. Each scale is a dome with a slight random tilt. It rises
    tailwards and ends in a free edge above the next scale. Where scales overlap, the highest shows."""
    across = np.clip(across, -(DORSAL_ROWS + 1) / 2, (DORSAL_ROWS + 1) / 2)
    relief = np.full(np.broadcast(along, across).shape, -1.0)
    for row in (np.floor(across), np.floor(across) + 1):
        shift = 0.5 * (row % 2)
        nearest = np.round(along - shift) + shift
        y = across - row
        for column in (nearest - 1, nearest, nearest + 1):
            x = along - column
            tilt_x = 0.06 + 0.1 * (scatter(column, row) - 0.5)
            tilt_y = 0.1 * (scatter(column, row + 0.5) - 0.5)
            dome = 0.14 * (0.36 - x**2) + 0.13 * (1 - y**2) + tilt_x * x + tilt_y * y
            outside = np.maximum((np.abs(x) / 0.6) ** 1.6 + np.abs(y / 0.98) ** 1.6 - 1, 0)
            relief = np.maximum(relief, dome - 0.9 * outside)
    return relief - relief.max()


def eye_relief(s: np.ndarray, angle: np.ndarray, half_width: np.ndarray) -> np.ndarray:
    """Two domes on the sides of the head (m)."""
    from_eye_s = s - 0.4 * HEAD_LENGTH_M
    from_eye_angle = half_width * (np.abs(angle) - np.radians(58))
    distance = np.hypot(from_eye_s, from_eye_angle) / EYE_RADIUS_M
    return 0.4 * EYE_RADIUS_M * np.clip(1 - distance**2, 0, 1)


def body_surface(spine: Spine, segments: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (rings, segments, 3) in metres and UVs (rings, segments + 1, 2) of the skin. Rings start and end at the
    belly seam, which is one column of points but two of UVs."""
    v = np.linspace(0, 1, segments + 1)
    angle = 2 * np.pi * (v[:-1] - 0.5)
    width, height = spine.half_width[:, None], spine.half_height[:, None]
    scaly = smoothstep((spine.s / HEAD_LENGTH_M - 0.5) / 0.6)[:, None]
    rows = angle * (DORSAL_ROWS / 2) / BELLY_ANGLE
    relief = SCALE_LENGTH_PER_RADIUS * width * scaly * scale_relief(spine.scale_count[:, None], rows)
    relief += eye_relief(spine.s[:, None], angle, width)

    side = np.cross((0.0, 0.0, 1.0), spine.tangent)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(spine.tangent, side)
    sideways = (width + relief) * np.sin(angle)
    upwards = (height + relief) * np.cos(angle) * np.where(np.abs(angle) > np.pi / 2, BELLY_FLATNESS, 1.0)
    points = spine.centre[:, None] + sideways[..., None] * side[:, None] + upwards[..., None] * up[:, None]

    u = spine.s / (2 * np.pi * RADIUS_M)
    return points, np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)


def tube_quads(rings: int, segments: int) -> tuple[np.ndarray, np.ndarray]:
    """Corner indices (quads, 4) into the points and into the UVs of `body_surface`, counter-clockwise from outside."""
    ring, segment = np.meshgrid(np.arange(rings - 1), np.arange(segments), indexing="ij")
    corner_ring = ring[..., None] + (0, 1, 1, 0)
    corner_segment = segment[..., None] + (0, 0, 1, 1)
    points = corner_ring * segments + corner_segment % segments
    uvs = corner_ring * (segments + 1) + corner_segment
    return points.reshape(-1, 4), uvs.reshape(-1, 4)


def plain_material(
    name: str, colour: tuple[float, float, float], roughness: float, *, specular: float = 0.5
) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):  # always on in later versions
        material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["Specular IOR Level"].default_value = specular
    return material


def build_snake(name: str = "Snake", rings: int = 1850, segments: int = 132) -> bpy.types.Object:
    """Add the snake to the scene, at rest on the floor z = 0. It is a tube of quads with a pinhole at each tip."""
    points, uv = body_surface(make_spine(rings), segments)
    quads, uv_quads = tube_quads(rings, segments)

    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(rings * segments)
    mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
    mesh.loops.add(quads.size)
    mesh.loops.foreach_set("vertex_index", quads.astype(np.int32).ravel())
    mesh.polygons.add(len(quads))
    mesh.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4, dtype=np.int32))
    corner_uv = uv.reshape(-1, 2)[uv_quads].astype(np.float32)
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", corner_uv.ravel())
    mesh.update(calc_edges=True)
    mesh.shade_smooth()
    # Nearly black, like iridescent species.
    mesh.materials.append(plain_material("Snake Skin", (0.03, 0.02, 0.015), roughness=0.4))

    snake = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(snake)
    return snake

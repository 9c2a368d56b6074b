# SPDX-License-Identifier: GPL-3.0-or-later
"""A snake's arrays as a Blender mesh, with bones along its spine, and a piece of shed skin: the scales of back and
sides, cut open along the belly and laid flat."""

from __future__ import annotations

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from .body import SIDE_ANGLE, SPECIES, Spine
from .scales import Cut, make_net, place
from .shape import LEAST_FACES, MOST_FACES, SKIN, Shape

_BONES = 32


def new_mesh(name: str, shape: Shape) -> bpy.types.Mesh:
    """A smooth-shaded mesh with the shape's UV map and attributes, and sharp edges where a scale ends."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(shape.points))
    mesh.vertices.foreach_set("co", shape.points.astype(np.float32).ravel())
    mesh.loops.add(len(shape.corners))
    mesh.loops.foreach_set("vertex_index", shape.corners.astype(np.int32))
    mesh.polygons.add(len(shape.starts))
    mesh.polygons.foreach_set("loop_start", shape.starts.astype(np.int32))
    mesh.polygons.foreach_set("material_index", shape.material.astype(np.int32))
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", shape.uv.astype(np.float32).ravel())
    mesh.update(calc_edges=True)
    mesh.shade_smooth()
    ends = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", ends)
    creases = shape.edge[ends.reshape(-1, 2)].all(axis=1)
    mesh.attributes.new("sharp_edge", "BOOLEAN", "EDGE").data.foreach_set("value", creases)
    for domain, attributes in (("POINT", shape.of_points), ("FACE", shape.of_faces)):
        for key, values in attributes.items():
            mesh.attributes.new(key, "FLOAT", domain).data.foreach_set("value", values.astype(np.float32))  # type: ignore[arg-type]  # the stubs list the names
    return mesh


def add_bones(snake: bpy.types.Object, spine: Spine, s: np.ndarray) -> bpy.types.Object:
    """Add bones along a snake's spine that deform its mesh. Returns the new armature, which becomes the snake's parent.
    `s` (v,) are the arc lengths of the mesh's points; each point follows the two bones nearest to it."""
    armature = bpy.data.objects.new(f"{snake.name} Bones", bpy.data.armatures.new(f"{snake.name} Bones"))
    for collection in snake.users_collection:
        collection.objects.link(armature)
    armature.matrix_world = snake.matrix_world
    ends = np.linspace(0, spine.length, _BONES + 1)
    joints = np.stack([np.interp(ends, spine.s, spine.points[:, k]) for k in range(3)], axis=1)
    backs = np.stack([np.interp((ends[1:] + ends[:-1]) / 2, spine.s, spine.back[:, k]) for k in range(3)], axis=1)
    names = [f"Spine {k + 1:02}" for k in range(_BONES)]
    active = bpy.context.view_layer.objects.active
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    parent = None
    # From tail to head: a rotated bone takes everything in front of it along, as when a snake lifts its neck.
    for k in range(_BONES - 1, -1, -1):
        bone = armature.data.edit_bones.new(names[k])
        bone.head, bone.tail = joints[k + 1], joints[k]
        bone.align_roll(backs[k])
        bone.parent, bone.use_connect = parent, parent is not None
        parent = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = active
    snake.parent = armature
    snake.matrix_parent_inverse = armature.matrix_world.inverted()
    _weigh(snake, names, s / spine.length * _BONES - 0.5)
    modifier = snake.modifiers.new("Bones", "ARMATURE")
    modifier.object = armature
    return armature


def _weigh(snake: bpy.types.Object, names: list[str], place: np.ndarray) -> None:
    """Set the weights of all points in the bones' vertex groups. `place` (v,) is 0 at the middle of the first bone, 1
    at the middle of the second."""
    place = np.clip(place, 0, len(names) - 1)
    groups = [snake.vertex_groups.new(name=name) for name in names]
    before = np.minimum(place.astype(int), len(names) - 2)
    share = place - before
    for k, (first, weight) in enumerate(zip(before.tolist(), share.tolist(), strict=True)):
        if weight < 1:
            groups[first].add((k,), 1 - weight, "REPLACE")
        if weight > 0:
            groups[first + 1].add((k,), weight, "REPLACE")


# Dry skin is slightly wavy: the height of the waves and the shortest wavelength, in sides of the piece.
_WAVE, _SHORTEST_WAVE = 0.004, 0.35


def shed_shape(species_name: str, *, size: float, faces: int, seed: int = 0) -> Shape:
    """A piece of about `size` x `size` metres on the plane z = 0, of a species in SPECIES, with about `faces` faces. X
    points to the tail and Y around the body, like U and V. Raises GratingError if `faces` is out of range."""
    if not LEAST_FACES <= faces <= MOST_FACES:
        raise GratingError("shed skin", f"{faces} faces", f"give {LEAST_FACES} to {MOST_FACES}")
    species = SPECIES[species_name]
    radius = size / (2 * SIDE_ANGLE)
    unit = radius * species.scale_length
    rng = np.random.default_rng(seed)
    net = make_net(species.rows, _cut(faces, species.rows, size / unit))
    # The skin itself is flat.
    places = place(net, species, flatness=0.0, scatter=np.ones(net.cut.scales + 3), rng=rng)
    quads = net.quads[~net.belly]
    used, corners = np.unique(quads, return_inverse=True)
    along, angle, rise, overhang, rim, inside = (part[used] for part in places)
    x, y = unit * along, radius * angle
    points = np.stack([x + unit * overhang, y, unit * rise + _waves(x / size, y / size, rng) * size], axis=1)
    points -= (*(points.min(axis=0) + points.max(axis=0))[:2] / 2, points[:, 2].min())
    corners = corners.reshape(quads.shape)
    uv = np.stack([x / (2 * np.pi * radius), angle / (2 * np.pi) + 0.5], axis=1)
    s = x - x.min()
    scale = net.scale[~net.belly]
    return Shape(
        points=points,
        corners=corners.ravel(),
        starts=np.arange(0, corners.size, 4),
        uv=uv[corners].reshape(-1, 2),
        material=np.full(len(corners), SKIN),
        edge=inside == 1,
        s=s,
        of_points={"scale_rim": rim, "along": s / s.max(), "around": np.abs(angle) / np.pi},
        of_faces={"scale_random": rng.random(scale.max() + 1)[scale], "belly": np.zeros(len(corners))},
    )


def _cut(faces: int, rows: int, natural: float) -> Cut:
    """The cut with `faces` faces within 4 % whose scales in a row are nearest to `natural`."""
    cuts = []
    for n in range(3, 64):
        # Every other row has one more scale.
        scales = round((faces / n**2 - (rows + 1) / 2) / rows)
        made = (scales * rows + (rows + 1) / 2) * n**2
        if scales > 1 and abs(made / faces - 1) < 0.04:
            cuts.append(Cut(scales, n, belly=2, head=0, tail=0))
    return min(cuts, key=lambda cut: abs(np.log(cut.scales / natural)))


def _waves(x: np.ndarray, y: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Heights of long waves in random directions, at points (v,), in sides of the piece."""
    heights = np.zeros_like(x)
    for _ in range(5):
        direction, phase = rng.uniform(0, 2 * np.pi, 2)
        waves = 2 * np.pi * rng.uniform(0.3, 1) / _SHORTEST_WAVE
        heights += _WAVE * np.sin(waves * (x * np.cos(direction) + y * np.sin(direction)) + phase)
    return heights

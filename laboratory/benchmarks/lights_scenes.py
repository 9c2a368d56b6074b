# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes in which renders are compared with integrals: surfaces, subjects, worlds, and points of the subject.

A pixel shows one point, as in all measurements of the radiance. The position and tangent frame of a point come from
pictures by Cycles, never from the materials under test. Each subject stands alone, and only points are chosen from
which the subject hides none of the sky: the integrals do not contain the subject's own reflections.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Self

import numpy as np

from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.surface.readers.reader_registry import read_height_map
from sample_scenes.panoramas import overcast, soft_boxes
from sample_scenes.room import room

from .blender import start_blender
from .studio import rendered

# File, and height in nanometres from black to white; the scans are 65 um wide.
_SCANS = (("elaphe_65um.png", 375), ("xenopeltis_65um.png", 818.69))
_FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data" / "snake"
SURFACES = ("sample:elaphe", *(name for name, _ in _SCANS))
SUBJECTS = ("snake", "sphere")
_PAINTED = {"studio": soft_boxes, "overcast sky": overcast, "room": cache(room)}
WORLDS = tuple(_PAINTED)
RADIUS_M = 0.2
# Rows of a painted world.
_ROWS = 256
# The number of rays that test whether a point sees the whole sky, and the smallest cosine of the rays and of the view.
_RAYS, _COSINE_MIN = 256, 0.1


class Worlds:
    """A subject under worlds, and the add-on's materials."""

    def __init__(self, addon: SimpleNamespace, folder: Path, pixels: int, bake: Path):
        self.addon, self.folder, self.pixels, self.bake = addon, folder, pixels, bake

    @classmethod
    def started(cls, folder: Path, pixels: int) -> Self:
        """Start with the add-on of this tree and a bake of the Elaphe sample in a folder."""
        addon = start_blender(folder)
        facts = bake_to_folder([read_height_map(SURFACES[0])], BakeRequest(), folder, progress=lambda *_: None)
        return cls(addon, folder, pixels, Path(facts["files"][0]))

    def bakes(self, names: Sequence[str] = SURFACES) -> Iterator[tuple[str, Path]]:
        """The name and the bake's file of each of these surfaces."""
        if SURFACES[0] in names:
            yield SURFACES[0], self.bake
        for name, height_nm in _SCANS:
            if name in names and (_FOLDER / name).is_file():
                folder = self.folder / Path(name).stem
                folder.mkdir()
                scan = read_height_map(str(_FOLDER / name), 65, height_nm)
                facts = bake_to_folder([scan], BakeRequest(), folder, progress=lambda *_: None)
                yield name, Path(facts["files"][0])

    def material(self, bake: Path, lights: str):
        """A new diffraction material of a bake, and its skin node."""
        group = self.addon.making_materials.new_diffraction_group(bake, False, lights)
        made = self.addon.material.new_diffraction_material("lit", group)
        return made, next(node for node in made.node_tree.nodes if node.label == "Skin")

    def build(self, subject: str) -> None:
        """Build one of SUBJECTS, alone and without a material, and a camera."""
        import bpy
        from mathutils import Vector

        from sample_scenes import stage
        from sample_scenes.snake import build_snake

        self.scene = bpy.context.scene
        stage.clean_scene()
        stage.render_settings(self.scene)
        if subject == "snake":
            self.mesh, target, at, angle = build_snake(), (-0.03, -0.05, 0.03), (-0.036, -0.80, 0.69), 5
        else:
            bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=RADIUS_M)
            bpy.ops.object.shade_smooth()
            self.mesh, target, at, angle = bpy.context.object, (0, 0, 0), (0.0, -0.6, 0.1), 38
            self.mesh.data.materials.append(None)
        camera = stage.add_camera(self.scene)
        camera.data.type, camera.data.angle = "PERSP", np.radians(angle)
        camera.location = at
        camera.rotation_euler = (Vector(at) - Vector(target)).to_track_quat("Z", "Y").to_euler()
        cycles, image = self.scene.cycles, self.scene.render.image_settings
        cycles.use_denoising = cycles.use_adaptive_sampling = cycles.shading_system = False
        cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", 0.01  # Cycles' box is a whole pixel at any width
        image.file_format, image.color_depth = "OPEN_EXR", "32"

    def light_by(self, world: str) -> np.ndarray:
        """Light the scene by one of WORLDS; returns its radiance (_ROWS, 2 _ROWS, 3), laid out as in
        precompute/world_sources/sources.py."""
        from sample_scenes.relight import paint

        panorama = _PAINTED[world](_ROWS)
        paint(self.scene, panorama)
        self.addon.lighting.update_lamps(self.scene)
        return panorama

    def render(self, samples: int, pixels: int | None = None) -> np.ndarray:
        """Render a square with Cycles; returns the linear picture (rows, columns, 3), row 0 at the top."""
        render = self.scene.render
        render.engine, self.scene.cycles.samples = "CYCLES", samples
        render.resolution_y = render.resolution_x = pixels or self.pixels
        return rendered(self.scene, self.folder / "picture.exr")


def looked_up(panorama: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Values (n, c) of panoramas (rows, cols, c) in directions (n, 3), like an Environment Texture with "Linear"."""
    rows, cols, _ = panorama.shape
    x = (0.5 - np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi)) * cols - 0.5
    y = (0.5 + np.arcsin(np.clip(directions[:, 2], -1, 1)) / np.pi) * rows - 0.5
    left, below = np.floor(x).astype(int), np.floor(y).astype(int)
    across, up = (x - left)[:, None], (y - below)[:, None]
    low, high = below % rows, (below + 1) % rows  # at the poles Cycles mixes the first row with the last
    bottom, top = (
        panorama[row, left % cols] * (1 - across) + panorama[row, (left + 1) % cols] * across for row in (low, high)
    )
    return bottom * (1 - up) + top * up


@dataclass(frozen=True)
class Points:
    """Points of a subject: their pixels (rows, columns), positions (n, 3), tangent frames (n, 3, 3) with T, B and N in
    rows, and the unit vectors to the camera (n, 3) in these frames."""

    pixels: tuple[np.ndarray, np.ndarray]
    positions: np.ndarray
    frames: np.ndarray
    views: np.ndarray


def free_points(studio: Worlds, pixels: int, number: int) -> Points:
    """At most `number` points of the mesh, drawn at random with a fixed seed from the pixels of a square picture.
    Points from which the mesh hides nothing of the hemisphere come first.

    All other faces of the mesh become black, which saves shading time."""
    import bpy
    from mathutils.bvhtree import BVHTree

    passes, seen = _geometry(studio, pixels)
    rows, columns = np.nonzero(seen)
    position, n, wr, t = (passes[name][seen] for name in ("Position", "Normal", "Incoming", "Tangent"))
    n, wr = (each / np.linalg.norm(each, axis=1, keepdims=True) for each in (n, wr))
    t = t - n * (n * t).sum(axis=1, keepdims=True)
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    frames = np.stack([t, np.cross(n, t), n], axis=1)
    views = np.einsum("nij,nj->ni", frames, wr)
    chosen = np.random.default_rng(0).permutation(np.flatnonzero(views[:, 2] > _COSINE_MIN))
    tree = BVHTree.FromObject(studio.mesh, bpy.context.evaluated_depsgraph_get())
    hidden = _hidden(tree, position[chosen], frames[chosen])
    chosen = chosen[np.argsort(hidden, kind="stable")[:number]]
    black = np.ones(len(studio.mesh.data.polygons), np.int32)
    black[[tree.find_nearest(place)[2] for place in position[chosen]]] = 0
    material = bpy.data.materials.new("Black")
    studio.addon.compat.enable_nodes(material)
    material.node_tree.nodes.clear()
    studio.mesh.data.materials.append(material)
    studio.mesh.data.polygons.foreach_set("material_index", black)
    return Points((rows[chosen], columns[chosen]), position[chosen], frames[chosen], views[chosen])


def _hidden(tree, positions: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """The share (n,) of rays from each point that hit the mesh of a BVHTree again."""
    from mathutils import Vector

    z = _COSINE_MIN + (1 - _COSINE_MIN) * (np.arange(_RAYS) + 0.5) / _RAYS
    turn = np.arange(_RAYS) * np.pi * (3 - 5**0.5)
    rays = np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=-1)
    start = positions + 1e-5 * frames[:, 2]
    return np.array([
        np.mean([tree.ray_cast(Vector(at), Vector(ray))[0] is not None for ray in rays @ frame])
        for at, frame in zip(start, frames, strict=True)
    ])  # fmt: skip


def _geometry(studio: Worlds, pixels: int) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Pictures (n, n, 3) of Position, Normal, Tangent and Incoming, and a mask of the pixels that see the mesh."""
    import bpy

    found = {}
    world, studio.scene.world = studio.scene.world, None
    for name, kind, settings in (
        ("Position", "ShaderNodeNewGeometry", {}),
        ("Normal", "ShaderNodeNewGeometry", {}),
        ("Incoming", "ShaderNodeNewGeometry", {}),
        ("Tangent", "ShaderNodeTangent", {"direction_type": "UV_MAP"}),
    ):
        material = bpy.data.materials.new(name)
        studio.addon.compat.enable_nodes(material)
        material.node_tree.nodes.clear()
        tree = studio.addon.builder.Tree(material.node_tree)
        value = tree.value(tree.node(kind, **settings).outputs[name])
        tree.node("ShaderNodeOutputMaterial", tree.emission(value.times_plus(0.25, (0.5, 0.5, 0.5)), 1.0))
        studio.mesh.material_slots[0].material = material
        found[name] = studio.render(1, pixels)
    studio.scene.world = world
    seen = found["Incoming"].max(axis=-1) > 0
    return {name: value * 4 - 2 for name, value in found.items()}, seen

# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes in which renders are compared with integrals: surfaces, subjects, worlds, and points of the subject.

A pixel shows one point, as in all measurements of the radiance. The position and tangent frame of a point come from
pictures by Cycles, never from the materials under test. Each subject stands alone, and only points are chosen from
which the subject hides none of the sky: the integrals do not contain the subject's own reflections.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.surface.readers.reader_registry import read_height_map
from precompute.world_sources.sources import crop_cells, crop_frame
from sample_scenes.panoramas import overcast, soft_boxes
from sample_scenes.room import room

from .studio import Studio

# File, and height in nanometres from black to white; the scans are 65 um wide.
_SCANS = (("elaphe_65um.png", 375), ("xenopeltis_65um.png", 818.69))
_FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data" / "snake"
SURFACES = ("sample:elaphe", *(name for name, _ in _SCANS))
SUBJECTS = ("snake", "sphere", "disc")
WORLDS = ("studio", "clear sky", "overcast sky", "room", "area lamp")
# In metres. A square lamp 1 m wide lights the subject from 1 m away; its watts give it a radiance of 10 W/m2/sr.
RADIUS_M, LAMP_M, LAMP_W = 0.2, 1.0, 10 * np.pi
_TO_LAMP = np.array((0.5, -0.3, 0.8)) / np.linalg.norm((0.5, -0.3, 0.8))
# Rows of a painted world, and of a sky read from a render.
_ROWS = 256
# A close look at the sun: half its angle, and the pixels of a side.
_LOOK, _LOOK_PIXELS = np.radians(0.6), 96
# The sun's disc is sampled in rings of equal width.
_SUN_RINGS = 4
# A place in metres from which a camera sees only the world.
_FAR_M = 1000
# The number of rays that test whether a point sees the whole sky, and the smallest cosine of the rays and of the view.
_RAYS, _COSINE_MIN = 256, 0.1


class Worlds(Studio):
    """The studio lit by worlds."""

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

    def paint(self, radiance: np.ndarray) -> None:
        """Set a world of this radiance (rows, cols, 3), laid out as in precompute/world_sources/sources.py."""
        from sample_scenes.relight import paint

        paint(self.scene, radiance)

    def world(self):
        """Set a new world; returns its node tree and its Background node."""
        import bpy

        self.scene.world = bpy.data.worlds.new("World")
        self.addon.compat.enable_nodes(self.scene.world)
        tree = self.scene.world.node_tree
        return tree, next(node for node in tree.nodes if node.type == "BACKGROUND")

    def look(self, direction: np.ndarray, half_angles: tuple[float, float], shape: tuple[int, int]) -> np.ndarray:
        """A picture (rows, cols, 3) of the world around a direction (3,), up to half angles of latitude and longitude,
        laid out as in precompute/world_sources/sources.py."""
        import bpy
        import mathutils

        forward, left, up = crop_frame(direction).T
        data = bpy.data.cameras.new("Look")
        data.type, data.panorama_type = "PANO", "EQUIRECTANGULAR"
        data.latitude_max, data.longitude_max = half_angles
        data.latitude_min, data.longitude_min = -half_angles[0], -half_angles[1]
        camera = bpy.data.objects.new("Look", data)
        self.scene.collection.objects.link(camera)
        rotation = mathutils.Matrix(np.stack((-left, up, -forward), axis=1)).to_4x4()
        camera.matrix_world = mathutils.Matrix.Translation((0, 0, _FAR_M)) @ rotation
        before, self.scene.camera = self.scene.camera, camera
        try:
            return self.render(1, shape)[::-1]
        finally:
            self.scene.camera = before
            bpy.data.batch_remove([camera, data])


@dataclass(frozen=True)
class Light:
    """The light of a scene, for an integral.

    panorama    (_ROWS, 2 _ROWS, 3) the world's radiance, laid out as in precompute/world_sources/sources.py
    directions  (n, 3) unit vectors to points of a sun, which the panorama leaves out, and
    irradiance  (n, 3) of each
    variance    of the disc of each in rad2, along one axis
    square      a lamp's middle (3,) and its axes x, y, z as rows (3, 3), or None; its side is LAMP_M"""

    panorama: np.ndarray
    directions: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    irradiance: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    variance: float = 0.0
    square: tuple[np.ndarray, np.ndarray] | None = None

    def of_lamp(self, directions: np.ndarray, position: np.ndarray, blur: float) -> np.ndarray:
        """The lamp's radiance (n,) from directions (n, 3) at a position (3,); its edge is `blur` radians wide."""
        middle, axes = self.square
        x, y, z = (directions @ axis for axis in axes)
        with np.errstate(divide="ignore", invalid="ignore"):
            along = ((middle - position) @ axes[2]) / z
            away = [along * each - (middle - position) @ axis for each, axis in ((x, axes[0]), (y, axes[1]))]
            inside = [np.clip((LAMP_M / 2 - np.abs(each)) / (along * blur) + 0.5, 0, 1) for each in away]
        return np.where((z > 0) & (along > 0), inside[0] * inside[1], 0.0) * (LAMP_W / np.pi / LAMP_M**2)


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


def build(studio: Worlds, subject: str) -> None:
    """Build one of SUBJECTS, alone and without a material, and a camera."""
    import bpy
    from mathutils import Vector

    from sample_scenes.snake import build_snake

    studio.build()
    bpy.data.objects.remove(studio.mesh)
    if subject == "snake":
        studio.mesh, target, at, angle = build_snake(), (-0.03, -0.05, 0.03), (-0.036, -0.80, 0.69), 5
    elif subject == "sphere":
        bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=RADIUS_M)
        bpy.ops.object.shade_smooth()
        studio.mesh, target, at, angle = bpy.context.object, (0, 0, 0), (0.0, -0.6, 0.1), 38
    else:
        bpy.ops.mesh.primitive_circle_add(vertices=128, radius=RADIUS_M, fill_type="NGON")
        studio.mesh, target, at, angle = bpy.context.object, (0, 0, 0), (0.06, -0.36, 0.5), 34
    studio.target = np.array(target, float)
    camera = studio.scene.camera
    camera.data.type, camera.data.angle = "PERSP", np.radians(angle)
    camera.location = at
    camera.rotation_euler = (Vector(at) - Vector(target)).to_track_quat("Z", "Y").to_euler()
    if not studio.mesh.material_slots:
        studio.mesh.data.materials.append(None)
    cycles = studio.scene.cycles
    cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", 0.01  # Cycles' box is a whole pixel at any width


def light_by(studio: Worlds, world: str) -> Light:
    """Light the scene by one of WORLDS, around its target; returns the light for the integrals."""
    without_lamps(studio)
    if world == "area lamp":
        return _area_lamp(studio)
    if world == "clear sky":
        return _clear_sky(studio)
    panorama = _PAINTED[world](_ROWS)
    studio.paint(panorama)
    return Light(panorama)


def without_lamps(studio: Worlds) -> None:
    """Remove all lamps of the scene."""
    import bpy

    bpy.data.batch_remove([lamp for lamp in bpy.data.objects if lamp.type == "LIGHT"])
    studio.addon.lighting.update_lamps(studio.scene)


def _area_lamp(studio: Worlds) -> Light:
    import bpy
    from mathutils import Vector

    studio.world()[1].inputs["Color"].default_value = (0, 0, 0, 1)
    data = bpy.data.lights.new("Area", "AREA")
    data.size, data.energy = LAMP_M, LAMP_W
    lamp = bpy.data.objects.new("Area", data)
    lamp.location = studio.target + _TO_LAMP
    lamp.rotation_euler = Vector(_TO_LAMP).to_track_quat("Z", "Y").to_euler()
    studio.scene.collection.objects.link(lamp)
    bpy.context.view_layer.update()
    studio.addon.lighting.update_lamps(studio.scene)
    return Light(
        np.zeros((_ROWS, 2 * _ROWS, 3)), square=(np.array(lamp.location), np.array(lamp.matrix_world.to_3x3()).T)
    )


_PAINTED = {"studio": soft_boxes, "overcast sky": overcast, "room": cache(room)}


def _clear_sky(studio: Worlds) -> Light:
    from sample_scenes import stage

    stage.light_by_sky(studio.scene, stage.SUN_AZIMUTH_DEG, stage.SUN_ELEVATION_DEG)
    return light_of_sky(studio)


def light_of_sky(studio: Worlds, rows: int = _ROWS) -> Light:
    """The light of the scene's Sky Texture: its panorama without the sun's disc, and the disc's light from a closer
    look."""
    sky = next(node for node in studio.scene.world.node_tree.nodes if node.type == "TEX_SKY")
    up, around = sky.sun_elevation, sky.sun_rotation
    sun = np.array((np.cos(up) * np.sin(around), np.cos(up) * np.cos(around), np.sin(up)))
    size = sky.sun_size
    looks = []
    for disc in (True, False):
        sky.sun_disc = disc
        looks.append(studio.look(sun, (_LOOK, _LOOK), (_LOOK_PIXELS, _LOOK_PIXELS)))
    panorama = studio.look(np.array((1.0, 0, 0)), (np.pi / 2, np.pi), (rows, 2 * rows))
    sky.sun_disc = True
    cells = crop_cells(_LOOK_PIXELS, _LOOK, sun)
    total = ((looks[0] - looks[1]).reshape(-1, 3) * cells.solid_angles[:, None]).sum(axis=0)
    left = np.cross((0, 0, 1), sun) / np.linalg.norm(np.cross((0, 0, 1), sun))
    points = []
    for ring in range(_SUN_RINGS):
        turn = (np.arange(8 * ring + 4) + 0.5) * 2 * np.pi / (8 * ring + 4)  # in proportion to the ring's area
        radius = np.tan(size / 2) * (ring + 0.5) / _SUN_RINGS
        x, y = radius * np.cos(turn)[:, None], radius * np.sin(turn)[:, None]
        points.append(sun + x * left + y * np.cross(sun, left))
    directions = np.concatenate(points)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return Light(panorama, directions, np.repeat(total[None] / len(directions), len(directions), axis=0))


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

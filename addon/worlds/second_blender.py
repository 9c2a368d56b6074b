# SPDX-License-Identifier: GPL-3.0-or-later
"""The code in the second Blender: renders a self-contained copy of a world, in a file without objects or scenes, around
a point and fits its sources (started by world_probe.py)."""

import contextlib
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy
import mathutils
import numpy as np

from ...precompute.base.strict import read_json
from ...precompute.world_sources.sources import crop_frame, fit_closely, missed
from ..blender import compat

ROWS, COLS = 128, 256
# Samples per pixel of the panorama and of closer looks. The panorama's samples are a quarter of a degree apart, so
# about three hit a sun of half a degree. The suns of Sky Textures always get a closer look.
_SAMPLES, _LOOK_SAMPLES = 32, 16
# Light Path outputs of a glossy ray that left the camera's first surface; others are 0. Ray Length stays as it is.
_GLOSSY = {"Is Glossy Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0, "Glossy Depth": 1.0}
_LENGTH = "Ray Length"
# Sky models without a sun disc.
_WITHOUT_SUN = ("PREETHAM", "HOSEK_WILKIE")


def render_and_fit(request_path: Path) -> None:
    """Render the requested world, and write panorama.npy and fit.json into the request's folder."""
    request = read_json(request_path, "try again")
    folder = Path(request["folder"])
    bpy.ops.wm.open_mainfile(filepath=str(folder / "world.blend"), load_ui=False, use_scripts=False)
    world, scene = bpy.data.worlds[request["world"]], bpy.context.scene
    camera = _set_up(scene, world, request)
    _complete(world, request)
    _show_as_to_glossy_rays(world)

    def look(direction: np.ndarray, half_angle: float, size: int) -> np.ndarray:
        scene.cycles.samples = _LOOK_SAMPLES
        camera.data.latitude_min = camera.data.longitude_min = -half_angle
        camera.data.latitude_max = camera.data.longitude_max = half_angle
        return _rendered(scene, camera, direction, (size, size), folder)

    panorama = _rendered(scene, camera, np.array((1.0, 0, 0)), (ROWS, COLS), folder)
    sources = fit_closely(panorama, request["count"], look, suns=_suns(world)) if request["count"] else []
    np.save(folder / "panorama.npy", panorama)
    found = [
        {"direction": one.direction.tolist(), "irradiance": one.irradiance.tolist(), "variance": one.variance}
        for one in sources
    ]
    report = {"sources": found, "missed": missed(panorama, sources)}
    (folder / "fit.json").write_text(json.dumps(report), encoding="utf-8")


def _trees(world: bpy.types.World) -> Iterator[bpy.types.NodeTree]:
    tree = compat.world_nodes(world)
    if tree is not None:
        yield tree
        yield from bpy.data.node_groups


def _complete(world: bpy.types.World, request: dict[str, Any]) -> None:
    """Restore what the world's file lacks: painted pixels, and the positions of objects."""
    for painted in request["pixels"]:
        image = bpy.data.images[painted["image"]]
        image.pixels.foreach_set(np.load(Path(request["folder"]) / painted["file"]))
        image.update()
    for reference in request["objects"]:
        tree = bpy.data.node_groups[reference["tree"]] if reference["tree"] else world.node_tree
        empty = bpy.data.objects.new("place", None)
        bpy.context.scene.collection.objects.link(empty)
        empty.matrix_world = mathutils.Matrix(reference["matrix"])
        setattr(tree.nodes[reference["node"]], reference["property"], empty)


def _show_as_to_glossy_rays(world: bpy.types.World) -> None:
    """Let the camera see what a glossy ray would see."""
    world.cycles_visibility.camera = world.cycles_visibility.glossy
    for tree in _trees(world):
        for node in [node for node in tree.nodes if node.type == "LIGHT_PATH"]:
            for output in node.outputs:
                for link in list(output.links) if output.name != _LENGTH else ():
                    value = tree.nodes.new("ShaderNodeValue")
                    value.outputs[0].default_value = _GLOSSY.get(output.name, 0.0)
                    tree.links.new(value.outputs[0], link.to_socket)


def _set_up(scene: bpy.types.Scene, world: bpy.types.World, request: dict[str, Any]) -> bpy.types.Object:
    """Set up the scene with the world and return its panoramic camera. A pixel is the unweighted mean of its area."""
    data = bpy.data.cameras.new("around")
    data.type, data.panorama_type = "PANO", "EQUIRECTANGULAR"
    camera = bpy.data.objects.new("around", data)
    scene.collection.objects.link(camera)
    scene.world, scene.camera = world, camera
    # Cycles' map for importance sampling takes time to build, and camera rays do not use it.
    world.cycles.sampling_method = "NONE"
    tree = compat.world_nodes(world)
    if tree is not None:
        for node in tree.nodes:
            if node.type == "OUTPUT_WORLD":
                for link in list(node.inputs["Volume"].links):
                    tree.links.remove(link)
    render, cycles = scene.render, scene.cycles
    render.engine, render.resolution_percentage, render.use_persistent_data = "CYCLES", 100, True
    render.use_compositing = render.use_sequencer = render.film_transparent = render.use_motion_blur = False
    settings = render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    cycles.device, cycles.samples, cycles.pixel_filter_type = "CPU", _SAMPLES, "BOX"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.shading_system = request["osl"]
    scene.frame_set(request["frame"])
    return camera


def _suns(world: bpy.types.World) -> list[np.ndarray]:
    """The directions (3,) of the sun discs of Sky Textures without rotated, scaled or linked coordinates."""
    skies = [node for tree in _trees(world) for node in tree.nodes if node.type == "TEX_SKY"]
    suns = []
    for sky in skies:
        if sky.sky_type in _WITHOUT_SUN or not sky.sun_disc:
            continue
        turned = tuple(sky.texture_mapping.rotation) != (0, 0, 0) or tuple(sky.texture_mapping.scale) != (1, 1, 1)
        if turned or any(socket.is_linked for socket in sky.inputs):
            continue
        up, around = sky.sun_elevation, sky.sun_rotation
        suns.append(np.array((math.cos(up) * math.sin(around), math.cos(up) * math.cos(around), math.sin(up))))
    return suns


def _rendered(
    scene: bpy.types.Scene, camera: bpy.types.Object, direction: np.ndarray, shape: tuple[int, int], folder: Path
) -> np.ndarray:
    """The picture that the camera sees along a direction, (rows, cols, 3), row 0 at the bottom."""
    forward, left, up = crop_frame(direction).T
    # A camera looks along its -Z, with +X to the right.
    camera.matrix_world = mathutils.Matrix(np.stack((-left, up, -forward), axis=1).tolist()).to_4x4()
    path = folder / "seen.exr"
    scene.render.resolution_y, scene.render.resolution_x = shape
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.is_data = True  # as written, in the file's working space
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return values.reshape(*shape, -1)[..., :3].astype(float)


# Nodes that give the same result in all directions. Other nodes may vary.
_EVEN = {
    "OUTPUT_WORLD", "BACKGROUND", "RGB", "VALUE", "BLACKBODY", "WAVELENGTH", "MATH", "MIX", "MIX_SHADER", "ADD_SHADER",
    "REROUTE", "FRAME", "LIGHT_PATH",
}  # fmt: skip


@dataclass
class StandAlone:
    """A copy of a world, and what is missing in it.

    objects     one entry per node property that refers to an object: "tree" (name of the group, or "" for the world
                itself), "node", "property", and "matrix" (the object's world matrix, row by row)
    copies      the copy and the copies of its node groups"""

    world: bpy.types.World
    objects: list[dict[str, Any]] = field(default_factory=list)
    copies: list[bpy.types.ID] = field(default_factory=list)

    def painted(self) -> list[bpy.types.Image]:
        """The nodes' pictures with unsaved painted pixels."""
        trees = [self.world.node_tree, *(copy for copy in self.copies if isinstance(copy, bpy.types.NodeTree))]
        images = {getattr(node, "image", None) for tree in trees if tree for node in tree.nodes}
        return sorted(
            (image for image in images if image is not None and image.is_dirty), key=lambda image: image.name_full
        )


def is_even(world: bpy.types.World) -> bool:
    """Whether the world's nodes give the same colour in all directions."""
    tree = compat.world_nodes(world)
    return tree is None or all(node.type in _EVEN for node in tree.nodes)


@contextlib.contextmanager
def stand_alone(world: bpy.types.World) -> Iterator[StandAlone]:
    """Copy a world at the current frame, without animation and references to objects. The copy is removed on exit."""
    copy = world.copy()
    alone = StandAlone(copy, copies=[copy])
    try:
        copy.animation_data_clear()
        for name in [name for name, value in copy.items() if isinstance(value, bpy.types.ID)]:
            del copy[name]
        if copy.node_tree:
            _cut_loose(copy.node_tree, "", alone, {})
        yield alone
    finally:
        bpy.data.batch_remove(alone.copies)


def _cut_loose(
    tree: bpy.types.NodeTree, name: str, alone: StandAlone, groups: dict[bpy.types.NodeTree, bpy.types.NodeTree]
) -> None:
    tree.animation_data_clear()
    for node in tree.nodes:
        for own in node.bl_rna.properties:
            value = getattr(node, own.identifier) if own.type == "POINTER" else None
            if isinstance(value, bpy.types.Object):
                matrix = [list(row) for row in value.matrix_world]
                reference = {"tree": name, "node": node.name, "property": own.identifier, "matrix": matrix}
                alone.objects.append(reference)
                setattr(node, own.identifier, None)
        group = node.node_tree if node.type == "GROUP" else None
        if group is None:
            continue
        if group not in groups:
            groups[group] = group.copy()
            alone.copies.append(groups[group])
            _cut_loose(groups[group], groups[group].name, alone, groups)
        node.node_tree = groups[group]

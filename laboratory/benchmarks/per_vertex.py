# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffraction computed at the vertices, compared with diffraction in each pixel (thesis 4.5.1).

    ./dev bench per_vertex [--output DIR] [--pixels 320] [--json FILE|-]

The sample snake is built with fewer and fewer vertices. The diffraction is computed at the vertices and interpolated,
as in a per-vertex shader. The table gives its relative error of luminance against the Diffraction group, over the
pixels above 1 % of the brightest.
"""

import tempfile
from pathlib import Path

import numpy as np

from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.table import atlas
from precompute.table.radiance import lamp_radiance

from . import report
from .render_time import Studio

# Rings and segments of the snake: the sample's own, about the thesis's 11,696 vertices, and fewer.
MESHES = ((1850, 132), (488, 24), (160, 12))
_CAMERA, _TARGET, _FIELD_DEG = (-0.036, -0.80, 0.69), (-0.036, -0.025, 0.02), 12.0


def main(argv: list[str] | None = None) -> int:
    """Print the table, write the pictures and return the exit status."""
    parser = OneLineParser(prog="./dev bench per_vertex", description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, metavar="DIR", help="where the pictures go")
    parser.add_argument("--pixels", type=count(4, 8192), default=320)
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        studio = Studio.started(Path(folder), arguments.pixels)
        look(studio)
        table, _ = atlas.read(studio.bake)
        report.say(f"{'vertices':>9}{'median':>9}{'p95':>9}", arguments.json)
        for rings, segments in MESHES:
            pixel, vertex = both(studio, table, rings, segments)
            error = relative_error(vertex, pixel)
            median, p95 = np.percentile(error, (50, 95)).tolist()
            rows.append({"vertices": rings * segments, "median": median, "p95": p95})
            report.say(f"{rings * segments:9}{median:9.1%}{p95:9.1%}", arguments.json)
            if arguments.output:
                for name, picture in (("pixel", pixel), ("vertex", vertex)):
                    save(picture, arguments.output / f"per_{name}_{rings * segments}.png")
    report.write({"rows": rows}, arguments.json)
    return 0


def look(studio: Studio) -> None:
    """Point the camera at the snake's bends and light the scene with a single sun."""
    import bpy
    from mathutils import Vector

    studio.build("sphere")
    bpy.data.objects.remove(studio.mesh)
    camera = studio.scene.camera
    camera.data.type, camera.data.angle = "PERSP", np.radians(_FIELD_DEG)
    camera.data.clip_start, camera.location = 0.01, _CAMERA
    camera.rotation_euler = (Vector(_CAMERA) - Vector(_TARGET)).to_track_quat("Z", "Y").to_euler()
    studio.light(1)
    sun = next(o for o in bpy.data.objects if o.type == "LIGHT")
    sun.rotation_euler = Vector((-0.5, 0.6, 0.6)).to_track_quat("Z", "Y").to_euler()


def both(studio: Studio, table, rings: int, segments: int) -> tuple[np.ndarray, np.ndarray]:
    """The snake shaded in each pixel, and at its vertices: linear pictures (n, n, 3)."""
    import bpy

    from sample_scenes.snake import build_snake

    studio.mesh = build_snake("Snake", rings, segments)
    pictures = []
    for make in (studio.direct, lambda: vertex_material(studio, table)):
        material = make()
        for node in material.node_tree.nodes:
            if node.type == "BSDF_PRINCIPLED":
                node.inputs["Base Color"].default_value = (0, 0, 0, 1)
        studio.mesh.material_slots[0].material = material
        pictures.append(studio.render("cycles", 1)[1])
    bpy.data.objects.remove(studio.mesh)
    return pictures[0], pictures[1]


def vertex_material(studio: Studio, table):
    """A material that shows the radiance computed at the faces' corners, with the normals and tangents there."""
    import bpy

    mesh = studio.mesh.data
    mesh.calc_tangents()
    corners = len(mesh.loops)
    n, t = np.empty((2, corners * 3), np.float32)
    mesh.loops.foreach_get("normal", n)
    mesh.loops.foreach_get("tangent", t)
    vertex = np.empty(corners, np.int32)
    mesh.loops.foreach_get("vertex_index", vertex)
    place = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", place)
    n, t, p = (a.astype(float).reshape(-1, 3) for a in (n, t, place.reshape(-1, 3)[vertex]))
    t -= n * (n * t).sum(axis=1, keepdims=True)
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    frame = np.stack([t, np.cross(n, t), n], axis=1)
    bpy.context.view_layer.update()
    lamp = next(o for o in bpy.data.objects if o.type == "LIGHT")
    wi = frame @ np.array(lamp.matrix_world.col[2][:3])
    to_camera = np.array(_CAMERA) - p
    wr = np.einsum("nij,nj->ni", frame, to_camera / np.linalg.norm(to_camera, axis=1, keepdims=True))
    irradiance = np.broadcast_to(lamp.data.energy * np.array(lamp.data.color), wi.shape)
    radiance = np.ones((corners, 4), np.float32)
    radiance[:, :3] = lamp_radiance(table, wi, wr, irradiance=irradiance, variance=np.tan(lamp.data.angle / 2) ** 2 / 4)
    mesh.color_attributes.new("radiance", "FLOAT_COLOR", "CORNER").data.foreach_set("color", radiance.ravel())

    material = bpy.data.materials.new("Vertices")
    studio.addon.compat.enable_nodes(material)
    material.node_tree.nodes.clear()
    tree = studio.addon.builder.Tree(material.node_tree)
    shown, _ = tree.attribute("radiance", "GEOMETRY")
    tree.node("ShaderNodeOutputMaterial", tree.emission(shown, 1.0))
    return material


def relative_error(found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Relative error of luminance, at the pixels whose true luminance is above 1 % of the brightest."""
    found, truth = (picture @ (0.2126, 0.7152, 0.0722) for picture in (found, truth))
    counted = truth > 0.01 * np.percentile(truth[truth > 0], 99.9)
    return np.abs(found - truth)[counted] / truth[counted]


def save(picture: np.ndarray, path: Path) -> None:
    """Save a picture as displayed, exposed so that the brightest thousandth of its pixels clips."""
    from PIL import Image

    shown = np.clip(picture / np.percentile(picture, 99.9), 0, 1)
    shown = np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * shown ** (1 / 2.4) - 0.055)
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.rint(shown * 255).astype(np.uint8)).save(path, optimize=True)

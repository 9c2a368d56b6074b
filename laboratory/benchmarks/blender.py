# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender with this tree's add-on, for benchmarks and tests: its start, a plane under a camera, colour differences of
pictures, and the materials of the OSL shaders."""

import math
import os
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from devtools import EXTENSION
from devtools.extension import AddonModules, link_extension
from precompute.bake.needs import Needs
from precompute.colour.observer import white_xyz
from precompute.colour.spaces import delta_e_2000, lab, rgb_from_xyz, shown_rgb
from precompute.measure.errors import COUNTED_Y
from precompute.methods import dft_images
from precompute.methods.method_registry import METHODS
from precompute.optics.brdf import KERATIN_IOR, scattering_factor
from precompute.optics.region import Region
from precompute.surface.relief import Relief
from precompute.table.atlas import read_header, write_together

_WIDTH_MIN = 0.02


@dataclass(frozen=True)
class PlaneView:
    """A square picture of a plane at z = 0 from one metre above, its T turned by `turn` from +x towards +y, light from
    `to_light` in the world."""

    pixels: int
    field: float
    to_light: np.ndarray
    turn: float = 0.0

    @property
    def frame(self) -> np.ndarray:
        """T, B, N (3, 3) in the world."""
        c, s = math.cos(self.turn), math.sin(self.turn)
        return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])

    def directions(self) -> tuple[np.ndarray, np.ndarray]:
        """wi (3,) and wr (pixels^2, 3) in the plane's frame, row 0 at the top."""
        x = ((np.arange(self.pixels) + 0.5) / self.pixels * 2 - 1) * math.tan(self.field / 2)
        px, py = np.meshgrid(x, -x)
        wr = np.stack([-px, -py, np.ones_like(px)], axis=-1).reshape(-1, 3)
        return self.frame @ self.to_light, wr / np.linalg.norm(wr, axis=-1, keepdims=True) @ self.frame.T

    def radiance(self, xyz_over_w2, ior: float = KERATIN_IOR) -> np.ndarray:
        """Linear Rec.709 (pixels, pixels, 3) under unit irradiance of a response xyz_over_w2(u, v, w) (n, 3), in Stam's
        form (brdf_map.from_method)."""
        wi, wr = self.directions()
        gain = scattering_factor(wi, wr, ior, stam=True)
        rgb = shown_rgb(xyz_over_w2(*(wi + wr).T), rgb_from_xyz("Rec.709"))
        return (gain[:, None] * rgb).reshape(self.pixels, self.pixels, 3)


def render(addon, group, view: PlaneView, path: Path, irradiance=(1.0, 1.0, 1.0), ior=KERATIN_IOR) -> np.ndarray:
    """Render a Diffraction group on the plane under a sun in Cycles: linear RGB (pixels, pixels, 3), row 0 at the
    top."""
    import bpy
    import OpenEXR
    from mathutils import Vector

    scene, data = bpy.context.scene, bpy.data
    data.batch_remove([*data.objects, *data.meshes, *data.cameras, *data.lights, *data.materials])
    bpy.ops.mesh.primitive_plane_add(size=4)
    bpy.context.object.data.materials.append(_material(group, view, ior))
    camera = data.objects.new("Camera", data.cameras.new("Camera"))
    camera.data.angle, camera.location = view.field, (0, 0, 1)
    scene.collection.objects.link(camera)
    scene.camera, scene.world = camera, None
    lamp = data.lights.new("Sun", "SUN")
    lamp.angle, lamp.energy, lamp.color = 0.0, max(irradiance), np.array(irradiance) / max(irradiance)
    sun = data.objects.new("Sun", lamp)
    sun.rotation_euler = Vector(view.to_light).to_track_quat("Z", "Y").to_euler()
    scene.collection.objects.link(sun)
    addon.follow.follow_lamps(scene)
    addon.skin.show_lamps(exactly=True)
    scene.cycles.samples = 1
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.render.resolution_x = scene.render.resolution_y = view.pixels
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        names = {name.rpartition(".")[2]: name for name in channels}
        return np.stack([channels[names[c]].pixels for c in "RGB"], axis=-1).astype(float)


def _material(group, view: PlaneView, ior: float):
    """The Diffraction group over nothing, in the view's frame."""
    import bpy

    material = bpy.data.materials.new("plane")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    diffraction = nodes.new("ShaderNodeGroup")
    diffraction.node_tree = group
    t, _, n = view.frame
    for name, value in {"Normal": n, "Tangent": t, "IOR": ior}.items():
        diffraction.inputs[name].default_value = value
    links.new(diffraction.outputs["Shader"], nodes.new("ShaderNodeOutputMaterial").inputs[0])
    return material


def direct_shader_response(addon: SimpleNamespace, bake: Path):
    """The response of a bake's file, read by the shader that evaluates Direct's formula."""
    layout, _ = read_header(bake)
    return addon.osl_bake.build_osl_direct(bake.stem, bake, layout, rgb_from_xyz=rgb_from_xyz("Rec.709"))


def thesis_response(addon: SimpleNamespace, name: str, relief: Relief, settings: dft_images.Settings, *, path: Path):
    """The response by one of the thesis's methods, whose images are written to a path."""
    write_together({path: dft_images.pack(METHODS[name](relief, settings))}, {})
    return addon.thesis_methods.build_osl_response(path.stem, path, rgb_from_xyz("Rec.709"))


def set_up_cycles() -> None:
    """The scene rendered by Cycles with Open Shading Language."""
    import bpy

    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.shading_system = True


def start_blender(folder: Path) -> SimpleNamespace:
    """The add-on's modules, of this tree as Blender loads it, its settings in `folder`."""
    os.environ["BLENDER_USER_RESOURCES"] = str(folder)
    link_extension(folder)
    from devtools.blender_shim import show_hidden_packages

    show_hidden_packages()
    import addon_utils

    module = addon_utils.enable(EXTENSION, default_set=True)
    set_up_cycles()
    modules = AddonModules(module.__name__)
    modules.mesa.filter_as_cards_do()
    return modules


def needs_of(view: PlaneView) -> Needs:
    """The needs of a picture: the region of (u, v) and w that it reaches, with a margin of 0.01."""
    wi, wr = view.directions()
    half = wi + wr
    low, high = half.min(axis=0) - 0.01, half.max(axis=0) + 0.01
    low[2], high[2] = min(low[2], 2 - _WIDTH_MIN), min(high[2], 2.0)
    u, v, w = ((float(a), float(b)) for a, b in zip(low, high, strict=True))
    return Needs(Region(u, v), w)


def colour_differences(picture: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """CIEDE2000 (n,) over the pixels lit in either of two pictures (..., 3) of linear Rec.709."""
    to_xyz = np.linalg.inv(rgb_from_xyz("Rec.709")).T
    xyz, expected = picture.reshape(-1, 3) @ to_xyz, truth.reshape(-1, 3) @ to_xyz
    level = np.percentile(expected[:, 1], 99)
    xyz, expected = xyz / level, expected / level
    low, high = COUNTED_Y
    lit = ((xyz[:, 1] >= low) | (expected[:, 1] >= low)) & (expected[:, 1] <= high)
    return delta_e_2000(lab(xyz[lit], white_xyz()), lab(expected[lit], white_xyz()))


def view_of(pixels: int, field_deg: float, light_uv: tuple[float, float]) -> PlaneView:
    """A picture with light whose tangential components along T and B are light_uv, the plane's frame turned."""
    turn = math.radians(10)
    x, y = light_uv
    along = np.array([x, y, math.sqrt(1 - x**2 - y**2)])
    view = PlaneView(pixels, math.radians(field_deg), along, turn)
    return replace(view, to_light=view.frame.T @ along)

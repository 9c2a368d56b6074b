# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour differences between the thesis's methods in OSL and the node group of the patch model's bake, both rendered by
Cycles.

    ./dev bench osl [--pixels N] [--shared DIR] [--json FILE|-]

The scene is a plane one metre under the camera and one sun, with one sample in each pixel. The node group's picture is
compared with its table as precompute reads it, and each shader's picture with the node group's picture. CIEDE2000 is
taken over the lit pixels, at the exposure that puts the 99th percentile of the second picture's Y at 1.
"""

import math
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from devtools import EXTENSION, ROOT
from devtools.extension import AddonModules, link_extension
from precompute.bake.make import Made, make
from precompute.bake.needs import Needs
from precompute.bake.request import BakeRequest
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.colour.observer import white_xyz
from precompute.colour.spaces import delta_e_2000, lab, rgb_from_xyz, shown_rgb
from precompute.measure.errors import COUNTED_Y
from precompute.methods import dft_images
from precompute.methods.method_registry import METHODS
from precompute.optics.brdf import KERATIN_IOR, scattering_factor
from precompute.optics.region import Region
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import Relief, prepare
from precompute.table.atlas import read_header, write_together

from . import report

_WIDTH_MIN = 0.02
# Method, wavelength step in nm, texels along each axis. FLSS has the thesis's settings first and finer ones after them.
RUNS = (
    ("flss", 5.0, 3),
    ("flss", 5.0, 5),
    ("flss", 2.5, 5),
    ("nmm", 5.0, 3),
    ("nmm-jacobian", 5.0, 3),
    ("pq", 5.0, 3),
)


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

    def stam_over_material(self) -> np.ndarray:
        """Stam's form over the materials' form, of keratin (pixels, pixels, 1)."""
        wi, wr = self.directions()
        ratio = scattering_factor(wi, wr, stam=True) / scattering_factor(wi, wr)
        return ratio.reshape(self.pixels, self.pixels, 1)


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


def compare(addon, relief: Relief, made: Made, view: PlaneView, folder: Path, runs=RUNS) -> Iterator[dict]:
    """A row for the node group and for each run: its settings, terms and colour differences.

    The shaders have Stam's form, so the node group's picture is multiplied by stam_over_material."""
    software = view.radiance(made.table.scattered_over_w2)
    path = folder / "table.exr"
    write_together({path: (made.image, made.layout)}, {"precision": str(made.image.dtype)})
    group = addon.making_materials.new_diffraction_group(path, shadows=False, lights="LAMPS")
    truth = render(addon, group, view, folder / "picture.exr") * view.stam_over_material()
    yield _row("node group", made.layout.terms, colour_differences(truth, software))
    for name, step_nm, texels in runs:
        method = METHODS[name](relief, dft_images.settings_for(step_m=step_nm * 1e-9, texels=texels))
        path = folder / f"{name}_{step_nm}_{texels}.exr"
        image, layout = dft_images.pack(method)
        write_together({path: (image, layout)}, {})
        response = addon.thesis_methods.build_osl_response(path.stem, path, rgb_from_xyz("Rec.709"))
        group = addon.skin.group_around(path.stem, response, shadows=False)
        picture = render(addon, group, view, folder / "picture.exr")
        path.unlink()
        yield _row(f"{name}, {step_nm:g} nm, {texels} texels", layout.terms, colour_differences(picture, truth))


def _row(how: str, terms: int, differences: np.ndarray) -> dict:
    percentiles = {f"p{p}": float(np.percentile(differences, p)) for p in (50, 95, 99)}
    return {"how": how, "terms": terms, "lit": len(differences), **percentiles}


def as_text(row: dict) -> str:
    """A row of compare, for people."""
    figures = ", ".join(f"p{p} {row[f'p{p}']:.2f}" for p in (50, 95, 99))
    return f"{row['how']:<31} {row['terms']:>2} terms: dE00 {figures} of {row['lit']} lit"


def view_of(pixels: int, field_deg: float, light_uv: tuple[float, float]) -> PlaneView:
    """A picture with light whose tangential components along T and B are light_uv, the plane's frame turned."""
    turn = math.radians(10)
    x, y = light_uv
    along = np.array([x, y, math.sqrt(1 - x**2 - y**2)])
    view = PlaneView(pixels, math.radians(field_deg), along, turn)
    return replace(view, to_light=view.frame.T @ along)


def main(argv: list[str] | None = None) -> None:
    """Print a table for the blaze, and for the Elaphe scan where it is there."""
    parser = OneLineParser(prog="./dev bench osl", description="OSL against the patch's bake.")
    parser.add_argument("--pixels", type=count(4, 8192), default=48, metavar="N", help="a side; default 48")
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared" / "data", metavar="DIR")
    parser.add_argument("--only", metavar="NAME", help="one of the surfaces")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    scan = arguments.shared / "snake" / "elaphe_65um.png"
    surfaces = {"blazed": ("sample:blazed", None, None), "elaphe": (str(scan), 65.0, 375.0)}
    # The blaze lights one line of the hemisphere, as wide as its coherence: its first order, seen from near. The scan
    # lights all of it.
    views = {
        "blazed": view_of(arguments.pixels, 12, (-0.22, 0.0)),
        "elaphe": view_of(arguments.pixels, 50, (0.1, -0.05)),
    }
    if not scan.is_file():
        del surfaces["elaphe"]
    facts = {}
    with tempfile.TemporaryDirectory() as folder:
        addon = start_blender(Path(folder))
        for surface, source in surfaces.items():
            if arguments.only not in (None, surface):
                continue
            relief, view = prepare(read_height_map(*source)), views[surface]
            made = make([relief], BakeRequest(delta_e=0.5, needs=needs_of(view), model="patch"))
            one = facts[surface] = {
                "tile": made.table.tile,
                "terms": made.layout.terms,
                "p99": made.errors.p99,
                "rows": [],
            }
            head = f"{surface}: bake of {one['tile']}, {one['terms']} terms, dE00 p99 {one['p99']:.2f}"
            report.say(head, arguments.json)
            for row in compare(addon, relief, made, view, Path(folder)):
                one["rows"].append(row)
                report.say(as_text(row), arguments.json)
    report.write(facts, arguments.json)


if __name__ == "__main__":
    main()

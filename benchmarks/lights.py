# SPDX-License-Identifier: GPL-3.0-or-later
"""Light of every kind: a white furnace, and noise at equal time beside an ordinary coat.

    python -m benchmarks lights [--part furnace --part noise] [--pixels 192] [--json FILE|-]

**Furnace**: a plane in a white world shows the directional albedo of its relief. What Cycles shows is divided by the
integral of the bake's own table over the hemisphere. Of the surfaces, the real scans are left out where their files are
not there.

**Noise**: the sample snake on its ground under worlds, as an artist renders it, with each choice of lights and, for
comparison, with an ordinary Principled coat of IOR 1.56 and roughness 0.3 over the same skin. The figure is the RMSE of
the whole picture against the material's own picture of many samples, times the square root of the processor time: what
is left of the noise at equal time. Samples are clipped at a display's white. `seconds` is the processor time of a
sample of a pixel, in microseconds.
"""

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks import report
from precompute.bake.output import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.cli.option_types import count
from precompute.cli.parser import OneLineParser
from precompute.lights.panorama import panorama_cells
from precompute.optics.fresnel import KERATIN_IOR
from precompute.surface.readers.registry import read_height_map
from precompute.table import atlas_file
from precompute.table.radiance import directional_albedo

from .render_time import Studio

PARTS = ("furnace", "noise")
ANGLES_DEG = (0, 30, 60, 75, 80, 85)
# File, height in nanometres from black to white; 65 um wide.
_SCANS = (("elaphe_65um.png", 375), ("xenopeltis_65um.png", 818.69))
_FOLDER = Path(__file__).resolve().parents[2] / "shared" / "data" / "snake"
# Pixels and samples of a furnace. A sample deviates by 0.5 of the mean at most, and the mean of all by a thousandth.
_FURNACE_PIXELS, _FURNACE_SAMPLES = 64, 64
_SAMPLES, _TRUTH_SAMPLES = 64, 512
WORLDS = ("clear sky", "overcast sky", "studio")
MATERIALS = ("coat", "LAMPS", "REST", "ALL")


def main(argv: list[str] | None = None) -> int:
    """Print the tables; the exit status."""
    parser = OneLineParser(prog="benchmarks lights", description=__doc__.splitlines()[0])
    parser.add_argument("--part", action="append", choices=PARTS)
    parser.add_argument("--pixels", type=count(4, 8192), default=192)
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    facts = {}
    with tempfile.TemporaryDirectory() as folder:
        studio = Worlds(Path(folder), arguments.pixels)
        for part in arguments.part or PARTS:
            facts[part] = {"furnace": furnace, "noise": noise}[part](studio, arguments)
    report.write(facts, arguments.json)
    return 0


def furnace(studio: "Worlds", arguments: argparse.Namespace) -> list[dict]:
    """A row for each surface, choice of lights and angle: the render over the directional albedo, in linear RGB."""
    rows = []
    report.say(f"{'surface':24}{'lights':>7}{'angle':>7}   render / albedo in R, G, B", arguments.json)
    for name, bake in studio.bakes():
        table = atlas_file.read(bake)[0]
        albedo = {angle: directional_albedo(table, np.radians(angle)) for angle in ANGLES_DEG}
        for lights in ("REST", "ALL"):
            for angle in ANGLES_DEG:
                found = studio.furnace(bake, lights, np.radians(angle))
                rows.append(
                    {
                        "surface": name,
                        "lights": lights,
                        "angle_deg": angle,
                        "albedo": albedo[angle].tolist(),
                        "ratio": (found / albedo[angle]).tolist(),
                    }
                )
                ratio = " ".join(f"{each:.4f}" for each in rows[-1]["ratio"])
                report.say(f"{name:24}{lights:>7}{angle:7}   {ratio}", arguments.json)
    return rows


def noise(studio: "Worlds", arguments: argparse.Namespace) -> list[dict]:
    """A row for each world and material."""
    rows = []
    report.say(f"{'world':14}{'material':>9}{'us':>8}{'RMSE':>9}{'at equal time, to coat':>24}", arguments.json)
    for world in WORLDS:
        studio.light_by(world)
        coat = None
        for material in MATERIALS:
            studio.dress(material)
            seconds, rmse, mean = studio.noise()
            figure = rmse * seconds**0.5
            coat = figure if coat is None else coat
            each = 1e6 * seconds / (_SAMPLES * studio.pixels**2)
            rows.append(
                {
                    "world": world,
                    "material": material,
                    "us": each,
                    "rmse": rmse,
                    "mean": mean,
                    "to_coat": figure / coat,
                    "sources": studio.addon.sky.source_count(studio.scene),
                }
            )
            report.say(f"{world:14}{material:>9}{each:8.2f}{rmse:9.5f}{figure / coat:24.2f}", arguments.json)
    return rows


class Worlds(Studio):
    """The studio, lit by worlds."""

    def bakes(self) -> Iterator[tuple[str, Path]]:
        """The name and the bake's file of each surface."""
        yield "sample:elaphe", self.bake
        for name, height_nm in _SCANS:
            if (_FOLDER / name).is_file():
                folder = self.folder / Path(name).stem
                folder.mkdir()
                scan = read_height_map(str(_FOLDER / name), 65, height_nm)
                facts = bake_to_folder([scan], BakeRequest(), folder, progress=lambda *_: None)
                yield name, Path(facts["files"][0])

    def material(self, bake: Path, lights: str):
        """A new diffraction material of a bake, and its skin's node."""
        group = self.addon.grating_material.new_diffraction_group(bake, False, lights)
        made = self.addon.material.new_diffraction_material("lit", group)
        return made, next(node for node in made.node_tree.nodes if node.label == "Skin")

    def furnace(self, bake: Path, lights: str, theta: float) -> np.ndarray:
        """The mean radiance (3,) of a plane over black in a white world, seen at an angle."""
        import bpy

        self.build("sphere")
        bpy.data.objects.remove(self.mesh)
        bpy.ops.mesh.primitive_plane_add(size=20)
        material, skin = self.material(bake, lights)
        skin.inputs["Base Color"].default_value = (0, 0, 0, 1)
        bpy.context.object.data.materials.append(material)
        self.world()[1].inputs["Color"].default_value = (1, 1, 1, 1)
        camera = self.scene.camera
        camera.data.ortho_scale = 0.1
        camera.location = (2 * np.sin(theta), 0, 2 * np.cos(theta))
        camera.rotation_euler = (0, theta, 0)
        return self.render("cycles", _FURNACE_SAMPLES, _FURNACE_PIXELS)[1].mean(axis=(0, 1))

    def light_by(self, world: str) -> None:
        """Make the snake's scene, under one of WORLDS."""
        from sample_scenes import stage

        self.build("snake")
        self.scene.cycles.sample_clamp_direct = self.scene.cycles.sample_clamp_indirect = 1.0
        if world == "clear sky":
            stage.light_by_sky(self.scene, stage.SUN_AZIMUTH_DEG, stage.SUN_ELEVATION_DEG)
            return
        cells = panorama_cells(128, 256)
        height = cells.directions[:, 2]
        radiance = 0.3 * np.where(height > 0, (1 + 2 * height) / 3, 0.1)  # CIE's overcast sky
        if world == "studio":
            radiance *= 0.2
            for towards, radius_deg in (((0.6, -0.4, 0.7), 9), ((-0.7, 0.2, 0.7), 5)):
                cosine = cells.directions @ (np.array(towards) / np.linalg.norm(towards))
                radiance[cosine > np.cos(np.radians(radius_deg))] = 12
        self.paint(radiance.reshape(128, 256))

    def paint(self, radiance: np.ndarray) -> None:
        """A world of this radiance (rows, cols), white."""
        import bpy

        rows, cols = radiance.shape
        image = bpy.data.images.new("World", cols, rows, float_buffer=True, is_data=True)
        pixels = np.ones((rows, cols, 4), np.float32)
        pixels[..., :3] = radiance[..., None]
        image.pixels.foreach_set(pixels.ravel())
        image.pack()
        tree, background = self.world()
        node = tree.nodes.new("ShaderNodeTexEnvironment")
        node.image = image
        tree.links.new(node.outputs["Color"], background.inputs["Color"])

    def world(self):
        """A new world: its nodes, and its Background among them."""
        import bpy

        self.scene.world = bpy.data.worlds.new("World")
        self.addon.compat.enable_nodes(self.scene.world)
        tree = self.scene.world.node_tree
        return tree, next(node for node in tree.nodes if node.type == "BACKGROUND")

    def dress(self, name: str) -> None:
        """Give the snake a material: an ordinary coat, or diffraction with a choice of lights."""
        lights = "LAMPS" if name == "coat" else name
        material, skin = self.material(self.bake, lights)
        if name == "coat":
            skin.inputs["Coat Weight"].default_value = 1.0
            skin.inputs["Coat Roughness"].default_value = 0.3
            skin.inputs["Coat IOR"].default_value = KERATIN_IOR
            output = next(node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL")
            material.node_tree.links.new(skin.outputs[0], output.inputs["Surface"])
        self.mesh.material_slots[0].material = material
        self.scene.cycles.shading_system = False
        self.addon.fit_world.fit_world(self.scene)

    def noise(self) -> tuple[float, float, float]:
        """Processor seconds of a picture, its RMSE against one of many samples, and the mean of that."""
        truth = self.render("cycles", _TRUTH_SAMPLES)[1]
        start = self.render("cycles", 1)[0]
        seconds, picture = self.render("cycles", _SAMPLES + 1)
        return seconds - start, float(np.sqrt(np.mean((picture - truth) ** 2))), float(truth.mean())

# SPDX-License-Identifier: GPL-3.0-or-later
"""Render time of Direct and of a Principled metal with one and three lamps, and of the thesis's methods in OSL.

    ./dev bench render_time [--engine cycles --engine eevee] [--scene snake --scene sphere] [--pixels 192]
        [--json FILE|-]

All rows are measured in one run. The cost of a sample of a pixel, in processor time, is the difference of two minima
over `--repeat` renders: with `--samples` samples and with a quarter of them. The difference leaves out start-up,
compiling and upload. The materials are rendered in turn, so that a temporary slowdown of the machine affects all of
them. There are two scenes: the sample snake on its ground, as an artist renders it, and a sphere alone in the dark,
where only the material takes time. OSL shaders are timed on the sphere, in a small picture.

For Cycles the noise is measured too: the RMSE against each material's own picture of many samples, with every sample
clipped at display white, and the number of samples at which Direct has the metal's RMSE.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Self

import numpy as np

from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.methods import dft_images
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare
from precompute.table.atlas import read_header

from . import report
from .osl import direct_shader_response, start_blender, thesis_response

_REFERENCE_SAMPLES = 512
_SURFACE = "sample:elaphe"
# The thesis's settings.
_STEP_M, _TEXELS, _OSL_PIXELS = 5e-9, 3, 16
_TURNS_DEG = (0, 90, 200, 20, 110, 220, 40, 130, *range(5, 365, 15))


@dataclass(frozen=True)
class Subject:
    """A row of the table: a material, the number of suns that light it, and whether OSL is on.

    `pixels` is the side of the picture if the row has its own size."""

    name: str
    make: Callable
    lamps: int = 1
    osl: bool = False
    pixels: int | None = None


def main(argv: list[str] | None = None) -> int:
    """Print the tables and return the exit status."""
    parser = OneLineParser(prog="./dev bench render_time", description=__doc__.splitlines()[0])
    parser.add_argument("--engine", action="append", choices=("cycles", "eevee"))
    parser.add_argument("--scene", action="append", choices=("snake", "sphere"))
    parser.add_argument("--pixels", type=count(4, 8192), default=192)
    parser.add_argument("--samples", type=count(4, 1 << 20), default=32)
    parser.add_argument("--repeat", type=count(1, 1000), default=5)
    parser.add_argument("--lamps", type=count(1, 32), default=3, help="suns in the rows with several; 1: no such row")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    tables = []
    with tempfile.TemporaryDirectory() as folder:
        studio = Studio.started(Path(folder), arguments.pixels)
        for engine in arguments.engine or ("cycles", "eevee"):
            for scene in arguments.scene or ("snake", "sphere"):
                studio.build(scene)
                tables.append(measure(studio, engine, scene, arguments))
    report.write({"tables": tables}, arguments.json)
    return 0


def measure(studio: "Studio", engine: str, scene: str, arguments) -> dict:
    """Measure and print the tables of one engine and one scene."""
    import bpy

    facts = {"engine": engine, "scene": scene, "blender": bpy.app.version_string, "pixels": studio.pixels, "rows": []}
    report.say(f"\n{engine}, {scene}, Blender {facts['blender']}, {studio.pixels}^2 pixels", arguments.json)
    report.say(f"{'material':34}{'us/sample':>11}{'to metal':>10}", arguments.json)
    subjects = studio.subjects(engine, scene, arguments.lamps)
    rounds = []
    for _ in range(arguments.repeat):
        rounds.append([])
        for subject in subjects:
            studio.show(subject)
            rounds[-1].append(studio.spans(subject, engine, arguments.samples))
    metal = {}
    for subject, (fewer, more) in zip(subjects, np.min(rounds, axis=0), strict=True):
        cost = float(1e6 * (more - fewer))
        metal.setdefault(subject.lamps, cost)
        facts["rows"].append({"material": subject.name, "us": cost, "to_metal": cost / metal[subject.lamps]})
        report.say(f"{subject.name:34}{cost:11.3f}{cost / metal[subject.lamps]:10.2f}", arguments.json)
    if engine == "cycles":
        facts["equal_error"] = equal_error(studio, scene, arguments)
    return facts


def equal_error(studio: "Studio", scene: str, arguments: argparse.Namespace) -> dict:
    """Measure the noise: the RMSE relative to the picture's mean at several numbers of samples.

    The result also holds the number of samples at which Direct has the RMSE of the metal at the largest number. Noise
    falls with the square root of the number of samples."""
    counts = (4, 16, 64)
    facts = {"samples": counts, "rmse": {}}
    report.say(f"{'RMSE over the mean, at samples':34}" + "".join(f"{count:10}" for count in counts), arguments.json)
    cycles = studio.scene.cycles
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 1.0
    for subject in studio.subjects("cycles", scene, arguments.lamps)[:2]:
        studio.show(subject)
        truth = studio.render("cycles", _REFERENCE_SAMPLES)[1]
        pictures = [studio.render("cycles", count)[1] for count in counts]
        errors = [float(np.sqrt(np.mean((picture - truth) ** 2)) / truth.mean()) for picture in pictures]
        facts["rmse"][subject.name] = errors
        report.say(f"{subject.name:34}" + "".join(f"{error:10.4f}" for error in errors), arguments.json)
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    metal, direct = (errors[-1] for errors in facts["rmse"].values())
    facts["direct_samples"] = counts[-1] * (direct / metal) ** 2
    report.say(
        f"for the metal's RMSE at {counts[-1]} samples Direct takes {facts['direct_samples']:.0f}", arguments.json
    )
    return facts


class Studio:
    """A scene of one mesh under suns, its materials, and a clock."""

    def __init__(self, addon: SimpleNamespace, folder: Path, pixels: int, bake: Path):
        self.addon, self.folder, self.pixels, self.bake = addon, folder, pixels, bake

    @classmethod
    def started(cls, folder: Path, pixels: int) -> Self:
        """Start with the add-on of this tree and a bake of the Elaphe sample in a folder."""
        addon = start_blender(folder)
        facts = bake_to_folder([read_height_map(_SURFACE)], BakeRequest(), folder)
        return cls(addon, folder, pixels, Path(facts["files"][0]))

    def build(self, scene: str) -> None:
        """Build one of the two scenes; its mesh has no material."""
        import bpy

        from sample_scenes import stage
        from sample_scenes.snake import build_snake

        self.scene = bpy.context.scene
        stage.clean_scene()
        stage.render_settings(self.scene)
        if scene == "snake":
            self.mesh = build_snake()
            stage.add_ground(self.scene)
            stage.add_camera(self.scene)
            stage.dim_world(self.scene)
        else:
            bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64)
            bpy.ops.object.shade_smooth()
            self.mesh = bpy.context.object
            self.mesh.data.materials.append(None)
            camera = stage.add_camera(self.scene)
            camera.data.type, camera.data.ortho_scale = "ORTHO", 2.1
            camera.location, camera.rotation_euler = (0, 0, 3), (0, 0, 0)
            self.scene.world = None
        self.scene.cycles.use_denoising = self.scene.cycles.use_adaptive_sampling = False
        image = self.scene.render.image_settings
        image.file_format, image.color_depth = "OPEN_EXR", "32"

    def light(self, count: int) -> None:
        """Light the scene with a number of suns, which the add-on follows."""
        import bpy

        from sample_scenes import stage

        bpy.data.batch_remove([o for o in bpy.data.objects if o.type == "LIGHT"])
        for turn in _TURNS_DEG[:count]:
            stage.add_sun(self.scene, stage.SUN_AZIMUTH_DEG + turn, stage.SUN_ELEVATION_DEG)
        self.addon.follow.follow_lamps(self.scene)

    def show(self, subject: Subject) -> None:
        """Light the mesh and give it the subject's material."""
        self.light(subject.lamps)
        # A shader compiles once its renderer is chosen.
        self.scene.render.engine = "CYCLES"
        self.scene.cycles.shading_system = subject.osl
        self.mesh.material_slots[0].material = subject.make()

    def subjects(self, engine: str, scene: str, lamps: int) -> list[Subject]:
        """The rows of a table."""
        found = [
            Subject("Principled metal, 1 sun", self.metal),
            Subject("Direct, 1 sun", self.direct),
            Subject("Direct, 1 sun, footprint", lambda: self.direct(footprint=True)),
            Subject("Direct, 1 sun, shadow rays", lambda: self.direct(shadows=True)),
        ]
        if lamps > 1:
            found += [
                Subject(f"Principled metal, {lamps} suns", self.metal, lamps),
                Subject(f"Direct, {lamps} suns", self.direct, lamps),
                Subject(f"Direct, {lamps} suns, footprint", lambda: self.direct(footprint=True), lamps),
            ]
        if engine == "cycles" and scene == "sphere":
            found += [
                Subject("Principled metal, OSL on", self.metal, osl=True),
                Subject("Direct, 1 sun, OSL on", self.direct, osl=True),
                Subject("OSL DIRECT, 1 sun", self.direct_shader, osl=True),
                *(
                    Subject(f"OSL {name.upper()}, 1 sun", lambda name=name: self.thesis(name), 1, True, _OSL_PIXELS)
                    for name in ("flss", "nmm", "pq")
                ),
            ]
        return found

    def metal(self):
        """A Principled metal as rough as the kernel is wide at normal incidence: alpha is sigma_b over sqrt(2)."""
        import bpy

        sigma_b = read_header(self.bake)[0].sigma_b
        material = bpy.data.materials.new("Metal")
        self.addon.compat.enable_nodes(material)
        principled = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
        principled.inputs["Metallic"].default_value = 1.0
        principled.inputs["Roughness"].default_value = (sigma_b / 2**0.5) ** 0.5
        return material

    def direct(self, shadows: bool = False, lights: str = "LAMPS", footprint: bool = False, every_lamp: bool = False):
        """The add-on's own material."""
        group = self.addon.making_materials.new_diffraction_group(self.bake, shadows, lights)
        self.addon.skin.set_up(group, footprint=footprint, every_lamp=every_lamp)
        return self.addon.material.new_diffraction_material("timed", group)

    def direct_shader(self):
        """The add-on's own table, read by an OSL shader."""
        response = direct_shader_response(self.addon, self.bake)
        group = self.addon.skin.group_around("timed", response, shadows=False)
        return self.addon.material.new_diffraction_material("timed", group)

    def thesis(self, name: str):
        """One of the thesis's algorithms in every pixel."""
        settings = dft_images.settings_for(step_m=_STEP_M, texels=_TEXELS)
        relief, path = prepare(read_height_map(_SURFACE)), self.folder / f"{name}.exr"
        response = thesis_response(self.addon, name, relief, settings, path=path)
        group = self.addon.skin.group_around(name, response, shadows=False)
        return self.addon.material.new_diffraction_material(name, group)

    def spans(self, subject: Subject, engine: str, samples: int) -> tuple[float, float]:
        """Processor seconds with a quarter of the samples, and with all of them, each divided by the number of pixels
        and by the difference of the two numbers of samples. A first picture is rendered without being timed."""
        pixels = subject.pixels or self.pixels
        more = 4 if subject.pixels else samples
        fewer = more // 4
        self.render(engine, 1, pixels)
        seconds = (self.render(engine, count, pixels)[0] for count in (fewer, more))
        return tuple(each / (pixels**2 * (more - fewer)) for each in seconds)

    def costs(self, subjects: list[Subject], samples: int, repeat: int) -> np.ndarray:
        """Processor seconds of a sample of a pixel in Cycles for each subject, rendered in turn."""
        least = np.full((len(subjects), 2), np.inf)
        for _ in range(repeat):
            for row, subject in zip(least, subjects, strict=True):
                self.show(subject)
                row[:] = np.minimum(row, self.spans(subject, "cycles", samples))
        return least[:, 1] - least[:, 0]

    def render(
        self, engine: str, samples: int, pixels: int | tuple[int, int] | None = None
    ) -> tuple[float, np.ndarray]:
        """Render; returns the processor seconds and the linear picture (rows, columns, 3), row 0 at the top.

        `pixels` is the side of a square picture, or rows and columns."""
        import bpy
        import OpenEXR

        scene = self.scene
        scene.render.engine = "CYCLES" if engine == "cycles" else self.addon.compat.eevee_engine()
        scene.cycles.samples = scene.eevee.taa_render_samples = samples
        rows, columns = pixels if isinstance(pixels, tuple) else (pixels or self.pixels,) * 2
        scene.render.resolution_y, scene.render.resolution_x = rows, columns
        path = self.folder / "timed.exr"
        scene.render.filepath = str(path)
        start = time.process_time()
        bpy.ops.render.render(write_still=True)
        seconds = time.process_time() - start
        with OpenEXR.File(str(path)) as file:
            rendered = next(iter(file.channels().values())).pixels
        return seconds, np.asarray(rendered[..., :3], float)

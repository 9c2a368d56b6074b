# SPDX-License-Identifier: GPL-3.0-or-later
"""Render seconds of a sphere: Principled metal against Direct with one and three lamps (OSL: benchmarks/osl.py).

    python -m benchmarks render_time [--pixels 256 --samples 16 --repeat 3] [--engine cycles --engine eevee]

All in one run, the least of `repeat` renders each, the first one (compiling, uploading) not counted; and the samples at
which Direct is as near its own picture of many samples (RMSE) as the metal is to its own at `samples`.
"""

import argparse
import importlib
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from devtools import EXTENSION
from devtools.extension import link_extension
from precompute.baking import Order, bake_to_folder
from precompute.readers import read_height_map

_REFERENCE_SAMPLES = 256


def main(argv: list[str] | None = None) -> int:
    """Print the tables; the exit status."""
    parser = argparse.ArgumentParser(prog="benchmarks render_time", description=__doc__.splitlines()[0])
    parser.add_argument("--pixels", type=int, default=256)
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--engine", action="append", choices=("cycles", "eevee"))
    arguments = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        stage = TimedStage(Path(folder), arguments.pixels)
        for engine in arguments.engine or ("cycles", "eevee"):
            measure(stage, engine, arguments.samples, arguments.repeat)
    return 0


def measure(stage: "TimedStage", engine: str, samples: int, repeat: int) -> None:
    """One engine's table."""
    import bpy

    print(f"{engine}, Blender {bpy.app.version_string}, {stage.pixels}^2 pixels, {samples} samples")
    print(f"{'material':28}{'seconds':>9}{'ratio':>8}")
    base = None
    for name, (make, lamps) in stage.subjects().items():
        stage.light(lamps)
        stage.put(make())
        seconds = min(stage.render(engine, samples)[0] for _ in range(repeat + 1))
        base = base or seconds
        print(f"{name:28}{seconds:9.2f}{seconds / base:8.2f}", flush=True)
    if engine == "cycles":
        equal_error(stage, samples)


def equal_error(stage: "TimedStage", samples: int) -> None:
    """The samples that Direct needs for the metal's RMSE, relative to each picture's own mean."""
    errors = {}
    for name, (make, lamps) in list(stage.subjects().items())[:2]:
        stage.light(lamps)
        stage.put(make())
        truth = stage.render("cycles", _REFERENCE_SAMPLES)[1]
        for count in (1, 2, 4, 8, samples, 2 * samples):
            picture = stage.render("cycles", count)[1]
            errors[name, count] = float(np.sqrt(np.mean((picture - truth) ** 2)) / truth.mean())
    for (name, count), error in errors.items():
        print(f"{name:28}{count:5} samples: RMSE {error:.4f} of the mean")


class TimedStage:
    """A sphere under suns, its materials, and a clock."""

    def __init__(self, folder: Path, pixels: int):
        os.environ["BLENDER_USER_RESOURCES"] = str(folder)
        link_extension(folder)
        import bpy

        from devtools.blender_shim import show_hidden_packages

        show_hidden_packages()
        import addon_utils

        addon_utils.enable(EXTENSION, default_set=True)
        self.folder, self.pixels = folder, pixels
        self.addon = {
            name: importlib.import_module(f"{EXTENSION}.addon.{name}")
            for name in ("compat", "key_lights", "materials.diffraction", "materials.builder")
        }
        data = bpy.data
        data.batch_remove([*data.objects, *data.meshes, *data.cameras, *data.materials])
        self.scene = bpy.context.scene
        self.scene.world = None
        bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64)
        bpy.ops.object.shade_smooth()
        self.sphere = bpy.context.object
        self.sphere.data.materials.append(None)
        camera = data.objects.new("Camera", data.cameras.new("Camera"))
        camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 2.1, (0, 0, 3)
        self.scene.collection.objects.link(camera)
        self.scene.camera = camera
        facts = bake_to_folder([read_height_map("sample:elaphe")], Order(), folder, lambda *_: None)
        self.bake = Path(facts["files"][0])

    def light(self, count: int) -> None:
        """So many suns."""
        import bpy

        bpy.data.batch_remove([o for o in bpy.data.objects if o.type == "LIGHT"])
        for k in range(count):
            sun = bpy.data.objects.new(f"Sun {k}", bpy.data.lights.new(f"Sun {k}", "SUN"))
            sun.rotation_euler = (0.5 * k - 0.3, 0.4 - 0.5 * k, 0)
            self.scene.collection.objects.link(sun)
        self.addon["key_lights"].follow_lamps(self.scene)

    def put(self, material) -> None:
        self.sphere.material_slots[0].material = material

    def subjects(self) -> dict[str, tuple[Callable, int]]:
        """Name, how the material is made, and its lamps."""
        found = {
            "Principled metal, 1 sun": (self.metal, 1),
            "Direct, 1 sun": (self.direct, 1),
            "Principled metal, 3 suns": (self.metal, 3),
            "Direct, 3 suns": (self.direct, 3),
        }
        if self.addon["compat"].HAS_RAYCAST:
            found["Direct, 1 sun, shadow rays"] = (lambda: self.direct(shadows=True), 1)
        return found

    def metal(self):
        """Principled, metallic, its roughness that of the bake's kernel."""
        import bpy

        self.scene.cycles.shading_system = False
        material = bpy.data.materials.new("Metal")
        self.addon["compat"].enable_nodes(material)
        principled = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
        principled.inputs["Metallic"].default_value, principled.inputs["Roughness"].default_value = 1.0, 0.3
        return material

    def direct(self, shadows: bool = False):
        """The add-on's own material."""
        self.scene.cycles.shading_system = False
        diffraction = self.addon["materials.diffraction"]
        return diffraction.new_diffraction_material("timed", diffraction.new_diffraction_group(self.bake, shadows))

    def render(self, engine: str, samples: int) -> tuple[float, np.ndarray]:
        """Seconds, and the linear picture (n, n, 3)."""
        import bpy
        import OpenEXR

        scene = self.scene
        scene.render.engine = "CYCLES" if engine == "cycles" else self.addon["compat"].eevee_engine()
        scene.cycles.samples = scene.eevee.taa_render_samples = samples
        scene.cycles.device = "CPU"
        scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
        scene.render.resolution_x = scene.render.resolution_y = self.pixels
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_depth = "32"
        path = self.folder / "timed.exr"
        scene.render.filepath = str(path)
        start = time.perf_counter()
        bpy.ops.render.render(write_still=True)
        seconds = time.perf_counter() - start
        with OpenEXR.File(str(path)) as file:
            pixels = next(iter(file.channels().values())).pixels
        return seconds, np.asarray(pixels[..., :3], float)

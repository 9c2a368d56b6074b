# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that several benchmarks render: a sphere under suns, and the sample scenes with a baked grating."""

import argparse
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Self

import numpy as np

from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.surface.readers.reader_registry import read_height_map
from precompute.table.atlas import read_header

from .osl import start_blender

_SURFACE = "sample:elaphe"
_TURNS_DEG = (0, 90, 200, 20, 110, 220, 40, 130)
# Sample and object of each scene.
SCENES = {"hero": ("xenopeltis", "Snake"), "macro": ("xenopeltis", "Snake"), "cd": ("cd", "CD")}
_FACES = 60_000


class Studio:
    """A scene of one mesh under suns, and its materials."""

    def __init__(self, addon: SimpleNamespace, folder: Path, pixels: int, bake: Path):
        self.addon, self.folder, self.pixels, self.bake = addon, folder, pixels, bake

    @classmethod
    def started(cls, folder: Path, pixels: int) -> Self:
        """Start with the add-on of this tree and a bake of the Elaphe sample in a folder."""
        addon = start_blender(folder)
        facts = bake_to_folder([read_height_map(_SURFACE)], BakeRequest(), folder, progress=lambda *_: None)
        return cls(addon, folder, pixels, Path(facts["files"][0]))

    def build(self) -> None:
        """Build a sphere without a material under a camera that looks down."""
        import bpy

        from sample_scenes import stage

        self.scene = bpy.context.scene
        stage.clean_scene()
        stage.render_settings(self.scene)
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

    def show(self, material) -> None:
        """Light the mesh with one sun and give it a material."""
        self.light(1)
        self.scene.render.engine, self.scene.cycles.shading_system = "CYCLES", False
        self.mesh.material_slots[0].material = material

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

    def direct(self, footprint: bool = False):
        """The add-on's own material under lamps."""
        group = self.addon.making_materials.new_diffraction_group(self.bake, False, "LAMPS")
        self.addon.skin.set_up(group, footprint=footprint)
        return self.addon.material.new_diffraction_material("direct", group)

    def render(self, samples: int, pixels: int | tuple[int, int] | None = None) -> np.ndarray:
        """Render with Cycles; returns the linear picture (rows, columns, 3), row 0 at the top.

        `pixels` is the side of a square picture, or rows and columns."""
        scene = self.scene
        scene.render.engine, scene.cycles.samples = "CYCLES", samples
        rows, columns = pixels if isinstance(pixels, tuple) else (pixels or self.pixels,) * 2
        scene.render.resolution_y, scene.render.resolution_x = rows, columns
        return rendered(scene, self.folder / "picture.exr")


def rendered(scene, path: Path) -> np.ndarray:
    """Render a scene into an OpenEXR file; returns the linear picture (rows, columns, 3), row 0 at the top."""
    import bpy
    import OpenEXR

    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(str(path)) as file:
        return np.asarray(next(iter(file.channels().values())).pixels[..., :3], float)


@dataclass
class Scene:
    """A sample scene whose grating is baked whole and shown."""

    addon: SimpleNamespace
    name: str
    pictures: Path
    samples: int

    @classmethod
    def built(
        cls,
        addon: SimpleNamespace,
        name: str,
        arguments: argparse.Namespace,
        pictures: Path,
        *,
        ground: str | None = None,
    ) -> "Scene":
        """Build a scene, bake its sample and assign it. The denoiser is off, so that renders can be compared. A snake
        lies on the set `ground`, by default the scene's own."""
        import bpy

        from sample_scenes import animal, discs, stage

        sample, shown = SCENES[name]
        stage.clean_scene()
        scene = bpy.context.scene
        scene.natural_gratings.items.clear()
        if name == "cd":
            discs.build_discs(scene, ["cd"])
        else:
            animal.build(scene, animal.VIEWS[name], "XENOPELTIS", faces=_FACES, panorama=None, ground=ground)
        grating = addon.importing.add_grating(scene, f"sample:{sample}")
        addon.baking.bake_and_wait(grating)
        addon.assigning.add_to_meshes(scene, [bpy.data.objects[shown]])
        render = scene.render
        render.engine, scene.cycles.shading_system = "CYCLES", False
        render.resolution_x, render.resolution_y = arguments.width, arguments.width * 9 // 16
        render.resolution_percentage = 100
        scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
        render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
        bpy.context.view_layer.update()
        return cls(addon, name, pictures, arguments.samples)

    @property
    def scene(self):
        """The open scene."""
        import bpy

        return bpy.context.scene

    @property
    def grating(self):
        """The scene's only grating."""
        return self.scene.natural_gratings.items[0]

    def render(self, what: str) -> np.ndarray:
        """Render a linear picture (rows, columns, 3)."""
        self.scene.cycles.samples = self.samples
        return rendered(self.scene, self.pictures / f"{self.name}_{what}.exr")

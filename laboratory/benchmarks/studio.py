# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample scenes that benchmarks render, with a baked grating."""

import argparse
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np

# Sample and object of each scene.
SCENES = {"hero": ("xenopeltis", "Snake"), "macro": ("xenopeltis", "Snake"), "cd": ("cd", "CD")}
_FACES = 60_000


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
            discs.build(scene)
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

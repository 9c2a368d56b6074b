# SPDX-License-Identifier: GPL-3.0-or-later
"""The studio lit by worlds, for the parts of `./dev bench lights`."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.optics.brdf import KERATIN_IOR
from precompute.reflectance.matter import parse
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.samples.catalogue import make_sample
from precompute.world_sources.sources import crop_frame, panorama_cells
from sample_scenes.panoramas import overcast

from .osl import colour_differences
from .render_time import Studio

# Samples of a noisy picture, and of its reference picture.
SAMPLES, _TRUTH_SAMPLES = 64, 512
WORLDS = ("clear sky", "overcast sky", "studio")
# Ordinary coats and their roughness.
COATS = {"coat": 0.3, "sharp coat": 0.08}
# File, and height in nanometres from black to white; the scans are 65 um wide.
_SCANS = (("elaphe_65um.png", 375), ("xenopeltis_65um.png", 818.69))
SURFACES = ("sample:elaphe", *(name for name, _ in _SCANS))
# Matters of the furnace's blaze.
MATTERS = ("mirror", "gold", "6x(1.68/80nm, 1.56/90nm), 1.56")
_FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data" / "snake"
# Pixels and samples of a furnace. A sample deviates by at most 0.5 of the mean, the mean over all by a thousandth.
_FURNACE_PIXELS, _FURNACE_SAMPLES = 64, 64
# Rows of a painted world.
_ROWS = 128
# A place from which a camera sees only the world.
_FAR_M = 1000


class Worlds(Studio):
    """The studio, lit by worlds."""

    def bakes(self, names: Sequence[str] = SURFACES) -> Iterator[tuple[str, Path]]:
        """The name and the bake's file of each of these surfaces."""
        if SURFACES[0] in names:
            yield SURFACES[0], self.bake
        for name, height_nm in _SCANS:
            if name in names and (_FOLDER / name).is_file():
                folder = self.folder / Path(name).stem
                folder.mkdir()
                scan = read_height_map(str(_FOLDER / name), 65, height_nm)
                facts = bake_to_folder([scan], BakeRequest(), folder)
                yield name, Path(facts["files"][0])

    def blazes(self) -> Iterator[tuple[str, Path]]:
        """The name and the bake's file of the blazed sample in each of MATTERS."""
        for number, text in enumerate(MATTERS):
            folder = self.folder / f"blazed{number}"
            folder.mkdir()
            request = BakeRequest(matter=parse(text))
            facts = bake_to_folder([make_sample("blazed")], request, folder)
            yield f"blazed, {text}", Path(facts["files"][0])

    def material(self, bake: Path, lights: str):
        """A new diffraction material of a bake, and its skin node."""
        group = self.addon.making_materials.new_diffraction_group(bake, False, lights)
        made = self.addon.material.new_diffraction_material("lit", group)
        return made, next(node for node in made.node_tree.nodes if node.label == "Skin")

    def furnace(self, bake: Path, lights: str, theta: float) -> np.ndarray:
        """The mean radiance (3,) of a plane over black in a white world, seen at theta radians."""
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
        """Light the scene by one of WORLDS."""
        from sample_scenes import stage

        if world == "clear sky":
            stage.light_by_sky(self.scene, stage.SUN_AZIMUTH_DEG, stage.SUN_ELEVATION_DEG)
            return
        radiance = overcast(_ROWS)
        if world == "studio":
            radiance *= 0.2
            directions = panorama_cells(_ROWS, 2 * _ROWS).directions.reshape(radiance.shape)
            for towards, radius_deg in (((0.6, -0.4, 0.7), 9), ((-0.7, 0.2, 0.7), 5)):
                cosine = directions @ (np.array(towards) / np.linalg.norm(towards))
                radiance[cosine > np.cos(np.radians(radius_deg))] = 12
        self.paint(radiance)

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
            return self.render("cycles", 1, shape)[1][::-1]
        finally:
            self.scene.camera = before
            bpy.data.batch_remove([camera, data])

    def dress(self, name: str, bake: Path | None = None):
        """Give the snake an ordinary coat, or diffraction of a bake (by default the sample's) with a choice of lights;
        returns its skin node. The footprint is on, as in the add-on."""
        import bpy

        material, skin = self.material(bake or self.bake, "LAMPS" if name in COATS else name)
        for group in filter(self.addon.skin.is_diffraction, bpy.data.node_groups):
            self.addon.skin.set_up(group, footprint=True)
        if name in COATS:
            skin.inputs["Coat Weight"].default_value = 1.0
            skin.inputs["Coat Roughness"].default_value = COATS[name]
            skin.inputs["Coat IOR"].default_value = KERATIN_IOR
            output = next(node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL")
            material.node_tree.links.new(skin.outputs[0], output.inputs["Surface"])
        self.mesh.material_slots[0].material = material
        self.scene.cycles.shading_system = False
        self.addon.fitting_worlds.fit_world(self.scene)
        return skin

    def dress_sphere(self, bake: Path) -> None:
        """Give the mesh the diffraction of a bake over black in Lamps and World, and fit the world. Of an animated
        world the present frame is fitted."""
        material, skin = self.material(bake, "REST")
        skin.inputs["Base Color"].default_value = (0, 0, 0, 1)
        self.mesh.material_slots[0].material = material
        self.addon.fitting_worlds.fit_world(self.scene)
        if self.addon.fitting_worlds.world_is_animated(self.scene):
            fits = self.addon.fitting_frames.FrameFits(self.scene, [self.scene.frame_current])
            fits.wait()
            fits.keep()

    def noise(self) -> dict[str, float]:
        """Processor microseconds of a sample of a pixel (`us`), the mean of a picture of many samples, and the errors
        of a picture of SAMPLES samples against it: the RMSE, and the RMSE and median CIEDE2000 after the denoiser. Both
        pictures are clipped at display white."""
        truth = np.minimum(self.render("cycles", _TRUTH_SAMPLES)[1], 1)
        start = self.render("cycles", 1)[0]
        seconds, picture = self.render("cycles", SAMPLES + 1)
        self.scene.cycles.use_denoising = True
        denoised = self.render("cycles", SAMPLES + 1)[1]
        self.scene.cycles.use_denoising = False
        return {
            "us": 1e6 * (seconds - start) / (SAMPLES * self.pixels**2),
            "mean": float(truth.mean()),
            "rmse": float(np.sqrt(np.mean((np.minimum(picture, 1) - truth) ** 2))),
            "denoised": float(np.sqrt(np.mean((np.minimum(denoised, 1) - truth) ** 2))),
            "denoised_de": float(np.median(colour_differences(denoised, truth))),
        }

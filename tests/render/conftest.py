# SPDX-License-Identifier: GPL-3.0-or-later
"""Small float renders: an empty scene, lamps, and pictures with one sample at the centre of each pixel."""

import subprocess
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import OpenEXR
import pytest

from devtools import ROOT
from devtools.extension import AddonModules
from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.reflectance.matter import parse
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare
from precompute.table import atlas


@pytest.fixture(scope="session", autouse=True)
def _filtered_as_by_cards(extension) -> None:
    """Set the texture filter before EEVEE's first render."""
    AddonModules(extension.__name__).mesa.filter_as_cards_do()


@dataclass
class Stage:
    """A scene under construction, the folder for its pictures, the pixel filter's kind and width, and whether EEVEE
    renders the lamps' shadow maps: without a graphics card they take most of a small picture's time."""

    addon: SimpleNamespace
    folder: object
    scene: object
    filter: tuple[str, float] = ("BOX", 0.01)
    shadow_maps: bool = False

    def add(self, name, data, location=(0, 0, 0), *, rotation=(0, 0, 0), scale=(1, 1, 1), collection=None):
        """Add an object for the data."""
        import bpy

        made = bpy.data.objects.new(name, data)
        made.location, made.rotation_euler, made.scale = location, rotation, scale
        (collection or self.scene.collection).objects.link(made)
        return made

    def lamp(self, kind: str, location=(0, 0, 1), to=None, name="Lamp", **settings):
        """Add a lamp; `to` is the direction of its own +Z axis, from the lit surface to the lamp."""
        import bpy
        from mathutils import Vector

        data = bpy.data.lights.new(name, kind)
        for key, value in settings.items():
            setattr(data, key, value)
        rotation = Vector(to).to_track_quat("Z", "Y").to_euler() if to is not None else (0, 0, 0)
        return self.add(name, data, location, rotation=rotation)

    def camera(self, location, target=(0, 0, 0), ortho=None, angle=None):
        """Add a camera that looks at a target, its picture upright along +y or +z."""
        import bpy
        from mathutils import Vector

        data = bpy.data.cameras.new("Camera")
        data.clip_start = 1e-3
        if ortho:
            data.type, data.ortho_scale = "ORTHO", ortho
        if angle:
            data.angle = angle
        made = self.add("Camera", data, location)
        made.rotation_euler = (Vector(location) - Vector(target)).to_track_quat("Z", "Y").to_euler()
        self.scene.camera = made
        return made

    def material(self, name: str):
        """An empty material and the builder of its node tree."""
        import bpy

        made = bpy.data.materials.new(name)
        self.addon.compat.enable_nodes(made)
        made.node_tree.nodes.clear()
        return made, self.addon.builder.Tree(made.node_tree)

    def render(self, engine="cycles", pixels=64, samples=1, name="picture") -> dict[str, np.ndarray]:
        """Channels of a float EXR (rows, columns), row 0 at the top, by name; the picture's own are R, G, B."""
        import bpy

        scene = self.scene
        settings = scene.render
        settings.resolution_x = settings.resolution_y = pixels
        settings.resolution_percentage = 100
        settings.filter_size = self.filter[1]
        settings.image_settings.file_format = "OPEN_EXR"
        settings.image_settings.color_depth = "32"
        if engine == "cycles":
            settings.engine = "CYCLES"
            scene.cycles.device = "CPU"
            scene.cycles.samples = samples
            scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
            scene.cycles.pixel_filter_type, scene.cycles.filter_width = self.filter
        else:
            settings.engine = self.addon.compat.eevee_engine()
            scene.eevee.taa_render_samples = samples
            scene.eevee.use_shadows = self.shadow_maps
        path = self.folder / f"{name}.exr"
        settings.filepath = str(path)
        with self._dark_world():
            bpy.ops.render.render(write_still=True)
        return read_channels(path)

    @contextmanager
    def _dark_world(self):
        """Give a scene without a world a dark one while it renders."""
        import bpy

        from tests.clean_scene import dark_world

        if self.scene.world is not None:
            yield
            return
        self.scene.world = dark = dark_world()
        yield
        bpy.data.worlds.remove(dark)

    def rgb(self, engine="cycles", pixels=64, samples=1, name="picture") -> np.ndarray:
        """Linear RGB (n, n, 3), row 0 at the top."""
        return rgb_of(self.render(engine, pixels, samples, name))


def read_channels(path) -> dict[str, np.ndarray]:
    """The channels of an EXR by their short names."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {key: np.asarray(value.pixels, float) for key, value in file.channels().items()}
    return {short_name(key): pixels for key, pixels in channels.items()}


def rgb_of(channels: dict[str, np.ndarray]) -> np.ndarray:
    """The picture (rows, columns, 3)."""
    return np.stack([channels[c] for c in "RGB"], axis=-1)


def short_name(channel: str) -> str:
    """`ViewLayer.Combined.R` -> R, `ViewLayer.Normal.X` -> Normal.X."""
    parts = channel.split(".")
    return parts[-1] if len(parts) < 3 or parts[-2] == "Combined" else ".".join(parts[-2:])


@pytest.fixture
def stage(addon, tmp_path) -> Stage:
    """An empty, dark scene."""
    import bpy

    from tests.clean_scene import put_back

    scene = bpy.context.scene
    clear(addon, scene)
    put_back(addon, scene)
    for name in ("seed", "max_bounces"):  # tests change them
        scene.cycles.property_unset(name)
    return Stage(addon, tmp_path, scene)


def clear(addon, scene) -> None:
    """Empty the scene and the file."""
    import bpy

    data = bpy.data
    held = (data.objects, data.meshes, data.lights, data.cameras, data.materials, data.node_groups, data.images)
    for collection in (*held, data.collections):
        data.batch_remove(list(collection))
    scene.natural_gratings.items.clear()
    if scene.animation_data:
        scene.animation_data_clear()
    addon.follow.stop_following(scene)
    addon.sky.forget_sources(scene)
    scene.world = None
    scene.frame_set(1)


@pytest.fixture
def files(stage):
    """The stage, for a test that opens other files. Afterwards an empty file with one scene is open."""
    import bpy

    yield stage
    bpy.ops.wm.read_homefile(use_empty=True)


@pytest.fixture(scope="session")
def baked(tmp_path_factory):
    """The blazed sample's bake: its file and its table. A short coherence makes it in seconds."""
    return _blazed(tmp_path_factory, "dielectric")


@pytest.fixture(scope="session")
def gold(tmp_path_factory):
    """The same of gold: its file and its table."""
    return _blazed(tmp_path_factory, "gold")


@pytest.fixture(scope="session")
def under_plate(tmp_path_factory):
    """The same of gold under a plate: its file and its table."""
    return _blazed(tmp_path_factory, "plate 1.585, gold", coherence_um=4)


def _blazed(tmp_path_factory, matter: str, coherence_um: float = 8):
    asked = BakeRequest(coherence_length_m=coherence_um * 1e-6, matter=parse(matter))
    relief = prepare(read_height_map("sample:blazed"), plate_ior=asked.matter.plate_ior)
    image, layout = atlas.pack(bake(relief, asked))
    path = tmp_path_factory.mktemp("radiance") / "blazed.exr"
    atlas.write_together({path: (image, layout)}, {"request": asked.as_dict()})
    return path, atlas.unpack(image, layout)


@pytest.fixture(scope="session")
def skin(tmp_path_factory):
    """A shallow bake of the Elaphe sample with its sample set: its file and its table."""
    return _baked_by_command(tmp_path_factory, "elaphe")


@pytest.fixture(scope="session")
def mirror_skin(tmp_path_factory):
    """The same as a perfect mirror."""
    return _baked_by_command(tmp_path_factory, "elaphe", "--matter", "mirror")


@pytest.fixture(scope="session")
def disc(tmp_path_factory):
    """The same for the CD sample as a perfect mirror under a plate."""
    return _baked_by_command(tmp_path_factory, "cd", "--matter", "plate 1.585, mirror", coherence_um=12)


@pytest.fixture(scope="session")
def flat(tmp_path_factory):
    """The same for a flat surface, which has a mirror image alone."""
    return _baked_by_command(tmp_path_factory, "flat")


@pytest.fixture(scope="session")
def deep_skin(tmp_path_factory):
    """The same for the Xenopeltis sample, whose zero order changes most near the horizon."""
    return _baked_by_command(tmp_path_factory, "xenopeltis", coherence_um=12)


@pytest.fixture(scope="session")
def short_skin(tmp_path_factory):
    """The Elaphe sample of almost the same coherence, on other texels."""
    return _baked_by_command(tmp_path_factory, "elaphe", coherence_um=12.5)


@pytest.fixture(scope="session", params=["mirror", "gold", "6x(1.68/80nm, 1.56/90nm), 1.56"])
def matter_skin(request, tmp_path_factory):
    """The same for the blazed sample in a matter whose reflectance the table holds."""
    return _baked_by_command(tmp_path_factory, "blazed", "--matter", request.param, coherence_um=12)


def _baked_by_command(tmp_path_factory, sample, *more, coherence_um=30):
    """A short coherence makes the bake, and an integral over its table, in seconds."""
    folder = tmp_path_factory.mktemp("skin")
    asked = [f"sample:{sample}", "--coherence-um", str(coherence_um), "--delta-e", "1", *more, "-o", str(folder)]
    subprocess.run([sys.executable, "-m", "precompute", "bake", *asked], cwd=ROOT, check=True, capture_output=True)
    path = folder / f"{sample}.exr"
    return path, atlas.read(path)[0]

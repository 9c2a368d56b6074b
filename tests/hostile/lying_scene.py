# SPDX-License-Identifier: GPL-3.0-or-later
"""A .blend with one of everything that the extension stores, as a base for wrong values and edits."""

import shutil
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from precompute.table.sample_set import path_beside
from precompute.world_sources.sources import Source

_SUN = Source(np.array((0.0, 0.6, 0.8)), np.array((3.0, 2.0, 1.0)), 1e-4)
_REGION = [-2.0, 2.0, -2.0, 2.0, 0.0, 2.0]


@dataclass(frozen=True)
class Skin:
    """The open file's parts. They are looked up at each use, because an edit may have deleted them."""

    addon: SimpleNamespace

    @property
    def scene(self):
        import bpy

        return bpy.context.scene

    @property
    def first(self):
        return self.scene.natural_gratings.items[0]

    @property
    def second(self):
        return self.scene.natural_gratings.items[1]

    @property
    def group(self):
        return self.first.group

    @property
    def response(self):
        return self.addon.response.response_in(self.group)

    @property
    def picture(self):
        return next(node.image for node in self.response.group.nodes if node.type == "TEX_IMAGE")

    @property
    def frame_map(self):
        import bpy

        return bpy.data.images["Direction Map"]

    @property
    def plane(self):
        import bpy

        return bpy.data.objects["Plane"]

    @property
    def material(self):
        return self.first.material

    @property
    def sun(self):
        import bpy

        return bpy.data.objects["Sun"]

    @property
    def diffraction_lamp(self):
        import bpy

        return bpy.data.objects["Diffraction Lamp"]


def write_scan(path: Path) -> Path:
    """Write a scan that bakes in a moment: 64 x 64 pixels, 4 um wide, 100 nm deep, waves 8 pixels long."""
    from PIL import Image

    waves = 0.5 + 0.5 * np.sin(2 * np.pi * 8 * (np.arange(64) + 0.5) / 64)
    Image.fromarray(np.tile(np.rint(waves * 65535).astype(np.uint16), (64, 1))).save(path)
    return path


def build(addon: SimpleNamespace, scan: Path, bake: Path) -> Path:
    """Write the .blend beside the scan, with two copies of the scan's bake and sample set; return its path."""
    import bpy

    folder = scan.parent
    for name in ("waves", "second"):
        shutil.copy(bake, folder / f"{name}.exr")
        shutil.copy(path_beside(bake), path_beside(folder / f"{name}.exr"))
    with (folder / "second.exr").open("ab") as file:  # make the second file's content differ, as a second bake's would
        file.write(b"\0")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    skin = Skin(addon)
    scene = skin.scene
    _fill(scene)
    for name in ("waves", "second"):
        made = scene.natural_gratings.items.add()
        # Blender 4.5 takes a second to compile a script for shadows.
        made.name, made.bake_path, made.shadows = name, str(folder / f"{name}.exr"), False
        made.source, made.quality = str(scan), "good\ndust: good"
        made.size_um, made.height_nm = 4.0, 100.0
        made.levelling = "plane,scars"
    assert bpy.ops.grating.assign() == {"FINISHED"}
    bpy.ops.grating.vary(second="second", second_share=0.3)
    assert bpy.ops.grating.add_diffraction_lamp() == {"FINISHED"}
    image = addon.tangent_frame.new_map("Direction Map", 16)
    addon.tangent_frame.note_mesh(image, skin.plane, "UVMap")
    skin.second.take_frame_source(addon.direction_source.DirectionSource("FRAME_MAP", frame_map=image))
    addon.skin.set_up(skin.second.group, frame=skin.second.frame_source())
    skin.response.group["ng_region"] = _REGION
    fingerprint = addon.fitting_worlds._fingerprint(scene)
    addon.sky.hold_sources(scene, [_SUN], fingerprint=fingerprint, missed=0.1)
    addon.lighting.update_lamps(scene)
    bpy.context.view_layer.objects.active = skin.plane
    path = folder / "skin.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def _fill(scene) -> None:
    """Add a plane with its own material, a sun, a spot that one view layer excludes, a camera and a sky."""
    import bpy

    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object
    plane.data.materials.append(bpy.data.materials.new("Paint"))
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    spot = bpy.data.objects.new("Spot", bpy.data.lights.new("Spot", "SPOT"))
    spot.location = (0, 0, 3)
    held = bpy.data.collections.new("Held")
    held.objects.link(spot)
    scene.collection.children.link(held)
    scene.collection.objects.link(sun)
    sun.light_linking.receiver_collection = bpy.data.collections.new("Lit")
    other = scene.view_layers.new("Other")
    other.layer_collection.children["Held"].exclude = True
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, 0, 4)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = True
    tree = scene.world.node_tree
    tree.nodes.clear()
    sky, background, out = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexSky", "Background", "OutputWorld"))
    tree.links.new(sky.outputs[0], background.inputs[0])
    tree.links.new(background.outputs[0], out.inputs[0])
    plane.select_set(True)
    bpy.context.view_layer.objects.active = plane
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.device = 1, "CPU"
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.resolution_percentage = 100

# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes of constants that a material uses in EEVEE: as the add-on counts them, and as Blender declares them.

`python -m tests.render.eevee_constants FOLDER` prints both. EEVEE has 64 KiB for the constants of a material
(addon/nodes/interface.py). A sphere with a grating stands outside the camera's view, so that EEVEE translates its
shaders but never runs them. Mesa's software rasteriser writes the shaders to files, which declare the block of
constants. Other drivers write no files; the second number is then missing."""

import os
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from laboratory.benchmarks.blender import start_blender
from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.surface.readers.reader_registry import read_height_map
from precompute.world_sources.sources import Source

_COHERENCE_M = 30e-6
_SOURCE = Source(np.array((0.0, 0.6, 0.8)), np.array((3.0, 2.0, 1.0)), 1e-4)
# Size and alignment in bytes of the types of a block's members (std140).
_NUMBERS = dict.fromkeys(("float", "int", "bool"), (4, 4))
_TYPES = _NUMBERS | {"vec2": (8, 8), "vec3": (12, 16), "vec4": (16, 16), "mat4": (64, 16)}


def main(folder: Path) -> None:
    """Print the bytes that the add-on counts for a material, and those of Blender's shaders."""
    captured = folder / "captured"
    captured.mkdir()
    os.environ["MESA_SHADER_CAPTURE_PATH"] = str(captured)
    addon = start_blender(folder / "user")
    print(show(addon, _bake(folder)), _translated(addon, captured) or "")


def show(addon: SimpleNamespace, bake: Path) -> int:
    """Put a grating over a base, under two spots, one of them linked, and a source of the world; returns the bytes that
    the add-on counts for the material.

    The count holds for a lamp of every kind, as a lamp's kind may change. A spot with a radius has most of what it
    counts. From Blender 5.3 on EEVEE does without what other lamps multiply by 0: 15 % with suns."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8)
    ball = bpy.context.object
    for index in range(2):
        lamp = bpy.data.objects.new("Spot", bpy.data.lights.new("Spot", "SPOT"))
        lamp.data.shadow_soft_size = 0.1
        scene.collection.objects.link(lamp)
        if index == 0:
            lamp.light_linking.receiver_collection = bpy.data.collections.new("Receivers")
    scene.world = bpy.data.worlds.new("World")
    addon.compat.enable_nodes(scene.world)
    made = scene.natural_gratings.items.add()
    made.name, made.bake_path, made.frame_kind = bake.stem, str(bake), "STORED"
    made.lights, made.shadows, made.footprint = "REST", True, False
    scene.natural_gratings.active_index = 0
    now = addon.fitting_worlds._fingerprint(scene)
    addon.sky.hold_sources(scene, [_SOURCE], fingerprint=now, missed=0.0)
    ball.data.materials.append(bpy.data.materials.new("Base"))
    addon.compat.enable_nodes(ball.active_material)
    assert bpy.ops.grating.add_diffraction() == {"FINISHED"}
    return addon.interface.size_of(ball.active_material.node_tree).constant_bytes


def _bake(folder: Path) -> Path:
    request = BakeRequest(coherence_length_m=_COHERENCE_M, delta_e=1.0)
    return Path(
        bake_to_folder([read_height_map("sample:elaphe")], request, folder, progress=lambda *_: None)["files"][0]
    )


def _translated(addon: SimpleNamespace, captured: Path) -> int | None:
    """Let EEVEE translate the scene's shaders; returns the bytes of their largest block of constants."""
    import bpy

    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.camera.location = (0.0, 0.0, -100.0)  # looks down, away from the sphere
    scene.render.engine, scene.eevee.taa_render_samples = addon.compat.eevee_engine(), 1
    scene.render.resolution_x = scene.render.resolution_y = 4
    bpy.ops.render.render()
    found = []
    for path in captured.iterdir():
        block = re.search(r"struct NodeTree \{(.*?)\};", path.read_text(errors="replace"), re.DOTALL)
        found += [] if block is None else [block_bytes(re.findall(r"(\w+) \w+;", block[1]))]
        path.unlink()
    return max(found, default=None)


def block_bytes(types: list[str]) -> int:
    """The size of a block whose members have these types, in this order."""
    end = 0
    for name in types:
        size, multiple = _TYPES[name.replace("mat4x4", "mat4")]
        end = -(-end // multiple) * multiple + size
    return -(-end // 16) * 16


if __name__ == "__main__":
    main(Path(sys.argv[1]))

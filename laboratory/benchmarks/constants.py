# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes of constants that materials use in EEVEE: as the add-on counts them, and as Blender's own shaders declare them.

    ./dev bench constants [--case NAME] [--json FILE|-]

EEVEE has 64 KiB for the constants of a material (addon/nodes/interface.py). Each row is a sphere with a grating,
outside the camera's view, so that EEVEE translates its shaders but never runs them. Mesa's software rasteriser writes
the shaders to files, which declare the block of constants. Other drivers write no files; `blender` is then null.
"""

import os
import re
import tempfile
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.cli.parser import OneLineParser
from precompute.surface.readers.reader_registry import read_height_map
from precompute.world_sources.sources import Source

from . import report
from .osl import start_blender

_SURFACES = ("sample:elaphe", "sample:xenopeltis")
_COHERENCE_M = 30e-6
_SOURCE = Source(np.array((0.0, 0.6, 0.8)), np.array((3.0, 2.0, 1.0)), 1e-4)
# Size and alignment in bytes of the types of a block's members (std140).
_TYPES = {"float": (4, 4), "int": (4, 4), "vec2": (8, 8), "vec3": (12, 16), "vec4": (16, 16), "mat4": (64, 16)}


@dataclass(frozen=True)
class Case:
    """A material: the number of gratings it varies between, its lights and its options."""

    bakes: int = 1
    lamps: int = 1
    sources: int = 0
    linked: int = 0
    lights: str = "REST"
    shadows: bool = True
    footprint: bool = False
    frame: str = "STORED"
    turn: float = 0.0
    over: bool = False


CASES = {
    "lamps": Case(lights="LAMPS", shadows=False),
    "shadows, footprint": Case(lights="LAMPS", footprint=True),
    "sources over a base": Case(lamps=2, sources=1, linked=1, over=True),
    "all, along an axis": Case(lights="ALL", frame="AXIS", turn=0.2),
    "one bake": Case(sources=8, shadows=False, frame="RADIAL"),
    "two bakes": Case(bakes=2, sources=8),
    "two bakes, three suns": Case(bakes=2, lamps=3, sources=8, footprint=True),
}


def main(argv: list[str] | None = None) -> int:
    """Print the table and return the exit status."""
    parser = OneLineParser(prog="./dev bench constants", description=__doc__.splitlines()[0])
    parser.add_argument("--case", action="append", choices=CASES, help="default: all of them")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        captured = Path(folder, "captured")
        captured.mkdir()
        os.environ["MESA_SHADER_CAPTURE_PATH"] = str(captured)
        addon = start_blender(Path(folder, "user"))
        needed = max(CASES[name].bakes for name in arguments.case or CASES)
        bakes = [_bake(surface, Path(folder)) for surface in _SURFACES[:needed]]
        rows = []
        report.say(f"{'bytes':24}{'counted':>9}{'Blender':>9}", arguments.json)
        for name in arguments.case or CASES:
            counted = show(addon, CASES[name], bakes)
            rows.append({"case": name, "counted": counted, "blender": _translated(addon, captured)})
            report.say("{case:24}{counted:9}{blender!s:>9}".format(**rows[-1]), arguments.json)
    report.write({"rows": rows}, arguments.json)
    return 0


def show(addon: SimpleNamespace, case: Case, bakes: list[Path]) -> int:
    """Build a file of the case with the add-on's buttons; returns the bytes that the add-on counts for its material."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8)
    ball = bpy.context.object
    for index in range(case.lamps):
        lamp = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
        scene.collection.objects.link(lamp)
        if index < case.linked:
            lamp.light_linking.receiver_collection = bpy.data.collections.new("Receivers")
    scene.world = bpy.data.worlds.new("World")
    addon.compat.enable_nodes(scene.world)
    gratings = scene.natural_gratings
    for path in bakes[: case.bakes]:
        made = gratings.items.add()
        made.name, made.bake_path, made.frame_kind = path.stem, str(path), case.frame
        made.lights, made.shadows, made.footprint = case.lights, case.shadows, case.footprint
    gratings.active_index = 0
    now = addon.fitting_worlds._fingerprint(scene)
    addon.sky.hold_sources(scene, [_SOURCE] * case.sources, fingerprint=now, missed=0.0)
    if case.over:
        ball.data.materials.append(bpy.data.materials.new("Base"))
        addon.compat.enable_nodes(ball.active_material)
    assign = bpy.ops.grating.add_diffraction if case.over else bpy.ops.grating.assign
    assert assign() == {"FINISHED"}
    first, *others = gratings.items
    if others or case.turn:
        choice = addon.grating.Variation(shares=(0.4,) * len(others), turn=case.turn)
        addon.making_materials.vary(scene, first, choice, others=others)
    return addon.interface.constant_bytes(ball.active_material.node_tree)


def _bake(surface: str, folder: Path) -> Path:
    request = BakeRequest(coherence_length_m=_COHERENCE_M, delta_e=1.0)
    return Path(bake_to_folder([read_height_map(surface)], request, folder)["files"][0])


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

# SPDX-License-Identifier: GPL-3.0-or-later
"""The files that card.py renders: two sample scenes under a number of suns, in several materials.

The files need no extension. The pictures of a scene's table lie once beside its files. The snake of `hero` lies on a
grey plate: the 150,000 grains of its soil would take more time than anything that is measured."""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

SCENES = ("hero", "cd")
# A Principled metal; the object's own material without diffraction; with it; and with it but without shadow rays.
MATERIALS = ("metal", "plain", "grating", "unshadowed")


def file_of(folder: Path, scene: str, material: str, lamps: int) -> Path:
    """Where the file of a row is."""
    return folder / scene / f"{material}_{lamps}.blend"


def material_of(file: Path) -> str:
    """The material of a row's file."""
    return file.stem.split("_")[0]


def write_files(folder: Path, names: Sequence[str], lamps: Sequence[int]) -> None:
    """Write the files of these scenes, one for each material and number of suns."""
    from .osl import start_blender

    with tempfile.TemporaryDirectory() as user_folder:
        addon = start_blender(Path(user_folder))
        for name in names:
            _write_scene(addon, name, folder, lamps)


def _write_scene(addon, name: str, folder: Path, lamps: Sequence[int]) -> None:
    import bpy

    from sample_scenes.lookdev import stops_for_grey

    from .studio import Scene, Studio

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)  # drops the pictures of the scene before
    built = Scene.built(addon, name, argparse.Namespace(width=1920, samples=16), folder, ground="turntable")
    scene = built.scene
    scene.render.engine = addon.compat.eevee_engine()
    studio = Studio(addon, folder, 0, built.grating.baked_file())
    studio.scene = scene
    slots = [
        slot
        for thing in bpy.data.objects
        for slot in thing.material_slots
        if slot.material and addon.material.diffraction_nodes(slot.material)
    ]
    dressed = [slot.material for slot in slots]
    plain = [material.copy() for material in dressed]
    for material in plain:
        addon.material.remove_diffraction(material)
    materials = {"metal": [studio.metal()] * len(slots), "plain": plain}
    for count in lamps:
        studio.light(count)
        scene.view_settings.exposure = stops_for_grey(scene)
        for material in MATERIALS:
            for slot, put in zip(slots, materials.get(material, dressed), strict=True):
                slot.material = put
            built.grating.shadows = material != "unshadowed"
            addon.lighting.update_lamps(scene)
            path = file_of(folder, name, material, count)
            path.parent.mkdir(parents=True, exist_ok=True)
            bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)
            bpy.ops.file.unpack_all(method="WRITE_LOCAL")
            bpy.ops.wm.save_mainfile(compress=False)
            path.with_suffix(".blend1").unlink(missing_ok=True)

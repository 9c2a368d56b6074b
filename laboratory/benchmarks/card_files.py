# SPDX-License-Identifier: GPL-3.0-or-later
"""The files that card.py renders: two sample scenes under a number of suns, in several materials.

The files need no extension. The pictures of a scene's table lie once beside its files. The snake of `hero` lies on a
grey plate: the 150,000 grains of its soil would take more time than anything that is measured."""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

from precompute.table.atlas import read_header

_TURNS_DEG = (0, 90, 200, 20, 110, 220, 40, 130)
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
    from .blender import start_blender

    with tempfile.TemporaryDirectory() as user_folder:
        addon = start_blender(Path(user_folder))
        for name in names:
            _write_scene(addon, name, folder, lamps)


def _write_scene(addon, name: str, folder: Path, lamps: Sequence[int]) -> None:
    import bpy

    from sample_scenes.lookdev import stops_for_grey

    from .studio import Scene

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)  # drops the pictures of the scene before
    built = Scene.built(addon, name, argparse.Namespace(width=1920, samples=16), folder, ground="turntable")
    scene = built.scene
    scene.render.engine = addon.compat.eevee_engine()
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
    materials = {"metal": [_metal(addon, built.grating.baked_file())] * len(slots), "plain": plain}
    for count in lamps:
        _light(addon, scene, count)
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


def _light(addon, scene, count: int) -> None:
    """Light the scene with a number of suns, which the add-on follows."""
    import bpy

    from sample_scenes import stage

    bpy.data.batch_remove([o for o in bpy.data.objects if o.type == "LIGHT"])
    for turn in _TURNS_DEG[:count]:
        stage.add_sun(scene, stage.SUN_AZIMUTH_DEG + turn, stage.SUN_ELEVATION_DEG)
    addon.follow.follow_lamps(scene)


def _metal(addon, bake: Path):
    """A Principled metal as rough as the kernel is wide at normal incidence: alpha is sigma_b over sqrt(2)."""
    import bpy

    sigma_b = read_header(bake)[0].sigma_b
    material = bpy.data.materials.new("Metal")
    addon.compat.enable_nodes(material)
    principled = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    principled.inputs["Metallic"].default_value = 1.0
    principled.inputs["Roughness"].default_value = (sigma_b / 2**0.5) ** 0.5
    return material

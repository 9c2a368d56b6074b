# SPDX-License-Identifier: GPL-3.0-or-later
"""The code in the second Blender: writes a file for each preset, with its material as an asset (started by
library_job.py)."""

from pathlib import Path

import bpy

from ...precompute.base.files import told_of
from ...precompute.base.strict import read_json
from ...precompute.cli.printing import Progress
from ...precompute.presets.presets import Preset, read_preset
from ..blender.compat import prefer_append
from ..blender.written import check_blend
from ..gratings.grating import active_grating
from ..workflow.baking import bake_and_wait
from ..workflow.making_materials import working_material
from ..workflow.presets import import_preset
from ..workflow.varying_inputs import fit_hologram_later
from .catalogs import catalog_id, tags_of

_PICTURES = Path(__file__).parents[1] / "ui" / "thumbnails"
_AUTHOR, _LICENSE = "Natural Gratings", "CC0"


def write_assets(request_path: Path) -> None:
    """Write the files of the requested presets into the request's folder. Raises GratingError if a preset cannot be
    read or baked."""
    request = read_json(request_path, "try again")
    progress = Progress("json")
    for number, name in enumerate(request["presets"]):
        progress("writing assets", number / len(request["presets"]))
        _write_asset(read_preset(name), Path(request["folder"]) / f"{name}.blend")
    progress("writing assets", 1.0)


def _write_asset(preset: Preset, path: Path) -> None:
    """Write the material of a preset, baked at draft quality if no draft ships. Raises GratingError if the file is not
    written whole."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    import_preset(scene, preset.name)
    grating = active_grating(scene)
    if not grating.bake_path:
        bake_and_wait(grating)
    material = working_material(scene, grating)
    fit_hologram_later(material)
    _mark(material, preset)
    for image in bpy.data.images:
        if image.filepath:  # its pixels are packed; another machine does not have this path
            image.filepath_raw = f"//{Path(image.filepath).name}"
    with told_of(path):
        bpy.data.libraries.write(str(path), {material}, compress=True)
        check_blend(path)


def _mark(material: bpy.types.Material, preset: Preset) -> None:
    """Mark a preset's material as an asset, named as the preset, with its picture, catalog and tags."""
    material.name = preset.title
    material.asset_mark()
    asset, relief = material.asset_data, preset.request.scans[0].source
    asset.description = f"Draft of a diffraction material. {relief}; matter: {preset.request.matter}"
    asset.author, asset.license, asset.catalog_id = _AUTHOR, _LICENSE, catalog_id(preset)
    for tag in tags_of(preset):
        asset.tags.new(tag, skip_if_exists=True)
    prefer_append(asset)
    picture = _PICTURES / f"{preset.name}.jpg"
    if picture.is_file():
        with bpy.context.temp_override(id=material):
            bpy.ops.ed.lib_id_load_custom_preview(filepath=str(picture))

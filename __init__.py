# SPDX-License-Identifier: GPL-3.0-or-later
"""Natural Gratings: measured surfaces as iridescent materials. Blender's entry point.

The functions import the add-on, so that this folder can be imported without Blender."""

# Blender reads this of an add-on in a plain folder, scripts/addons/natural_gratings. For an extension it reads
# blender_manifest.toml, and tests/package/test_plain_folder.py compares both.
bl_info = {
    "name": "Natural Gratings",
    "description": "Iridescence of snake skin and discs from measured scans",
    "author": "Natural Gratings",
    "version": (0, 1, 0),
    "blender": (4, 5, 0),
    "location": "3D View > Sidebar > Grating",
    "category": "Material",
}


def register() -> None:
    from . import addon

    addon.register()


def unregister() -> None:
    from . import addon

    addon.unregister()


def glTF2ExportUserExtension() -> object:  # noqa: N802  the name by which Blender's glTF exporter finds the hooks
    from .addon.materials.exporting import GltfExport

    return GltfExport()

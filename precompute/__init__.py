# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns height maps into diffraction tables: the wave optics of Natural Gratings, without Blender.

This page is the contents of the library; docs/library.md shows its use. A name is loaded when it is first used."""

import importlib

# Each name of the library, the module that defines it, and its name there if it differs.
_CONTENTS = {
    "read_height_map": ("surface.readers.reader_registry",),
    "HeightMap": ("surface.height_map",),
    "parse_steps": ("surface.steps.pipeline",),
    "level": ("surface.steps.pipeline",),
    "prepare": ("surface.relief",),
    "BakeRequest": ("bake.request",),
    "bake_to_folder": ("bake.make",),
    "read_bake": ("table.atlas", "read"),
    "light_from": ("maps.brdf_map",),
    "reflected_xyz": ("table.radiance",),
    "brdf_map": ("maps.brdf_map", "from_bake"),
    "reference_xyz": ("reference.reference",),
    "GratingError": ("base.failure",),
}
__all__ = list(_CONTENTS)


def __getattr__(name: str) -> object:
    if name not in _CONTENTS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, *renamed = _CONTENTS[name]
    return getattr(importlib.import_module(f".{module}", __name__), renamed[0] if renamed else name)

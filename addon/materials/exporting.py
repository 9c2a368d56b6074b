# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's exporters write of a material with diffraction: its base alone. A bake's pictures hold numbers, which
another program would show as light."""

from typing import Any

import bpy

from ..blender import stored
from ..blender.guard import guarded
from ..blender.session import has_window
from .material import diffraction_nodes

# The custom property of a Diffraction node that an export has muted.
_MUTED = "ng_muted"


def left_behind(materials: list[str]) -> str:
    """The line that an export reports about the materials (at least one) whose diffraction it leaves out."""
    return f"Diffraction stays in Blender. The file has the base material of {', '.join(materials)}"


class GltfExport:
    """Hooks of io_scene_gltf2, which makes one of these for each export and hands its settings to all hooks.

    The exporter follows every node, and writes the first picture that it finds behind an emission. So the Diffraction
    nodes are muted while it reads the scene."""

    def __init__(self) -> None:
        self._names: dict[str, None] = {}

    def pre_export_hook(self, export_settings: dict[str, Any]) -> None:
        for node in (node for each in bpy.data.materials for node in diffraction_nodes(each) if not node.mute):
            node.mute = node[_MUTED] = True
        # If the export fails, no later hook is called. In background no timer runs, but handlers.py shows them again;
        # and as a module, Blender 4.5 with a timer that waits does not end.
        if has_window():
            bpy.app.timers.register(show_again)

    def gather_material_hook(self, written: Any, material: bpy.types.Material, export_settings: dict[str, Any]) -> None:
        if any(stored.flag(node, _MUTED) for node in diffraction_nodes(material)):
            self._names[material.name] = None

    def gather_gltf_hook(self, *read: Any) -> None:
        """The exporter has read the scene, and has not begun to write. The last argument is its settings."""
        show_again()
        if self._names:
            read[-1]["log"].warning(left_behind(list(self._names)), popup=True)


@guarded
def show_again() -> None:
    """Unmute the Diffraction nodes that an export has muted."""
    for node in (node for each in bpy.data.materials for node in diffraction_nodes(each)):
        if node.pop(_MUTED, False):
            node.mute = False


# Blender can be built without USD.
_USDHook: Any = getattr(bpy.types, "USDHook", object)


class UsdExport(_USDHook):  # type: ignore[misc]  # either class does
    """Leaves the MaterialX network of a material with diffraction out of a USD file. The file keeps the preview
    surface, which is made of the base's Principled node."""

    bl_idname = "natural_gratings_usd"
    bl_label = "Natural Gratings"

    @staticmethod
    def on_material_export(export_context: Any, bl_material: bpy.types.Material, usd_material: Any) -> bool:
        network = usd_material.GetSurfaceOutput("mtlx")
        if not network or not diffraction_nodes(bl_material):
            return True
        stage, prim = export_context.get_stage(), usd_material.GetPrim()
        prim.RemoveProperty(network.GetAttr().GetName())
        for child in prim.GetChildren():
            shader = child.GetAttribute("info:id").Get() or ""
            if child.GetTypeName() == "NodeGraph" or shader.startswith("ND_"):  # as MaterialX's own nodes are called
                stage.RemovePrim(child.GetPath())
        print(f"warning: {left_behind([bl_material.name])}")
        return True


def register() -> None:
    """Register the hook of USD. The hook of glTF is found by its name in the add-on's module."""
    if hasattr(bpy.types, "USDHook"):
        bpy.utils.register_class(UsdExport)


def unregister() -> None:
    """Undo register()."""
    if hasattr(bpy.types, "USDHook"):
        bpy.utils.unregister_class(UsdExport)

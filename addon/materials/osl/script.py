# SPDX-License-Identifier: GPL-3.0-or-later
"""A node group around a shader in Open Shading Language (Cycles on the CPU)."""

import os
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np

from ....precompute.base.failure import GratingError
from ...nodes.builder import Tree
from ...nodes.interface import Socket, add_interface, arrange
from ..response import ONE_RADIANCE, Response

GROUP_PREFIX = "Diffraction OSL"
# The bytes that need no escape in a path within a shader.
_PLAIN = frozenset(b"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789/._- ")
_PARTS = Path(__file__).resolve().parent


def script_group(name: str, text: str, inputs: tuple[Socket, ...]) -> Response:
    """The response of a shader's source, whose parameters are `inputs` in this order, and whose output is Radiance.

    Raises GratingError, and leaves nothing behind, if the shader does not compile (for example without OSL)."""
    title = f"{GROUP_PREFIX} {name}"
    group = bpy.data.node_groups.new(title, "ShaderNodeTree")
    add_interface(group, inputs, ONE_RADIANCE)
    tree = Tree(group)
    values = tree.inputs().values()
    script = tree.node("ShaderNodeScript", label=name)
    source = bpy.data.texts.new(f"{title}.osl")
    source.use_fake_user = False  # set on a new text; a purge of the file would leave it
    source.from_string(text)
    script.mode = "INTERNAL"
    script.script = source
    if not script.bytecode or len(script.inputs) != len(inputs):
        bpy.data.node_groups.remove(group)
        bpy.data.texts.remove(source)
        raise GratingError(title, "the shader does not compile", "choose Cycles as the renderer of a Blender with OSL")
    for socket, value in zip(script.inputs, values, strict=True):
        tree.feed(socket, value)
    tree.output(tree.value(script.outputs["Radiance"]))
    arrange(group)
    return Response(group)


def missing_for_osl(scene: bpy.types.Scene) -> str | None:
    """The remedy to show if a scene cannot run OSL shaders; else None."""
    if not bpy.app.build_options.cycles_osl:
        return "this Blender is built without Open Shading Language: use one from blender.org"
    if scene.render.engine != "CYCLES":
        return "choose Cycles as the renderer"
    if scene.cycles.device != "CPU":
        return "choose CPU as Cycles' device"
    if not scene.cycles.shading_system:
        return "switch on Cycles' Open Shading Language"
    return None


def joined(constants: dict[str, object], parts: Sequence[str]) -> str:
    """The joined source of .osl files in this folder, after definitions of the constants that they need."""
    lines = [f"#define {name} {value}" for name, value in constants.items()]
    return "\n".join([*lines, "", *((_PARTS / f"{part}.osl").read_text(encoding="utf-8") for part in parts)])


def file_name(path: Path) -> str:
    """A path as a string literal for a shader. Special bytes are escaped, so that no name can end the literal."""
    name = os.fsencode(path.absolute().as_posix())
    return '"' + "".join(chr(byte) if byte in _PLAIN else f"\\{byte:03o}" for byte in name) + '"'


def colours(values: np.ndarray) -> str:
    """Rows (n, 3) as the elements of an array of colours in a shader."""
    return ", ".join(f"color({r:.8g}, {g:.8g}, {b:.8g})" for r, g, b in values)

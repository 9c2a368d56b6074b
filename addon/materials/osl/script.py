# SPDX-License-Identifier: GPL-3.0-or-later
"""A node group around a shader in Open Shading Language (Cycles on the CPU)."""

import os
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np

from ....precompute.base.failure import GratingError
from ...nodes.arrange import arrange
from ...nodes.builder import Tree
from ...nodes.interface import Socket, add_interface
from ..response import ONE_RADIANCE, Response

GROUP_PREFIX = "Diffraction OSL"
# The bytes that stand for themselves in a path within a shader.
_PLAIN = frozenset(b"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789/._- ")
_PARTS = Path(__file__).resolve().parent


def script_group(name: str, text: str, inputs: tuple[Socket, ...]) -> Response:
    """The response of a shader's source. The shader's parameters are `inputs`, in that order; its output is Radiance.

    Raises GratingError, with nothing left behind, if it does not compile, which is so where Cycles has no OSL."""
    title = f"{GROUP_PREFIX} {name}"
    group = bpy.data.node_groups.new(title, "ShaderNodeTree")
    add_interface(group, inputs, ONE_RADIANCE)
    tree = Tree(group)
    values = tree.inputs().values()
    script = tree.node("ShaderNodeScript", label=name)
    source = bpy.data.texts.new(f"{title}.osl")
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
    """The remedy, in words to show, where something keeps a scene from running these shaders; else None."""
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
    """The source of some .osl files of this folder, after lines that define the constants which they leave open."""
    lines = [f"#define {name} {value}" for name, value in constants.items()]
    return "\n".join([*lines, "", *((_PARTS / f"{part}.osl").read_text(encoding="utf-8") for part in parts)])


def file_name(path: Path) -> str:
    """A path as a string literal of a shader. All but plain characters are written as the octal numbers of their
    bytes, so that no name ends the literal."""
    name = os.fsencode(path.absolute().as_posix())
    return '"' + "".join(chr(byte) if byte in _PLAIN else f"\\{byte:03o}" for byte in name) + '"'


def colours(values: np.ndarray) -> str:
    """Rows (n, 3) as the elements of an array of colours."""
    return ", ".join(f"color({r:.8g}, {g:.8g}, {b:.8g})" for r, g, b in values)

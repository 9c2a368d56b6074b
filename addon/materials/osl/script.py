# SPDX-License-Identifier: GPL-3.0-or-later
"""A node group around a shader in Open Shading Language (Cycles on the CPU)."""

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np

from ....precompute.base.failure import GratingError
from ...nodes.arrange import arrange
from ...nodes.builder import Tree
from ...nodes.interface import Socket, add_interface

GROUP_PREFIX = "Diffraction OSL"


_PARTS = Path(__file__).resolve().parent


_OUTPUTS = (Socket("Finer", "Color", "Radiance"),)


def script_group(name: str, text: str, inputs: tuple[Socket, ...]) -> bpy.types.NodeTree:
    """Node group around a shader's source: its parameters are the inputs, in their order, its output is Radiance.

    Raises GratingError, with nothing left behind, if it does not compile, as where Cycles has no OSL."""
    title = f"{GROUP_PREFIX} {name}"
    group = bpy.data.node_groups.new(title, "ShaderNodeTree")
    add_interface(group, inputs, _OUTPUTS)
    tree = Tree(group)
    values = [tree.value(socket) for socket in tree.node("NodeGroupInput").outputs[: len(inputs)]]
    script = tree.node("ShaderNodeScript", label=name)
    source = bpy.data.texts.new(f"{title}.osl")
    source.from_string(text)
    script.mode = "INTERNAL"
    script.script = source
    if not script.bytecode or len(script.inputs) != len(inputs):
        bpy.data.node_groups.remove(group)
        bpy.data.texts.remove(source)
        raise GratingError(f"{title}: the shader does not compile; choose Cycles as the renderer of a Blender with OSL")
    for socket, value in zip(script.inputs, values, strict=True):
        tree.feed(socket, value)
    tree.feed(tree.node("NodeGroupOutput").inputs[0], tree.value(script.outputs["Radiance"]))
    arrange(group)
    return group


def missing_for_osl(scene: bpy.types.Scene) -> str | None:
    """What keeps a scene from running these shaders, as a remedy to show; None where nothing does."""
    if not bpy.app.build_options.cycles_osl:
        return "this Blender is built without Open Shading Language: take one from blender.org"
    if scene.render.engine != "CYCLES":
        return "choose Cycles as the renderer"
    if scene.cycles.device != "CPU":
        return "choose CPU as Cycles' device"
    if not scene.cycles.shading_system:
        return "switch on Cycles' Open Shading Language"
    return None


def joined(constants: dict[str, object], parts: Sequence[str]) -> str:
    """The source of parts in addon/osl, behind the lines that define what they leave open."""
    lines = [f"#define {name} {value}" for name, value in constants.items()]
    return "\n".join([*lines, "", *((_PARTS / f"{part}.osl").read_text() for part in parts)])


def file_name(path: Path) -> str:
    """A path as a shader writes it."""
    return f'"{path.absolute().as_posix()}"'


def colours(values: np.ndarray) -> str:
    """Rows (n, 3) as the elements of an array of colours."""
    return ", ".join(f"color({r:.8g}, {g:.8g}, {b:.8g})" for r, g, b in values)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Giving an adopted grating the look of its material: what a further material then begins with."""

import json
from collections.abc import Callable, Mapping
from math import isfinite

import bpy

from ...precompute.presets.preset_hologram import PATTERNS, PresetHologram
from ...precompute.presets.presets import INPUTS
from ..gratings.grating import Grating
from ..gratings.own_names import was_own
from ..materials.holograms import patterns
from ..materials.holograms.hologram_nodes import hologram_of, input_set_by_artist
from ..materials.holograms.pattern_nodes import pattern_of
from ..materials.material import diffraction_nodes
from ..materials.skin import SETTABLE

# Digits of a number. Single precision, in which Blender stores it, has seven.
_DIGITS = 6


def take_look(grating: Grating, material: bpy.types.Material) -> None:
    """Set a grating's look from a material that shows it: the values of its Diffraction node, its pattern, and its base
    if the extension made the material. What a look cannot hold, such as a picture, is left out."""
    node = next((each for each in diffraction_nodes(material) if each.node_tree == grating.group), None)
    if node is None:
        return
    inputs = _changed(
        INPUTS,
        {name: socket.default for name, socket in SETTABLE.items()},
        lambda name: input_set_by_artist(node, name) if name in node.inputs else None,
    )
    grating.look.inputs = json.dumps(inputs, sort_keys=True) if inputs else ""
    _take_hologram(grating, hologram_of(node))
    if was_own(material):
        _take_base(grating, node)


def _take_hologram(grating: Grating, hologram: bpy.types.Node | None) -> None:
    pattern = "" if hologram is None else pattern_of(hologram.node_tree)
    name = pattern.lower()
    if hologram is None or name not in PATTERNS:
        grating.look.hologram = ""
        return
    defaults = {socket.name: socket.default for socket in patterns.INPUTS[pattern]}
    made = PresetHologram(name, _changed(PATTERNS[name], defaults, hologram.inputs.get))
    grating.look.hologram = json.dumps(made.as_dict(), sort_keys=True)


def _take_base(grating: Grating, node: bpy.types.Node) -> None:
    links = node.inputs["Base"].links if "Base" in node.inputs else ()
    base = links[0].from_node if links else None
    if base is None or base.type != "BSDF_PRINCIPLED":
        return
    colour, roughness = base.inputs["Base Color"], base.inputs["Roughness"]
    if not colour.is_linked:
        grating.look.base_color = colour.default_value[:3]
    if not roughness.is_linked:
        grating.look.base_roughness = roughness.default_value


def _changed(
    limits: Mapping[str, tuple[float, float]],
    defaults: Mapping[str, float | None],
    socket_of: Callable[[str], bpy.types.NodeSocket | None],
) -> dict[str, float]:
    """The numbers of the inputs in `limits` that are not the defaults."""
    found = {}
    for name, (low, high) in limits.items():
        value = getattr(socket_of(name), "default_value", None)  # an artist may have deleted the socket
        if isinstance(value, float) and isfinite(value) and low <= (shown := float(f"{value:.{_DIGITS}g}")) <= high:
            default = defaults[name]
            if default is None or shown != float(f"{default:.{_DIGITS}g}"):
                found[name] = shown
    return found

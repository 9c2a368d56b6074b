# SPDX-License-Identifier: GPL-3.0-or-later
"""The colours of a bake's channels under a lamp, by nodes that look up the table of lamps
(precompute/colour/lamp_table.py)."""

import hashlib
from collections.abc import Sequence

import bpy
import numpy as np

from ...precompute.colour.lamp_table import lamp_table, lamps_of_table
from ..blender import compat, stored
from ..lamps.lamp_spectrum import FURTHER_MAX, further_spectra
from ..nodes.builder import Tree, Value
from .gamut_nodes import shown_under_lamp
from .pictures import note_content, note_pictures, picture_of

# The label of the nodes that look up a table of lamps begins with this.
LABEL = "Lamp "
# Custom properties of a response's node group, saved in files: its bake's light, and what its table is made from.
_ILLUMINANT, _MADE_FOR = "ng_light_of_bake", "ng_lamps"
_ROWS = len(lamps_of_table()) + FURTHER_MAX


def renew_lamp_table(group: bpy.types.NodeTree | None) -> None:
    """Exchange the table of lamps of a response's node group if lamps have got spectra of other files."""
    if group is None:
        return
    illuminant = stored.text(group, _ILLUMINANT)
    nodes = [node for node in group.nodes if node.type == "TEX_IMAGE" and node.label.startswith(LABEL)]
    if not illuminant or group.library is not None or not nodes or nodes[0].image is None:
        return
    made = stored.text(group, _MADE_FOR)
    if made != (wanted := _content(illuminant)):
        image = lamp_table_image(illuminant)
        for node in nodes:
            node.image = image
        group[_MADE_FOR] = wanted
        note_pictures(group)


def note_lamp_table(group: bpy.types.NodeTree, illuminant: str) -> None:
    """Store which table of lamps a response's node group reads."""
    group[_ILLUMINANT], group[_MADE_FOR] = illuminant, _content(illuminant)


def _content(illuminant: str) -> str:
    """What the file's table of lamps for an illuminant is made from."""
    digest = hashlib.sha256("\n".join((illuminant, *further_spectra())).encode()).hexdigest()
    return f"lamps {compat.working_space()} {digest}"


def lamp_table_image(illuminant: str) -> bpy.types.Image:
    """The file's table of lamps for bakes under an illuminant, in the file's working space; created if needed."""
    content = _content(illuminant)
    if (present := picture_of(content)) is not None:
        return present
    table = lamp_table(compat.working_space(), illuminant, further_spectra())
    pixels = np.ones((_ROWS, table.shape[1], 4), np.float32)
    pixels[: len(table), :, :3] = table
    image = bpy.data.images.new("Lamp Spectra", table.shape[1], _ROWS, float_buffer=True, is_data=True)
    image.use_half_precision = False
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    note_content(image, content)
    return image


class LampColours:
    """The colours of channels under the lamp of a row."""

    def __init__(self, tree: Tree, image: bpy.types.Image, row: Value, triples: int):
        self.tree = tree
        count = 3 * triples + 1
        y = row.times_plus(1 / _ROWS, 0.5 / _ROWS)
        settings = {"image": image, "interpolation": "Closest", "extension": "EXTEND"}
        columns = []
        for column in range(count):
            place = tree.vector((column + 0.5) / count, y, 0.0)
            node = tree.node("ShaderNodeTexImage", place, label=f"{LABEL}{column}", **settings)
            columns.append(tree.value(node.outputs["Color"]))
        *self.columns, self.luminance = columns

    def shown(self, triples: Sequence[Value]) -> Value:
        """Linear RGB over the lamp's own, of channels that come in threes."""
        tree = self.tree
        split = [tree.node("ShaderNodeSeparateXYZ", triple).outputs for triple in triples]
        channels = [tree.value(socket) for sockets in split for socket in sockets]
        rgb = self.columns[0] * channels[0]
        for column, channel in zip(self.columns[1:], channels[1:], strict=True):
            rgb = column.times_plus(channel, rgb)
        return shown_under_lamp(tree, rgb, self.luminance)

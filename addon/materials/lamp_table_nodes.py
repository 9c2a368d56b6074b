# SPDX-License-Identifier: GPL-3.0-or-later
"""The colours of a bake's channels under a lamp, by nodes that look up the table of lamps
(precompute/colour/lamp_table.py)."""

import hashlib
from collections.abc import Iterable, Sequence

import bpy
import numpy as np

from ...precompute.colour.channels import channel_count
from ...precompute.colour.lamp_table import lamp_table, lamps_of_table
from ..blender import stored
from ..blender.working_space import working_space
from ..lamps.lamp_spectrum import FURTHER_MAX, further_spectra
from ..nodes.builder import Tree, Value
from .gamut_nodes import shown_under_lamp
from .pictures import fault_of, note_content, note_pictures

# The label of the nodes that look up a table of lamps begins with this.
LABEL = "Lamp "
# Custom properties of a table of lamps, saved in files: its bakes' light, and what it was made from.
_ILLUMINANT, _CONTENT = "ng_lamps_of", "ng_lamps"
_ROWS = len(lamps_of_table()) + FURTHER_MAX


def lamp_table_image(illuminant: str) -> bpy.types.Image:
    """The file's table of lamps for bakes under an illuminant, in the file's working space; created if needed."""
    for image in bpy.data.images:
        if stored.text(image, _ILLUMINANT) == illuminant and image.library is None and not fault_of(image):
            _renew(image, illuminant)
            return image
    columns = channel_count(illuminant) + 1
    image = bpy.data.images.new("Lamp Spectra", columns, _ROWS, float_buffer=True, is_data=True)
    image.use_half_precision = False
    image[_ILLUMINANT] = illuminant
    _renew(image, illuminant)
    return image


def renew_lamp_tables(groups: Iterable[bpy.types.NodeTree | None]) -> None:
    """Renew the tables of lamps of responses' node groups if lamps have got spectra of other files.

    The pictures stay the same data-blocks, because a handler may call this (workflow/handlers.py)."""
    own = {group: _tables_of(group) for group in filter(None, groups) if group.library is None}
    renewed = {image for image in set().union(*own.values()) if _renew(image, stored.text(image, _ILLUMINANT))}
    for group, images in own.items():
        if images & renewed:
            note_pictures(group)


def _tables_of(group: bpy.types.NodeTree) -> set[bpy.types.Image]:
    """The file's own tables of lamps that a node group looks up."""
    nodes = [node for node in group.nodes if node.type == "TEX_IMAGE" and node.label.startswith(LABEL)]
    found = {node.image for node in nodes if node.image is not None and node.image.library is None}
    return {image for image in found if stored.text(image, _ILLUMINANT)}


def _renew(image: bpy.types.Image, illuminant: str) -> bool:
    """Fill a table if the lamps of the file or its working space have changed. Return whether they have."""
    further, space = further_spectra(), working_space()
    digest = hashlib.sha256("\n".join((illuminant, *further)).encode()).hexdigest()
    content = f"lamps {space} {digest}"
    if stored.text(image, _CONTENT) == content:
        return False
    table = lamp_table(space, illuminant, further)
    if tuple(image.size) != (table.shape[1], _ROWS):  # another version of the extension made it
        return False
    pixels = np.ones((_ROWS, table.shape[1], 4), np.float32)
    pixels[: len(table), :, :3] = table
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    image.update()
    image[_CONTENT] = content
    note_content(image, content)
    return True


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

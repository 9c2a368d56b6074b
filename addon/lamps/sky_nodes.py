# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes that read a source of the scene's world (sky.py)."""

from ..nodes.builder import Tree
from .lamp_group import FAR, Light, read_number, read_property
from .sky import SPECTRUM, source_name


def source_light(tree: Tree, index: int, *, coloured: bool = False) -> Light:
    """Add nodes that read the world's source `index`. All values are 0 if it does not exist. `coloured`: it may be of
    another spectrum than white."""
    (direction, disc), (irradiance, shadow) = (
        read_property(tree, source_name(index, what)) for what in ("place", "power")
    )
    row = read_number(tree, source_name(index, SPECTRUM)) if coloured else None
    return Light(direction, irradiance, tree.maximum(-1.0 - disc, 0.0), FAR, shadow, spectrum=row)

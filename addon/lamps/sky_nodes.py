# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes that read a source of the scene's world (sky.py)."""

from ..nodes.builder import Tree
from .driven_nodes import read_property
from .lamp_group import FAR, Light
from .sky import source_name


def source_light(tree: Tree, index: int) -> Light:
    """Add nodes that read the world's source `index`. All values are 0 if it does not exist."""
    (direction, disc), (irradiance, shadow) = (
        read_property(tree, source_name(index, what)) for what in ("place", "power")
    )
    return Light(direction, irradiance, tree.maximum(-1.0 - disc, 0.0), FAR, shadow)

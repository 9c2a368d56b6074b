# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks for the light at a point: which rays see the diffraction, how sharply, and which lamps light it."""

from ..lamps.lamp_group import Light
from ..nodes.builder import Tree, Value

# The least roughness that rough reflections see. A CD over floors of roughness 0.02, 0.1 and 0.3 then has the light of
# All by Samples within 5 %, and a floor of 0.3 has no pixel brighter than 2.5 times its neighbours. With 0.2 the light
# is 10 % too bright, with 0.3 up to 9 % too dark, and sharp orders leave pixels of 10 times their neighbours.
ROUGHNESS = 0.25


def rays(tree: Tree) -> tuple[Value, Value]:
    """Two numbers about the ray: 1 if it must not see the diffraction, else 0; and the least roughness that it sees.

    The camera sees the diffraction as it is, also in mirrors and through clear glass. A rough reflection sees blurred
    colours: its random rays would find narrow orders by chance and leave white dots. How rough the reflection is, a
    material cannot know. Diffuse bounces and fog do not see the diffraction."""
    path = tree.outputs_of(tree.node("ShaderNodeLightPath"))
    glossy = path["Is Glossy Ray"]  # mirrors and glass included
    sharp = tree.math("GREATER_THAN", path["Is Singular Ray"], path["Diffuse Depth"])
    unseen = tree.math("LESS_THAN", path["Is Camera Ray"] + glossy, 0.5)
    return unseen, tree.math("GREATER_THAN", glossy, sharp) * ROUGHNESS


def is_lit(tree: Tree, light: Light, *, n: Value, cos_r: Value, unseen: Value) -> Value:
    """1 if the lamp and the viewer are above the surface, the lamp is on, and the ray may see the diffraction; else 0.

    The numbers are compared with `unseen`, which is 1 for rays that must not see it, as no cosine exceeds 1."""
    least = tree.minimum(tree.minimum(cos_r, tree.dot(light.direction, n)), tree.dot(light.irradiance, (1.0, 1.0, 1.0)))
    return tree.math("GREATER_THAN", least, unseen)

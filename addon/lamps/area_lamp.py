# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of an area lamp, which may be wide in the sky, by nodes.

The table shows each light as a round Gaussian, and the light of a wide lamp has the lamp's own shape. So each sample
takes a random point of the lamp, and leaves only a small variance to the table. The points fill a rectangle that is a
little smaller than the lamp, so that points and Gaussian together have the lamp's variance. A round lamp gets the
rectangle with its variances. Lamps of other kinds, and small area lamps, stay Gaussians, which have no noise.

The random points serve the table alone. Closures, which must not see what the table shows, get the whole lamp."""

from dataclasses import dataclass, replace

import bpy

from ..nodes.builder import Tree, Value
from ..nodes.interface import Socket
from .lamp_group import LAMP_INPUTS, LAMP_OUTPUTS, Light, group_of_lamp, light_from, shared_group, spectrum_of_lamp
from .light_linking import read_unlinked

# The variance in rad2 that is left to the table: that of a disc with a radius of 3 degrees. A larger one shows colours
# that are too pale, a smaller one is noisier.
LEFT = 0.0007
_NAME = "Lamp and Point"
_SEED = Socket("Seed", "Float", "Distinguishes the lamps' random points")
SHAPE = (
    Socket("Is Area", "Float", "1 for an area lamp, else 0"),
    Socket("Is Round", "Float", "1 for a round area lamp, else 0"),
    Socket("Away", "Vector", "To the lamp's centre, in metres"),
    Socket("Z", "Vector", "The lamp's z axis"),
    Socket("X", "Vector", "From an area lamp's centre to its edge, in metres"),
    Socket("Y", "Vector", "The same along the other side"),
)
_POINT = tuple(replace(socket, name=f"Point {socket.name}") for socket in LAMP_OUTPUTS)


@dataclass(frozen=True)
class WholeLamp(Light):
    """A lamp at the shaded point, with its shape if it is an area lamp.

    is_area, is_round  1 for an area lamp, and for a round one; else 0
    away               to the lamp's centre
    axes               an area lamp's z; x and y from its centre to its edges, or of a round lamp to those of the
                       rectangle with its variances"""

    is_area: Value
    is_round: Value
    away: Value
    axes: tuple[Value, Value, Value]

    def is_met(self, direction: Value) -> Value:
        """1 if a ray in a direction (a unit vector) meets an area lamp, else 0."""
        tree = direction.tree
        z, x, y = self.axes
        along = tree.math("DIVIDE", tree.dot(self.away, z), tree.dot(direction, z))
        beside = direction * along - self.away
        a, b = (tree.math("DIVIDE", tree.dot(beside, axis), tree.dot(axis, axis)) for axis in (x, y))
        a2, b2 = tree.squared(a), tree.squared(b)
        square = tree.maximum(a2, b2)
        # A disc of radius r has the variance of a square with half sides of sqrt(3) / 2 r.
        least = ((a2 + b2) * 0.75 - square).times_plus(self.is_round, square)
        return tree.math("LESS_THAN", least, 1.0) * tree.math("GREATER_THAN", along, 0.0)


def lamp_and_point(tree: Tree, index: int, linked: bool, *, coloured: bool = False) -> tuple[WholeLamp, Light]:
    """Add nodes for the scene's lamp `index`: the whole lamp, and the light that a sample takes from it. `linked`:
    apply light linking. `coloured`: see light_of."""
    outputs = group_of_lamp(tree, lamp_and_point_group(), index)
    tree.feed(outputs[_POINT[0].name].socket.node.inputs[_SEED.name], index + 1.0)
    light, point = (Light(*(outputs[socket.name] for socket in sockets)) for sockets in (LAMP_OUTPUTS, _POINT))
    if linked:
        light, point = (
            replace(each, irradiance=each.irradiance * (1.0 - read_unlinked(tree, index))) for each in (light, point)
        )
    is_area, is_round, away, *axes = (outputs[socket.name] for socket in SHAPE)
    held = light.direction, light.irradiance, light.variance, light.distance, light.casts_shadow
    shape = is_area, is_round, away, (axes[0], axes[1], axes[2])
    return WholeLamp(*held, *shape), replace(point, spectrum=spectrum_of_lamp(tree, index, coloured))


def lamp_and_point_group() -> bpy.types.NodeTree:
    """The file's group of a whole lamp and a point of it, created if needed."""
    return shared_group(_NAME, (*LAMP_INPUTS, _SEED), (*LAMP_OUTPUTS, *_POINT, *SHAPE), build=_add_both)


def _add_both(tree: Tree) -> None:
    """The nodes of the group."""
    *packed, seed = tree.inputs().values()
    place, disc, _, scales, z, rim, x, inner_rim = packed
    light = light_from(tree, packed, label="Lamp")
    is_area = tree.math("GREATER_THAN", rim, 1.5)
    is_round = tree.math("GREATER_THAN", inner_rim, 2.25) * is_area
    position = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Position"])
    y = tree.cross(tree.normalize(z), x) * tree.math("ABSOLUTE", scales)
    away = place - position
    left = tree.minimum(tree.dot(away, away) * LEFT, disc)
    size = tree.sqrt(tree.maximum(1.0 - tree.math("DIVIDE", left, disc), 0.0)) * is_area
    noise = tree.node("ShaderNodeTexWhiteNoise", position, seed, noise_dimensions="4D")
    split = tree.node("ShaderNodeSeparateXYZ", tree.value(noise.outputs["Color"]))
    a, b = (tree.value(split.outputs[axis]).times_plus(2.0, -1.0) * size for axis in "XY")
    # For a lamp of another kind, Cycles removes all that is multiplied by 0, and both lights are the same nodes.
    offset = tree.vector_math("SCALE", x, a) + tree.vector_math("SCALE", y, b)
    packed[:2] = place + offset, (left - disc) * is_area + disc
    point = light_from(tree, packed, label="Point")
    both = (light.direction, light.irradiance, light.variance, light.distance, light.casts_shadow), (
        point.direction, point.irradiance, point.variance, point.distance, point.casts_shadow,
    )  # fmt: skip
    tree.output(*both[0], *both[1], is_area, is_round, away, z, x, y)

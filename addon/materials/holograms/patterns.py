# SPDX-License-Identifier: GPL-3.0-or-later
"""The patterns of holograms and their inputs. The nodes are in hologram_nodes.py.

Saved .blend files contain the identifiers and the names of the inputs, so they must not change."""

from math import radians

from ...nodes.interface import Socket

NONE, DOT_MATRIX, SUNBURST, CRYSTAL, PICTURE = "NONE", "DOT_MATRIX", "SUNBURST", "CRYSTAL", "PICTURE"
# Identifier, label and tooltip, as in Blender's enumerations.
PATTERNS = (
    (NONE, "None", "Remove the hologram. The grating has one direction and one period again"),
    (DOT_MATRIX, "Dot Matrix", "Square cells, each with a direction and a period of its own, as on security holograms"),
    (SUNBURST, "Sunburst", "Lines that run around a centre as rings, or away from it as rays, as on gift wrap"),
    (CRYSTAL, "Crystal", "Shards like broken glass, each with a direction and a period of its own"),
    (PICTURE, "From Picture", "A picture's hue sets the direction, and its brightness sets the strength"),
)  # fmt: skip
LABELS = {name: label for name, label, _ in PATTERNS}

# What a hologram changes: these inputs of a Diffraction node, which are also inputs and outputs of each pattern.
CHANGED = ("Rotation", "Period Scale", "Strength")

ROTATION = Socket("Rotation", "Float", "Angle to which the hologram's turns are added", 0.0, -1e3, 1e3, "ANGLE")
PERIOD_SCALE = Socket(
    "Period Scale", "Float", "Hue by Period: the hologram multiplies it. Where the product p is above 1, light is "
    "missing where lamp and camera both lean far to the same side (|u| above 2 / p)", 1.0, 0.1, 10.0,
)  # fmt: skip
STRENGTH = Socket("Strength", "Float", "Strength of the diffraction, which the hologram dims", 1.0, 0.0, 1000.0)
VECTOR = Socket("Vector", "Vector", "UV coordinates: link a UV Map node")
ASPECT = Socket(
    "Aspect", "Float", "Height of the UV square on the surface, over its width; keeps cells square", 1.0, 0.001, 1000.0
)

CELLS = Socket("Cells", "Float", "Number of cells across the width of the UV square", 60.0, 1.0, 1e5)
TURN = Socket(
    "Turn", "Float", "Largest turn of a cell's direction to either side. 90 degrees: all directions",
    radians(90.0), 0.0, radians(90.0), "ANGLE",
)  # fmt: skip
SPREAD = Socket(
    "Period Spread", "Float", "Largest factor by which a cell's period is stretched or shrunk; 1: one period. "
    "Stretched cells are dark where lamp and camera both lean far to the same side", 1.3, 1.0, 4.0,
)  # fmt: skip
SEED = Socket("Seed", "Float", "Another number gives other random directions and periods", 0.0, 0.0, 1000.0)
TWIST = Socket(
    "Twist", "Float", "Angle from rings to rays. 0: the grating's lines are rings, 90 degrees: rays, between: spirals",
    0.0, radians(-90.0), radians(90.0), "ANGLE",
)  # fmt: skip
SECTORS = Socket(
    "Sectors", "Float", "Number of wedges, each with straight lines. 0: the direction turns smoothly", 0.0, 0.0, 1000.0
)
CENTER_X = Socket("Center X", "Float", "Centre of the sunburst along U", 0.5, -1e3, 1e3)
CENTER_Y = Socket("Center Y", "Float", "Centre of the sunburst along V", 0.5, -1e3, 1e3)
SHARDS = Socket("Shards", "Float", "Number of shards across the width of the UV square", 12.0, 0.1, 1e5)
RANDOMNESS = Socket(
    "Randomness", "Float", "0: the shards are squares, 1: as irregular as broken glass", 1.0, 0.0, 1.0, "FACTOR"
)
PICTURE_CELLS = Socket(
    "Cells", "Float", "Number of square cells across the width of the UV square, each with the colour of its centre. "
    "0: no cells", 0.0, 0.0, 1e5,
)  # fmt: skip
GREY_BELOW = Socket(
    "Grey Below", "Float", "Paler colours do not turn the direction, because their hue is mostly noise", 0.1, 0.0, 1.0,
    "FACTOR",
)  # fmt: skip
SATURATED_PERIOD = Socket(
    "Saturated Period", "Float", "Factor on the period where the picture's colour is pure; a grey keeps the period. "
    "Above 1, light is missing where lamp and camera both lean far to the same side", 1.0, 0.25, 4.0,
)  # fmt: skip

# The numbers that an artist sets on each pattern.
OWN_INPUTS: dict[str, tuple[Socket, ...]] = {
    DOT_MATRIX: (CELLS, TURN, SPREAD, SEED),
    SUNBURST: (TWIST, SECTORS, SPREAD, CENTER_X, CENTER_Y, SEED),
    CRYSTAL: (SHARDS, RANDOMNESS, TURN, SPREAD, SEED),
    PICTURE: (PICTURE_CELLS, GREY_BELOW, SATURATED_PERIOD),
}
INPUTS = {name: (VECTOR, *own, ASPECT, ROTATION, PERIOD_SCALE, STRENGTH) for name, own in OWN_INPUTS.items()}
OUTPUTS = (
    Socket("Rotation", "Float", "Link it to the Diffraction node's Rotation"),
    Socket("Period Scale", "Float", "Link it to the Diffraction node's Period Scale"),
    Socket("Strength", "Float", "Link it to the Diffraction node's Strength"),
)

# SPDX-License-Identifier: GPL-3.0-or-later
"""A piece of cork bark: half a tube with ridges and cracks along it, which lies on the soil."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import bpy
import numpy as np

from .noise import cracks, fractal_noise, value_noise
from .snake import plain_material
from .stage import add_surface, paint

_COLOURS = (
    (0.018, 0.008, 0.0045), (0.125, 0.066, 0.029), (0.23, 0.138, 0.062), (0.18, 0.15, 0.12), (0.14, 0.062, 0.026),
    (0.13, 0.065, 0.03), (0.036, 0.0175, 0.0125),
)  # fmt: skip
_CRACK, _PALE, _CREST, _GREY, _STAIN, _INSIDE, _SOIL = (np.array(colour) for colour in _COLOURS)
_ALONG, _AROUND = 360, 240


@dataclass(frozen=True)
class Placed:
    """A place on the floor in metres, a turn seen from above, a roll about the bark's own axis, and a depth to which it
    is sunk."""

    x: float
    y: float
    turn_deg: float
    roll_deg: float = 0.0
    sunk_m: float = 0.0


# At the front right of the hero picture, as on the photograph of a living animal: it hides the edge of one loop.
HERO = Placed(0.060, -0.114, 15.0, roll_deg=-4.0, sunk_m=0.008)


def add_bark(
    scene: bpy.types.Scene, placed: Placed = HERO, *, length_m: float = 0.25, radius_m: float = 0.05, seed: int = 4
) -> bpy.types.Object:
    """Add a piece of bark, with its hollow side down."""
    s, a = np.meshgrid(np.linspace(-1, 1, _ALONG), np.linspace(-1, 1, _AROUND), indexing="ij")
    # Places on the bark unrolled, in metres, and bent so that ridges wander.
    flat = np.stack([s * length_m / 2, a * radius_m * np.pi / 2], axis=-1)
    sway = [fractal_noise(flat / (0.06, 0.035), 4, seed + k) for k in range(2)]
    bent = flat + (0.02, 0.014) * np.stack(sway, axis=-1)
    relief, depth = _relief(bent, flat, seed)
    angle = a * (np.pi / 2) * (0.92 + 0.12 * fractal_noise(flat / (0.03, 1.0), 3, seed + 2))
    along = flat[..., 0] * (1 + 0.1 * s**4 * fractal_noise(flat / (1.0, 0.016), 3, seed + 3))
    bulge = 1 + 0.16 * fractal_noise(flat / 0.09, 2, seed + 4)
    thick = 0.008 + 0.002 * value_noise(flat / 0.02, seed + 5)
    skins = [_rolled(along, angle, radius_m * bulge + height) for height in (relief, relief * 0.3 - thick)]
    points = np.concatenate([skin.reshape(-1, 3) for skin in skins])
    points[:, 2] -= radius_m * 0.2 + placed.sunk_m
    bark = add_surface(scene, "Cork Bark", points, faces=_shell(_ALONG, _AROUND), material=_material())
    bark.data.shade_smooth()
    colours = np.concatenate([_colours(depth, flat, seed), np.broadcast_to(_INSIDE, (depth.size, 3))])
    paint(bark.data, "bark", colours, domain="POINT")
    bark.location = (placed.x, placed.y, 0.0)
    bark.rotation_euler = (radians(placed.roll_deg), 0.0, radians(placed.turn_deg))
    return bark


def _relief(bent: np.ndarray, flat: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """The height of the bark's ridges over its tube, in metres, and how deep a place lies, from 0 to 1."""
    deep, shallow, fine = (
        cracks(bent / (1e-3 * np.array(size)), width, seed + k)
        for k, (size, width) in enumerate((((70, 17), 0.16), ((40, 8), 0.25), ((12, 3.5), 0.4)), start=2)
    )
    lumps = fractal_noise(bent / (0.045, 0.014), 3, seed + 9)
    rough = fractal_noise(flat / (0.008, 0.003), 4, seed + 11)
    relief = 0.005 * lumps - 0.007 * deep - 0.0035 * shallow - 0.0009 * fine + 0.003 * rough
    depth = np.clip(0.34 + 0.9 * deep + 0.7 * shallow + 0.25 * fine - 0.35 * lumps - 0.7 * rough, 0, 1)
    return relief, depth


def _rolled(along: np.ndarray, angle: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Points (..., 3) on a tube about the x axis; angle 0 is its top."""
    return np.stack([along, radius * np.sin(angle), radius * np.cos(angle)], axis=-1)


def _shell(rows: int, columns: int) -> np.ndarray:
    """Quads of two grids of points, outer and inner, and of the rim that joins them."""
    index = np.arange(2 * rows * columns).reshape(2, rows, columns)
    outer, inner = (
        np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4) for grid in index
    )
    edge = [
        np.concatenate([grid[0, :-1], grid[:-1, -1], grid[-1, :0:-1], grid[:0:-1, 0], grid[:1, 0]]) for grid in index
    ]
    rim = np.stack([edge[0][:-1], edge[0][1:], edge[1][1:], edge[1][:-1]], axis=-1)
    return np.concatenate([outer, inner[:, ::-1], rim])


def _colours(depth: np.ndarray, flat: np.ndarray, seed: int) -> np.ndarray:
    """Colours (n, 3): dark cracks, pale crests, grey and brown patches, soil in hollows."""
    shade = np.clip(depth + 0.12 * fractal_noise(flat / 0.008, 3, seed + 12), 0, 1)[..., None]
    colour = np.where(
        shade < 0.45, _CREST + (_PALE - _CREST) * shade / 0.45, _PALE + (_CRACK - _PALE) * (shade - 0.45) / 0.55
    )
    for tint, seed_of_patch, least in ((_GREY, 13, 0.2), (_STAIN, 16, 0.15)):
        patch = np.clip(3 * (fractal_noise(flat / (0.05, 0.02), 4, seed + seed_of_patch) - least), 0, 0.8)[..., None]
        colour = colour + (tint * (1.2 - shade) - colour) * patch
    # Soil lies in the hollows.
    soiled = (
        np.clip(4 * (shade - 0.62), 0, 0.9) * np.clip(0.6 + 2 * value_noise(flat / 0.03, seed + 19), 0, 1)[..., None]
    )
    return (colour + (_SOIL - colour) * soiled).reshape(-1, 3)


def _material() -> bpy.types.Material:
    """The colours of the mesh, with a fine grain as bumps."""
    material = plain_material("Cork Bark", tuple(_PALE), 0.9, specular=0.15)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = nodes["Principled BSDF"]
    colour, grain, where, squeezed, bump = (
        nodes.new(f"ShaderNode{kind}") for kind in ("VertexColor", "TexNoise", "TexCoord", "VectorMath", "Bump")
    )
    colour.layer_name = "bark"
    links.new(colour.outputs["Color"], shader.inputs["Base Color"])
    # Growth lines run across the ridges.
    squeezed.operation, squeezed.inputs[1].default_value = "MULTIPLY", (900.0, 200.0, 200.0)
    links.new(where.outputs["Object"], squeezed.inputs[0])
    links.new(squeezed.outputs["Vector"], grain.inputs["Vector"])
    grain.inputs["Scale"].default_value, grain.inputs["Detail"].default_value = 1.0, 4.0
    bump.inputs["Distance"].default_value, bump.inputs["Strength"].default_value = 0.0008, 0.8
    links.new(grain.outputs[0], bump.inputs["Height"])
    links.new(bump.outputs["Normal"], shader.inputs["Normal"])
    return material

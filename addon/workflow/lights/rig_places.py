# SPDX-License-Identifier: GPL-3.0-or-later
"""What a light rig lights, and the directions of lamps that the camera alone decides."""

import math
from dataclasses import dataclass

import numpy as np

from ...cameras.seen_surfaces import Pixels, Places

# The angle between a flash and the camera's lens, seen from the middle.
_BESIDE_LENS = math.radians(8)


@dataclass(frozen=True)
class Lit:
    """What a rig lights: places that the camera sees, their middle in world space, and the radius of their objects."""

    places: list[Places]
    middle: np.ndarray
    radius: float


def to_view(lit: Lit) -> np.ndarray:
    """The unit vector (3,) from the middle to the viewer."""
    mean = np.concatenate([each.to_view for each in lit.places]).mean(axis=0)
    return mean / max(np.linalg.norm(mean), 1e-9)


def beside_camera(pixels: Pixels, lit: Lit, key: np.ndarray) -> np.ndarray:
    """The direction of a fill: from above the camera and beside it, on the side away from the key."""
    side = -1.0 if key @ pixels.right > 0 else 1.0
    return above_floor(to_view(lit) + 0.4 * side * pixels.right + 0.3 * pixels.up)


def across(pixels: Pixels, lit: Lit, key: np.ndarray) -> np.ndarray:
    """The direction of a bounce: the key's, mirrored to the other side of the picture, at least 40 degrees from its
    middle."""
    sideways = key @ pixels.right
    side = -1.0 if sideways > 0 else 1.0
    level = key - sideways * pixels.right
    level = level / max(np.linalg.norm(level), 1e-9)
    least = math.sin(math.radians(40))
    sideways = max(abs(sideways), least)
    return above_floor(side * sideways * pixels.right + math.sqrt(max(1 - sideways**2, 0.0)) * level)


def beside_lens(pixels: Pixels, lit: Lit) -> np.ndarray:
    """The directions (3, 3) of a flash to the right of the lens, to its left and above it."""
    axis = to_view(lit)
    sides = np.stack([pixels.right, -pixels.right, pixels.up])
    sides = sides - (sides @ axis)[:, None] * axis
    sides = sides / np.maximum(np.linalg.norm(sides, axis=1, keepdims=True), 1e-9)
    return math.cos(_BESIDE_LENS) * axis + math.sin(_BESIDE_LENS) * sides


def above_floor(direction: np.ndarray) -> np.ndarray:
    """A unit vector (3,) near a direction, at least 5 degrees above the horizon."""
    direction = direction / max(np.linalg.norm(direction), 1e-9)
    raised = np.array([*direction[:2], max(direction[2], math.sin(math.radians(5)))])
    return raised / np.linalg.norm(raised)

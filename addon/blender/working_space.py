# SPDX-License-Identifier: GPL-3.0-or-later
"""The file's working space and its view transform, whose names differ between colour configurations."""

from functools import cache

import bpy
import numpy as np
from mathutils import Color

# The largest difference of two matrices to XYZ that are of one space. Spaces of other primaries differ by 0.07.
_SAME = 0.005
# View transforms that keep saturated colours, the best first; the last is that of ACES. Khronos's keeps the hue too.
_PURE = ("Khronos PBR Neutral", "Standard", "Un-tone-mapped")


def working_space() -> str:
    """The working space, named as in precompute.colour; the nearest of these if it is none of them."""
    return _nearest()[0]


def unknown_space() -> list[str]:
    """One warning line if the working space is none that precompute.colour knows."""
    name, difference = _nearest()
    if difference < _SAME:
        return []
    known = ", ".join(_to_xyz())
    return [f"The working space is none of {known}: the colours are of {name}. Choose another colour configuration"]


def _nearest() -> tuple[str, float]:
    """The known space that is nearest to the working space, and the largest difference of their matrices to XYZ."""
    own = np.array([Color(primary).from_scene_linear_to_xyz_d65() for primary in np.eye(3).tolist()]).T
    differences = {name: float(np.abs(matrix - own).max()) for name, matrix in _to_xyz().items()}
    name = min(differences, key=differences.__getitem__)
    return name, differences[name]


@cache
def _to_xyz() -> dict[str, np.ndarray]:
    """The matrix (3, 3) of each known space from linear RGB to XYZ, whose white is that of D65."""
    from ...precompute.colour.observer import white_xyz
    from ...precompute.colour.spaces import RGB_SPACES, adapted_matrix

    return {name: np.linalg.inv(adapted_matrix(name, white_xyz())) for name in RGB_SPACES}


def show_pure_colours(scene: bpy.types.Scene) -> str:
    """Choose a view transform that keeps saturated colours. Returns its name; "" if the colour configuration has
    none, and then nothing changes."""
    for name in _PURE:
        try:
            scene.view_settings.view_transform = name  # type: ignore[assignment]  # the stubs list no names
            return name
        except TypeError:
            continue
    return ""

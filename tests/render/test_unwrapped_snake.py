# SPDX-License-Identifier: GPL-3.0-or-later
"""A snake unwrapped by xatlas keeps its colours, combed or not; with the new map's own tangents it would not."""

import bpy
import numpy as np
import pytest

from precompute.colour.spaces import delta_e_2000, lab, rgb_from_xyz

from .test_radiance import assign

PIXELS = 320
XYZ_FROM_RGB = np.linalg.inv(rgb_from_xyz("Rec.709"))


def p95_of_colours(picture, wanted):
    """The 95th percentile of the CIEDE2000 between two pictures, at the exposure that puts the 99th percentile of the
    wanted one at white, where the brighter luminance is between 1/500 of white and white."""
    wanted, picture = wanted @ XYZ_FROM_RGB.T, picture @ XYZ_FROM_RGB.T
    lit = wanted[..., 1] > 0
    level = np.percentile(wanted[lit][:, 1], 99)
    brighter = np.maximum(wanted[..., 1], picture[..., 1]) / level
    counted = (brighter > 0.002) & (brighter < 1)
    assert counted.sum() > 1500
    white = XYZ_FROM_RGB.sum(axis=1)
    found = delta_e_2000(*(lab(each[counted] / level, white) for each in (wanted, picture)))
    return np.percentile(found, 95)


@pytest.mark.night("tests/addon/workflow/test_unwrapping.py")
def test_an_unwrap_keeps_the_colours_and_the_new_map_s_tangents_do_not(stage, skin):
    bpy.ops.grating.add_snake(species="ELAPHE", pose="COILED", length_m=1.0, faces=11_000)
    snake = bpy.context.object
    corners = np.array([snake.matrix_world @ vertex.co for vertex in snake.data.vertices])
    middle = (corners.max(axis=0) + corners.min(axis=0)) / 2
    width = (corners.max(axis=0) - corners.min(axis=0))[:2].max()
    stage.camera((middle[0], middle[1] - 1e-3, 2), tuple(middle), ortho=float(width) * 0.8)
    stage.lamp("SUN", to=(-0.4, 0.5, 1.0), energy=2.0, angle=0.05, name="Sun")
    stage.lamp("SUN", to=(0.6, 0.4, 0.8), energy=2.0, angle=0.05, name="Second Sun")
    snake.data.materials.clear()  # the pattern of its skin lies on its UV map
    assign(stage, snake, skin[0])
    pictures = {"uv": stage.rgb("cycles", PIXELS, name="uv")}
    assert bpy.ops.grating.unwrap(size=1024) == {"FINISHED"}
    snake.data.uv_layers["Unwrapped"].active_render = True
    pictures["kept"] = stage.rgb("cycles", PIXELS, name="kept")
    snake.data.uv_layers["UVMap"].active_render = True
    bpy.ops.grating.direction(kind="STORED")
    assert bpy.ops.grating.comb(source="COPY") == {"FINISHED"}
    assert bpy.ops.grating.unwrap(size=1024) == {"FINISHED"}
    snake.data.uv_layers["Unwrapped.001"].active_render = True
    pictures["combed, unwrapped"] = stage.rgb("cycles", PIXELS, name="combed_unwrapped")
    bpy.ops.grating.direction(kind="UV_MAP", uv_map="Unwrapped")
    pictures["naive"] = stage.rgb("cycles", PIXELS, name="naive")
    found = {name: p95_of_colours(picture, pictures["uv"]) for name, picture in pictures.items()}
    print(found)
    assert found["kept"] <= 2
    assert found["combed, unwrapped"] <= 2
    assert found["naive"] > 10

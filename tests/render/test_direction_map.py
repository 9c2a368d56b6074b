# SPDX-License-Identifier: GPL-3.0-or-later
"""A direction map's picture of a grating compared with that of the source from which it was baked, in both engines."""

import bpy
import numpy as np
import pytest

from .lamp_scenes import ENGINES
from .test_radiance import assign, lamps, relative_error

PIXELS = 160


@pytest.mark.short("STORED-cycles")
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("kind", ["STORED", "RADIAL"])
def test_a_frame_map_shows_the_colours_of_its_source(stage, baked, kind, engine):
    """On a torus, for U of its UV map and for an axis. The map lies on a second UV map with rotated islands. The median
    error must stay below 1 % of the radiance; the blazed grating changes by that much within a degree."""
    bpy.ops.mesh.primitive_torus_add(
        major_segments=96, minor_segments=48, major_radius=0.7, minor_radius=0.3, generate_uvs=True
    )
    bpy.ops.object.shade_smooth()
    mesh = bpy.context.object
    stage.camera((0.0, -1.6, 2.4), angle=np.radians(40))
    lamps(stage, "two")
    stage.lamp("SUN", to=(-0.5, -0.4, 0.8), energy=2.0, angle=0.2, name="Second Sun")
    assign(stage, mesh, baked[0])
    bpy.ops.grating.direction(kind=kind)
    before = stage.rgb(engine, PIXELS)
    bpy.ops.grating.unwrap(size=512, padding=8)
    if kind == "STORED":
        assert stage.scene.natural_gratings.active().frame_kind == "UV_MAP"
    told = stage.addon.combing.bake_direction_map(bpy.context, mesh, uv_map="Unwrapped", size=512)
    assert len(told) == 1 and stage.scene.natural_gratings.active().frame_kind == "FRAME_MAP"
    error = relative_error(stage.rgb(engine, PIXELS), before)
    print(f"{kind} {engine}: median {np.median(error):.2%}, p95 {np.percentile(error, 95):.2%}")
    assert np.median(error) < 0.01
    # The new map's own tangents give another picture; otherwise this test would prove nothing.
    bpy.ops.grating.direction(kind="UV_MAP", uv_map="Unwrapped")
    assert np.median(relative_error(stage.rgb(engine, PIXELS), before)) > 0.1

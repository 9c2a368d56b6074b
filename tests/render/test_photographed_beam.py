# SPDX-License-Identifier: GPL-3.0-or-later
"""The laboratory of the thesis's photographs in Cycles: a Diffraction Lamp throws on its screen the picture that
./dev bench photographs computes and measures."""

import bpy
import numpy as np

from laboratory.benchmarks.photographs_screen import Laboratory, picture

from .test_diffraction_lamp import add_diffraction_lamp, add_lit, close, white

PIXELS, WIDTH_M = 160, 0.13
DRAWN = Laboratory()
DISTANCE_M = DRAWN.distance_mm * 1e-3
TO_LIGHT, REFLECTED = (np.array([side * np.sqrt(0.5), 0, np.sqrt(0.5)]) for side in (1, -1))


def test_a_screen_across_the_beam_shows_the_computed_picture(stage, skin):
    path, table = skin
    bpy.ops.mesh.primitive_plane_add(
        size=2 * WIDTH_M, location=DISTANCE_M * REFLECTED, rotation=(0, -np.radians(DRAWN.angle_deg), 0)
    )
    bpy.context.object.data.materials.append(white(stage, "Screen"))
    camera = stage.camera(0.5 * DISTANCE_M * REFLECTED, DISTANCE_M * REFLECTED, ortho=WIDTH_M)
    camera.rotation_euler = (0, np.radians(180 - DRAWN.angle_deg), 0)  # upright along the skin's y
    stage.scene.cycles.max_bounces = 0
    # The computed picture has a lamp with the kernel's variance, which is sin(angle / 2)^2 / 4.
    angle = 2 * np.arcsin(2 * np.sqrt(table.kernel_variance))
    add_lit(stage, path, {"kind": "SUN", "to": tuple(TO_LIGHT), "energy": 1000.0, "angle": angle})
    add_diffraction_lamp()
    # The camera looks away from the skin, so right and left are exchanged.
    found = stage.rgb(pixels=PIXELS)[:, ::-1]
    middle = (PIXELS - 1) / 2
    wanted = picture(table, DRAWN, (PIXELS, PIXELS), beam=(middle, middle), mm_per_pixel=1e3 * WIDTH_M / PIXELS)
    # The computed picture has no scale. The rest is bounded as on the screens of test_diffraction_lamp.py.
    close(found, wanted * found.sum() / wanted.sum())

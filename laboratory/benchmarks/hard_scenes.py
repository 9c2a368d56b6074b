# SPDX-License-Identifier: GPL-3.0-or-later
"""Hard cases in a scene: places where the pixel footprint or a lamp's direction is at the end of its range."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .studio import Studio

PIXELS, SAMPLES, SEEDS = 16, 64, 64


@dataclass(frozen=True)
class SceneCase:
    """A scene, and the function that describes its picture."""

    name: str
    asked: str
    outcome: Callable[[Studio], str]


def both(studio: Studio) -> tuple[np.ndarray, np.ndarray]:
    """Pictures by Cycles without and with the footprint."""
    pictures = []
    for footprint in (False, True):
        studio.show(studio.direct(footprint=footprint))
        pictures.append(studio.render(SAMPLES))
    return pictures[0], pictures[1]


def from_afar(studio: Studio, scale: float) -> str:
    """Compare the ball's light with the footprint, `scale` units across the picture and averaged over SEEDS seeds, with
    its light in a close-up without the footprint."""
    camera, cycles = studio.scene.camera.data, studio.scene.cycles
    studio.show(studio.direct())
    camera.ortho_scale = 2.1
    near = studio.render(4 * SAMPLES, 8 * PIXELS).mean() * camera.ortho_scale**2
    studio.show(studio.direct(footprint=True))
    camera.ortho_scale = scale
    found = []
    for cycles.seed in range(SEEDS):
        found.append(studio.render(SAMPLES))
    cycles.seed = 0
    light = np.mean(found, axis=(1, 2, 3)) * scale**2 / near
    return (
        f"{'finite' if np.isfinite(found).all() else 'NOT FINITE'}; light {light.mean():.3f} +- "
        f"{light.std() / SEEDS**0.5:.3f} of a close-up's"
    )


def compared(without: np.ndarray, with_it: np.ndarray) -> str:
    """The largest difference relative to the largest value, the ratio of light, and whether all values are finite."""
    finite = bool(np.isfinite(with_it).all() and (with_it >= 0).all())
    apart = float(np.abs(with_it - without).max() / without.max())
    return f"{'finite' if finite else 'NOT FINITE'}; apart {apart:.1e}; light {with_it.mean() / without.mean():.3f}"


def close(studio: Studio) -> str:
    """A pixel a ten-millionth of the ball's radius wide, at the sun's mirror image."""
    studio.build()
    camera = studio.scene.camera
    turn = np.radians(40)
    aside = np.array([0.0, np.sin(turn), np.cos(turn)])
    camera.location = tuple(aside * 3)
    camera.rotation_euler = (-turn, 0, 0)
    camera.data.ortho_scale = PIXELS * 1e-7
    return compared(*both(studio))


def flat(studio: Studio) -> str:
    """A disc, whose normal is constant."""
    build_disc(studio)
    return compared(*both(studio))


def spike(studio: Studio) -> str:
    """A ball stretched to a needle: its normals turn by half a circle within a tenth of a pixel."""
    studio.build()
    studio.mesh.scale = (0.02, 0.02, 1.0)
    studio.mesh.rotation_euler = (0.9, 0.0, 0.0)
    return from_afar(studio, PIXELS * 0.4)


def ball(studio: Studio) -> str:
    """A ball one pixel wide."""
    studio.build()
    return from_afar(studio, PIXELS * 2.0)


def at_the_horizon(studio: Studio) -> str:
    """A disc under a sun a thousandth of a degree above and below its horizon."""
    import bpy

    found = []
    for elevation in (1e-3, -1e-3):
        build_disc(studio)
        studio.show(studio.direct())
        next(o for o in bpy.data.objects if o.type == "LIGHT").rotation_euler = (np.radians(90 - elevation), 0, 0)
        bpy.context.view_layer.update()
        studio.addon.follow.follow_lamps(studio.scene)
        picture = studio.render(SAMPLES)
        found.append(f"{'finite' if np.isfinite(picture).all() else 'NOT FINITE'}, brightest {picture.max():.1e}")
    return f"above: {found[0]}; below: {found[1]}"


def shows_nothing(studio: Studio) -> str:
    """Needs are requested while the camera looks away."""
    import bpy

    studio.build()
    studio.show(studio.metal())
    scene, addon = studio.scene, studio.addon
    grating = addon.importing.add_grating(scene, "sample:elaphe")
    grating.bake_path = str(studio.bake)
    addon.assigning.add_to_meshes(scene, [studio.mesh])
    scene.camera.rotation_euler = (np.pi, 0, 0)
    bpy.context.view_layer.update()
    try:
        addon.measuring_needs.measure_needs(scene, grating)
    except addon.child.GratingError as refusal:
        return f"refused: {refusal}"
    return "NOT REFUSED"


def build_disc(studio: Studio) -> None:
    """Build the ball pressed flat."""
    studio.build()
    mesh = studio.mesh.data
    points = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", points)
    points[2::3] = 0.0
    mesh.vertices.foreach_set("co", points)
    mesh.shade_flat()


CASES = (
    SceneCase("footprint of nothing", "a pixel of a ten-millionth of a ball's radius, with and without", close),
    SceneCase("footprint of a flat thing", "a disc, with and without", flat),
    SceneCase("curvature of a spike", "a needle, a tenth of a pixel wide", spike),
    SceneCase("all normals in one pixel", "a ball of a pixel", ball),
    SceneCase("lamp at the horizon", "0.001 degrees above and below", at_the_horizon),
    SceneCase("needs of a scene that shows nothing", "the camera looks away", shows_nothing),
)


def outcomes() -> list[tuple[SceneCase, str]]:
    """Each case with the description of its picture."""
    with tempfile.TemporaryDirectory() as folder:
        studio = Studio.started(Path(folder), PIXELS)
        return [(case, case.outcome(studio)) for case in CASES]

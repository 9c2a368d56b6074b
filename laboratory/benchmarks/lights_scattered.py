# SPDX-License-Identifier: GPL-3.0-or-later
"""The noise of the scattered light alone, relative to its own mean, for `./dev bench lights --part scattered`.

The snake has a black skin and stands alone over black. One picture shows only its scattered light, by *Sources and
Rest*. The other shows only an ordinary coat of IOR 1.56 and roughness 0.3, which also reflects. For each picture the
RMSE is taken against its own picture of many samples, relative to that picture's mean and times the square root of the
processor time. In the whole picture both noises are small beside the skin.
"""

import argparse

from . import lights_scenes as scenes
from . import report
from .lights_truth import scattering_bake
from .lights_worlds import SURFACES, Worlds


def scattered(studio: Worlds, arguments: argparse.Namespace) -> list[dict]:
    """A row for each world and surface."""
    rows = []
    report.say(f"{'world':14}{'surface':22}{'coat':>8}{'scattered':>11}{'to coat':>9}", arguments.json)
    bakes = [(name, scattering_bake(studio, bake)) for name, bake in studio.bakes(arguments.surface or SURFACES)]
    for world in arguments.world or scenes.WORLDS:
        scenes.build(studio, "snake")
        scenes.light_by(studio, world)
        coat = _figure(studio, "coat")
        for name, bake in bakes:
            found = _figure(studio, "REST", bake)
            rows.append({"world": world, "surface": name, "coat": coat, "scattered": found, "to_coat": found / coat})
            report.say(f"{world:14}{name:22}{coat:8.3f}{found:11.3f}{found / coat:9.2f}", arguments.json)
    return rows


def _figure(studio: Worlds, name: str, bake=None) -> float:
    """The RMSE relative to the mean, times the square root of the microseconds per sample of a pixel."""
    skin = studio.dress(name, bake)
    skin.inputs["Base Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    found = studio.noise()
    return found["rmse"] / found["mean"] * found["us"] ** 0.5

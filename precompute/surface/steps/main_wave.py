# SPDX-License-Identifier: GPL-3.0-or-later
"""The grating of a scan, for steps that need one."""

from ...base.failure import GratingError
from ..height_map import HeightMap
from ..levelling import level_plane
from ..periods import Wave, waves_of


def main_wave(height_map: HeightMap, step: str) -> Wave:
    """The wave that sends out the most light. Raises GratingError, naming the step, where there is none."""
    gratings = waves_of(level_plane(height_map)).gratings
    if not gratings:
        raise GratingError(f"{height_map.source}: {step}: no grating stands out of the scan; leave {step} out")
    return gratings[0]

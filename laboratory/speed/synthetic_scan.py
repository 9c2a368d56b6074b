# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake of a synthetic scan of any size. It runs in a process of its own, so that the peak of memory is the bake's:

    python -m laboratory.speed.synthetic_scan PIXELS [DELTA_E]

It prints a SizeResult as one line of JSON.
"""

import json
import math
import sys
from dataclasses import asdict

import numpy as np

from precompute.bake.make import make, peak_bytes
from precompute.bake.request import BakeRequest
from precompute.surface.relief import Relief

from .result import SizeResult

PIXEL_M = 48e-9
# Like a shed skin: ridges of 1.15 um that wander, 80 nm from trough to crest, on a rough ground of 15 nm rms.
_PERIOD_M, _RIDGE_M, _GROUND_M = 1.15e-6, 40e-9, 15e-9
# Correlation of the ground, and of the ridges' phase, from one row to the next.
_KEPT, _WANDERING_KEPT = 0.9, 0.999
_GROUND_PIXELS = 4


def synthetic_scan(pixels: int, seed: int = 0) -> Relief:
    """A rough skin-like surface (pixels, pixels). It is made row by row, in no more memory than its heights take."""
    rng = np.random.default_rng(seed)
    reach = np.arange(-3 * _GROUND_PIXELS, 3 * _GROUND_PIXELS + 1)
    smooth = np.exp(-0.5 * (reach / _GROUND_PIXELS) ** 2)
    smooth /= math.sqrt(np.sum(smooth**2))
    height = np.empty((pixels, pixels))
    phase = 2 * np.pi * PIXEL_M / _PERIOD_M * np.arange(pixels)
    ground, wandering = np.zeros(pixels), 0.0
    for row in height:
        noise = np.convolve(rng.standard_normal(pixels + len(smooth) - 1), smooth, "valid")
        ground = _KEPT * ground + math.sqrt(1 - _KEPT**2) * noise
        wandering = _WANDERING_KEPT * wandering + math.sqrt(1 - _WANDERING_KEPT**2) * rng.standard_normal()
        row[:] = _RIDGE_M * np.cos(phase + 2 * wandering) + _GROUND_M * ground
    height -= height.mean()
    edge = np.hanning(pixels + 2)[1:-1]
    return Relief(height, (edge, edge), (PIXEL_M, PIXEL_M), periodic=False)


def measure_bake(pixels: int, delta_e: float) -> SizeResult:
    """Bake pixels x pixels and tell what it took."""
    relief = synthetic_scan(pixels)
    before = peak_bytes()
    made = make([relief], BakeRequest(delta_e))
    return SizeResult(
        pixels=pixels,
        input_bytes=relief.height_m.nbytes,
        seconds=made.seconds,
        check_seconds=made.check_seconds,
        beyond_input_bytes=None if before is None else peak_bytes() - before,
        delta_e_p99=made.errors.p99,
    )


if __name__ == "__main__":
    measured = measure_bake(int(sys.argv[1]), float(sys.argv[2]) if len(sys.argv) > 2 else 1.0)
    print(json.dumps(asdict(measured)))

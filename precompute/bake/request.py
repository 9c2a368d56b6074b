# SPDX-License-Identifier: GPL-3.0-or-later
"""What is asked of a bake."""

from dataclasses import dataclass

from .needs import EVERYTHING, Needs


@dataclass(frozen=True)
class BakeRequest:
    """What is asked of a bake. `delta_e` is the 99th percentile of CIEDE2000; a coherence length of None is auto, under
    the patch model the thesis's."""

    delta_e: float = 1.0
    coherence_length_m: float | None = None
    illuminant: str = "D65"
    needs: Needs = EVERYTHING
    model: str = "ensemble"


MODELS = "ensemble", "patch"

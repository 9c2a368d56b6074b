# SPDX-License-Identifier: GPL-3.0-or-later
"""The colour errors that a bake states, in the words of the panel, the verbs and the pages."""

import math
from collections.abc import Mapping
from typing import Any


def stated_errors(delta_e: Mapping[str, Any]) -> list[str]:
    """The lines on the CIEDE2000 that a bake keeps in 99 % of the directions: under lamps as small as the sun, which
    the request limits, and under large ones. An error that the bake did not measure has no line."""
    errors = {"small": delta_e.get("p99_most"), "large": delta_e.get("wide_p99_most")}
    return [
        f"colour error up to {math.ceil(100 * error) / 100:.2f} under {size} lamps"
        for size, error in errors.items()
        if isinstance(error, (int, float)) and math.isfinite(error)
    ]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Where colours that are finer than a pixel are blurred to its size."""

import bpy

IN_CYCLES, ALWAYS, NEVER = "CYCLES", "ALWAYS", "NEVER"
FOOTPRINT = (
    (IN_CYCLES, "In Cycles", "Less noise, for a tenth more time. EEVEE compiles it for long, so it has none"),
    (ALWAYS, "Always", "Less flicker in EEVEE too, which compiles the material for much longer"),
    (NEVER, "Never", "For discs and close-ups, where a pixel shows one colour"),
)


def footprint_counts(choice: str) -> bool:
    """Whether the footprint counts by a choice, in the engines that the file's scenes have."""
    return choice == ALWAYS or (choice == IN_CYCLES and any(s.render.engine == "CYCLES" for s in bpy.data.scenes))

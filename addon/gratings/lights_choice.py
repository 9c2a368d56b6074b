# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lights the diffraction shows. Saved .blend files contain these names, so they must not change."""

LAMPS_ONLY, REST, ALL = "LAMPS", "REST", "ALL"
# Identifier, label and tooltip, as in Blender's enumerations.
LIGHTS = (
    (REST, "Lamps and World", "Lamps and bright spots of the world light it without noise. The rest of the world and "
     "other objects light it with noise. Without lamps, the world lights it alone"),
    (LAMPS_ONLY, "Lamps Only", "The lamps light it with next to no noise. The world and other objects have no effect. "
     "Without lamps the diffraction is black"),
    (ALL, "All by Samples", "Every light comes by random samples. This is exact but noisy, most of all under small "
     "lamps. For reference pictures"),
)  # fmt: skip
CHOICES = {name for name, _, _ in LIGHTS}
# Shown for a grating whose bake supports lamps only.
NO_SAMPLE_SET = "only lamps light it, because its bake has no .lobes.exr file; bake it with the ensemble model"

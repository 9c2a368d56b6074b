# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lights the diffraction shows. Saved .blend files contain these names, so they must not change."""

LAMPS_ONLY, REST, ALL = "LAMPS", "REST", "ALL"
# Identifier, label and tooltip, as in Blender's enumerations.
LIGHTS = (
    (REST, "Sources and Rest", "Lamps and compact bright parts of the world, without noise; the rest of the world and "
     "light from other objects by random samples, which is noisier. Without lamps the world still lights the grating"),
    (LAMPS_ONLY, "Lamps Only", "Up to eight lamps, without noise. The world and light from other objects have no "
     "effect; without lamps the diffraction is black"),
    (ALL, "All, Noisy and Exact", "All light by random samples: complete, but noisy, most of all under small lamps. "
     "For reference pictures"),
)  # fmt: skip
CHOICES = {name for name, _, _ in LIGHTS}
# Shown for a grating whose bake supports lamps only.
NO_SAMPLE_SET = "only lamps light it, because its bake has no .lobes.exr file; bake it with the ensemble model"

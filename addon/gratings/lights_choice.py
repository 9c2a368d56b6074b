# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lights the diffraction shows: the artist's choice. Saved .blend files hold these names: they must stay."""

LAMPS_ONLY, REST, ALL = "LAMPS", "REST", "ALL"
# Name, label and tooltip, as Blender's enumerations want them.
LIGHTS = (
    (REST, "Sources and Rest", "Lamps and compact bright parts of the world, without noise. The rest of the world, and "
     "light from other objects, by random samples, which is noisier. Without lamps the world still lights it"),
    (LAMPS_ONLY, "Lamps Only", "Up to eight lamps, without noise. The world and light from other objects have no "
     "effect; without lamps the diffraction is black"),
    (ALL, "All, Noisy and Exact", "Every light by random samples: all of the light, but noisy, most of all under small "
     "lamps; for reference pictures"),
)  # fmt: skip
CHOICES = {name for name, _, _ in LIGHTS}
# Of a grating whose bake can answer to nothing else.
NO_SAMPLE_SET = "only lamps light it, because its bake has no .lobes.exr file; bake it with the ensemble model"

# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lights diffraction answers to: the artist's choice. Saved .blend files hold these names: they must stay."""

LAMPS_ONLY, REST, ALL = "LAMPS", "REST", "ALL"
# Name, label and tooltip, as Blender's enumerations want them.
LIGHTS = (
    (REST, "Sources and Rest", "Lamps without noise; the world and bounced light with little noise, as smooth light"),
    (LAMPS_ONLY, "Lamps Only", "Lamps, without noise; the world and bounced light leave the diffraction dark"),
    (ALL, "All, Noisy and Exact", "Every light by random samples: exact, and noisy under lamps; for hero frames"),
)
CHOICES = {name for name, _, _ in LIGHTS}
# Of a grating whose bake can answer to nothing else.
NO_SAMPLE_SET = "only lamps light it, as its bake has no .lobes.exr beside it; bake it again, by the ensemble model"

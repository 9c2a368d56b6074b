# SPDX-License-Identifier: GPL-3.0-or-later
"""Lists every method of this folder by name. A new method is a new module with a MethodEntry, and its name in ENTRIES.

A method is compared with the reference of its own coherence model: "reference" (ensemble) or "reference-patch". This
module loads all methods, so Blender's start-up and the verbs without methods do not import it.
"""

from . import baked, chebyshev_series, exact, flss, gem, nmm, pq, stam
from .method import Build, MethodEntry

ENTRIES: dict[str, MethodEntry] = {
    entry.name: entry
    for entry in (
        *exact.ENTRIES, flss.ENTRY, chebyshev_series.ENTRY, *nmm.ENTRIES, *pq.ENTRIES, stam.ENTRY, gem.ENTRY,
        baked.ENTRY,
    )
}  # fmt: skip

METHODS: dict[str, Build] = {name: entry.build for name, entry in ENTRIES.items()}
MAP_METHODS: tuple[str, ...] = tuple(name for name, entry in ENTRIES.items() if entry.in_maps)
SHADER_METHODS: tuple[str, ...] = tuple(name for name, entry in ENTRIES.items() if entry.has_shader)

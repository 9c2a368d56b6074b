# SPDX-License-Identifier: GPL-3.0-or-later
"""The catalogs of the asset library, and the tags of a preset's asset."""

import uuid

from ...precompute.presets.presets import SNAKES, Preset

# The file in a library's root in which Blender keeps its catalogs.
FILE = "blender_assets.cats.txt"
_TOP = "Natural Gratings"
# The last word of the catalog's path, and the tag of a thing, for each shape of a preset.
_KINDS = {
    **dict.fromkeys(SNAKES, ("Snakes", "snake")),
    "disc": ("Discs", "disc"),
    "record": ("Discs", "disc"),
    "sheet": ("Foils", "foil"),
    "ball": ("Nature", "nature"),
}
_METALS = ("aluminium", "gold", "silver", "copper")
_HEADER = """# This is an Asset Catalog Definition file for Blender.
#
# Empty lines and lines starting with `#` will be ignored.
# The first non-ignored line should be the version indicator.
# Other lines are of the format "UUID:catalog/path/for/assets:simple catalog name"

VERSION 1
"""


def catalog_id(preset: Preset) -> str:
    """The identifier of a preset's catalog. It is the same on all machines."""
    return _identifier(f"{_TOP}/{_KINDS[preset.shape][0]}")


def tags_of(preset: Preset) -> list[str]:
    """The tags of a preset's asset: what to search it by."""
    matter = str(preset.request.matter)
    made_of = [metal for metal in _METALS if metal in matter]
    if "/" in matter:
        made_of.append("thin film")
    elif not made_of:
        made_of.append("dielectric")
    return ["diffraction", "iridescent", _KINDS[preset.shape][1], *made_of]


def catalogs_text(existing: str = "") -> str:
    """The text of a library's catalog file. Catalogs of others in the existing text stay."""
    ours = _catalogs()
    kept = existing if "VERSION 1" in existing.splitlines() else _HEADER
    lines = [line for line in kept.splitlines() if line.partition(":")[0] not in ours]
    lines += [f"{identifier}:{path}:{path.replace('/', '-')}" for identifier, path in ours.items()]
    return "\n".join(lines) + "\n"


def has_other_catalogs(text: str) -> bool:
    """Whether a library's catalog file has catalogs that are not ours."""
    ours = _catalogs()
    identifiers = [line.partition(":")[0] for line in text.splitlines() if ":" in line and not line.startswith("#")]
    return any(identifier not in ours for identifier in identifiers)


def _catalogs() -> dict[str, str]:
    """The paths of our catalogs by their identifiers. With a parent missing, Blender shows unsaved changes."""
    kinds = sorted({kind for kind, _ in _KINDS.values()})
    return {_identifier(path): path for path in (_TOP, *(f"{_TOP}/{kind}" for kind in kinds))}


def _identifier(path: str) -> str:
    """The identifier of a catalog's path."""
    return str(uuid.uuid5(uuid.NAMESPACE_URL, f"natural-gratings:{path}"))

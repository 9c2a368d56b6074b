# SPDX-License-Identifier: GPL-3.0-or-later
"""The presets with their pictures, for the panel's grid."""

from pathlib import Path
from typing import Any

import bpy
import bpy.utils.previews

from ..operators.add_preset import presets

FOLDER = Path(__file__).parent / "thumbnails"
# The property of the window manager that holds the chosen preset. It is not part of any file.
CHOSEN = "natural_gratings_preset"
# The presets that stand before the others, which follow by their names.
_FIRST = ("corn_snake", "sunbeam_snake")

_pictures: bpy.utils.previews.ImagePreviewCollection | None = None
# Blender keeps no reference to the texts of a dynamic enumeration, so they are kept here. Made at the first use.
_items: list[tuple[str, str, str, int, int]] = []


def presets_with_pictures(_owner, context) -> list[tuple[str, str, str, int, int]]:
    """The items of the enumeration: each preset with its title, tooltip and picture."""
    global _pictures
    if _pictures is None:
        _pictures = bpy.utils.previews.new()
        listed = sorted(presets(None, context), key=lambda item: item[0] not in _FIRST)
        for number, (name, title, tooltip) in enumerate(listed):
            path = FOLDER / f"{name}.jpg"
            picture = _pictures.load(name, str(path), "IMAGE").icon_id if path.is_file() else 0
            _items.append((name, title, tooltip, picture, number))
    return _items


def chosen_preset() -> Any:
    """The definition of the window manager's property CHOSEN."""
    return bpy.props.EnumProperty(
        name="Preset",
        description="Ready-made surface",
        items=presets_with_pictures,  # type: ignore[arg-type]  # the stubs lack items with a picture's number
    )


def forget_pictures() -> None:
    """Free the pictures, when the extension is disabled."""
    global _pictures
    _items.clear()
    if _pictures is not None:
        bpy.utils.previews.remove(_pictures)
        _pictures = None

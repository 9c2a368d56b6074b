# SPDX-License-Identifier: GPL-3.0-or-later
"""The row of the panel that puts the presets into the Asset Browser."""

from ..operators.make_assets import MakeAssets, RemoveAssets
from ..operators.shared import draw_progress


def draw_assets(layout) -> None:
    """Draw the button that writes the presets' asset library, or how far it is, and the button that removes it."""
    if MakeAssets.job is not None:
        draw_progress(layout, MakeAssets)
        return
    from ..assets.library import is_listed

    row = layout.row(align=True)
    if is_listed():
        row.operator(MakeAssets.bl_idname, text="Update in Asset Browser", icon="ASSET_MANAGER")
        row.operator(RemoveAssets.bl_idname, text="", icon="TRASH")
    else:
        row.operator(MakeAssets.bl_idname, icon="ASSET_MANAGER")

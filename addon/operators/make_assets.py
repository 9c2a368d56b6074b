# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the presets as materials into an asset library, and removes the library again."""

from typing import TYPE_CHECKING

import bpy
from bpy.props import StringProperty

from .shared import Acts, FollowsJob

if TYPE_CHECKING:
    from ..assets.library_job import LibraryJob


class MakeAssets(FollowsJob, bpy.types.Operator):
    """Show all presets in the Asset Browser, as materials to drag onto objects. Writes an asset library of 40 MB into
    the extension's folder, in half a minute to a minute. Your file stays as it is"""

    bl_idname = "grating.make_assets"
    bl_label = "Add to Asset Browser"
    # Not UNDO: it changes nothing in the file. Not REGISTER: Adjust Last Operation would write the library again.
    bl_options = set()

    directory: StringProperty(
        name="Directory",
        description="Folder of the library. Empty: the extension's folder",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    presets: StringProperty(
        name="Presets",
        description="Names of the presets to write, separated by commas. Empty: all",
        options={"SKIP_SAVE"},
    )

    def start(self, context):
        from ..assets.library import library_folder
        from ..assets.library_job import LibraryJob

        names = [name.strip() for name in self.presets.split(",") if name.strip()]
        return LibraryJob(library_folder(self.directory), names), "Asset library"

    def finish(self, job: "LibraryJob"):
        """Put the library into its folder, and list it in the preferences."""
        from ..assets.library import library_folder, list_library

        return [list_library(library_folder(self.directory), job.result())]


class RemoveAssets(Acts, bpy.types.Operator):
    """Remove the presets from the Asset Browser, and delete the files of their asset library. Materials that you use
    in your files stay"""

    bl_idname = "grating.remove_assets"
    bl_label = "Remove from Asset Browser"
    bl_options = set()

    directory: StringProperty(
        name="Directory",
        description="Folder of the library. Empty: the extension's folder",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(self, event)

    def act(self, context):
        from ..assets.library import library_folder, remove_library

        return [remove_library(library_folder(self.directory))]

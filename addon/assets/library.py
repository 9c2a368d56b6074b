# SPDX-License-Identifier: GPL-3.0-or-later
"""The asset library of the presets: its folder, and its entry in Blender's preferences."""

import contextlib
from collections.abc import Sequence
from pathlib import Path

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.base.files import told_of
from ...precompute.base.progress import Progress, silent
from ...precompute.presets.presets import preset_names
from ..blender.compat import append_from
from ..gratings.cache_folder import EXTENSION, cache_folder
from .catalogs import FILE, has_other_catalogs
from .library_job import LibraryJob, text_of

NAME = "Natural Gratings"
_MIB = 1 << 20


def library_folder(directory: str = "") -> Path:
    """The library's folder: the given directory, else one in the extension's folder in Blender. It may not exist
    yet."""
    if directory:
        return Path(bpy.path.abspath(directory)).resolve()
    if EXTENSION.startswith("bl_ext."):
        return Path(bpy.utils.extension_path_user(EXTENSION, path="assets"))
    return cache_folder() / "assets"


def make_and_wait(folder: Path, presets: Sequence[str] = (), *, progress: Progress = silent) -> list[Path]:
    """Write the assets of all presets, or of those named, into a folder. Returns their files. Raises GratingError as
    LibraryJob does."""
    job = LibraryJob(folder, presets)
    job.wait(progress)
    return job.result()


def list_library(folder: Path, files: Sequence[Path]) -> str:
    """Show a written library in the Asset Browser. Returns a line to report."""
    if _entry(folder) is None:
        libraries = bpy.context.preferences.filepaths.asset_libraries
        append_from(libraries.new(name=NAME, directory=str(folder)))
        bpy.context.preferences.is_dirty = True
    _refresh_browsers()
    return f"{NAME}: {summary_of(files)} in the Asset Browser"


def summary_of(files: Sequence[Path]) -> str:
    """How many assets were written, and their size."""
    mib = sum(file.stat().st_size for file in files) / _MIB
    return f"{len(files)} material{'s' * (len(files) != 1)} ({mib:.0f} MiB)"


def is_listed() -> bool:
    """Whether the Asset Browser shows the library in the extension's folder."""
    return _entry(library_folder()) is not None


def remove_library(folder: Path) -> str:
    """Remove a library from the preferences and delete its files. Files and catalogs of others stay, with the folder.
    Returns a line to report. Raises GratingError if there is no such library, or if a file cannot be deleted."""
    entry = _entry(folder)
    files = [file for name in preset_names() if (file := folder / f"{name}.blend").is_file()]
    if entry is None and not files:
        raise GratingError(folder, "holds no asset library of presets", "press Add to Asset Browser first")
    with told_of(folder):
        for file in files:
            file.unlink()
        catalogs = folder / FILE
        if catalogs.is_file() and not has_other_catalogs(text_of(catalogs)):
            catalogs.unlink()
    with contextlib.suppress(OSError):  # others' files are in it
        folder.rmdir()
    if entry is not None:
        bpy.context.preferences.filepaths.asset_libraries.remove(entry)
        bpy.context.preferences.is_dirty = True
    _refresh_browsers()
    return f"{NAME}: removed from the Asset Browser"


def _entry(folder: Path) -> bpy.types.UserAssetLibrary | None:
    """The preferences' entry for a folder, or None."""
    libraries = bpy.context.preferences.filepaths.asset_libraries
    return next((each for each in libraries if each.path and Path(bpy.path.abspath(each.path)) == folder), None)


def _refresh_browsers() -> None:
    """Make open Asset Browsers read their libraries again."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.ui_type == "ASSETS":
                with bpy.context.temp_override(window=window, area=area), contextlib.suppress(RuntimeError):
                    bpy.ops.asset.library_refresh()

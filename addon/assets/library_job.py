# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing the asset library with a second Blender in the background, so that the artist's file is not touched."""

import json
import shutil
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from ...precompute.bake.cache import FOLDER_VARIABLE
from ...precompute.base.child_process import inherited_environment, lines_of
from ...precompute.base.failure import GratingError
from ...precompute.base.files import told_of, write_together
from ...precompute.base.strict import failure_in
from ...precompute.presets.presets import preset_names, read_preset
from ..gratings.cache_folder import cache_folder
from ..jobs.child import ReportingProcess, background_blender, package_folders
from .catalogs import FILE, catalogs_text

_START = Path(__file__).with_name("start_library_maker.py")
# The time limit. With shipped drafts it takes half a minute; baking them all takes minutes.
_LONGEST_SECONDS = 3600


class LibraryJob(ReportingProcess):
    """A running second Blender that writes the presets' assets. Poll `running` or call `wait`, then take the
    `result`. Until then nothing is in the library's folder."""

    def __init__(self, folder: Path, presets: Sequence[str] = ()) -> None:
        """Start writing assets for a library: all presets, or those named. Raises GratingError for an unknown preset,
        or if no file can be written."""
        self._library = folder
        self._presets = [read_preset(name).name for name in presets or preset_names()]

        def prepare(private: Path) -> list[str]:
            self._written = private / "written"
            self._written.mkdir()
            request = {"folder": str(self._written), "presets": self._presets, "packages": package_folders()}
            path = private / "request.json"
            path.write_text(json.dumps(request), encoding="utf-8")
            return background_blender(_START, str(path))

        environment = inherited_environment() | {FOLDER_VARIABLE: str(cache_folder())}
        super().__init__(prepare, environment, longest_seconds=_LONGEST_SECONDS)

    def result(self) -> list[Path]:
        """Put the written files into the library's folder, all or none, after the process has ended. Returns the files
        of the assets. Raises GratingError if the second Blender failed or took too long, or if a file cannot be
        written."""
        try:
            if self.status == 0:
                return self._put()
            told = lines_of(self.out_path) + lines_of(self.err_path)
        finally:
            self.clean_up()
        if self.is_late:
            raise GratingError("asset library", f"not written within {_LONGEST_SECONDS} s", "try again")
        last = next((line for line in reversed(told) if line.strip() and not line.startswith("{")), "no message")
        raise failure_in(told) or GratingError("asset library", f"not written ({last})", "try again")

    def _put(self) -> list[Path]:
        with told_of(self._library):
            self._library.mkdir(parents=True, exist_ok=True)
            text = catalogs_text(text_of(self._library / FILE))
        made = {name: self._written / f"{name}.blend" for name in self._presets}
        copies = {self._library / file.name: partial(shutil.copyfile, file) for file in made.values()}
        write_together(copies | {self._library / FILE: lambda path: path.write_text(text, encoding="utf-8")})
        return list(copies)


def text_of(path: Path) -> str:
    """A catalog file's text; empty if there is none."""
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""

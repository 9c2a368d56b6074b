# SPDX-License-Identifier: GPL-3.0-or-later
"""Giving a preset's grating the draft bake that the extension ships."""

import shutil
from functools import partial
from pathlib import Path

from ...precompute.base.files import told_of, write_together
from ...precompute.presets.drafts import draft_request, shipped_draft
from ...precompute.presets.presets import Preset
from ..gratings.cache_folder import bakes_folder
from ..gratings.grating import Grating
from ..gratings.remembered_bakes import asked
from .baking import record_bake


def take_draft(grating: Grating, preset: Preset) -> bool:
    """Set a grating to draft quality, and give it the preset's shipped draft. The files are copied into the cache, as
    another version of the extension may not have them. Returns whether there is a draft. Raises GratingError if the
    cache cannot be written."""
    draft = draft_request(preset.request)
    grating.take_request(draft)
    request = grating.bake_request()
    facts = shipped_draft(preset.name, draft)
    if facts is None:
        return False
    folder = bakes_folder(asked(request))
    with told_of(folder):
        folder.mkdir(parents=True, exist_ok=True)
    copies = {folder / Path(file).name: partial(shutil.copyfile, file) for file in facts["files"]}
    if not all(copy.is_file() for copy in copies):
        write_together(copies)
    record_bake(grating, facts | {"files": [str(copy) for copy in copies]}, request)
    return True

# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a render runs in a background thread. While it does, it may read any data, so data must not change."""

from typing import Any

import bpy


def is_rendering() -> bool:
    """Whether a render or a texture bake is running in a background thread."""
    running: Any = bpy.app.is_job_running  # the stubs say it returns None
    return bool(running("RENDER") or running("OBJECT_BAKE"))

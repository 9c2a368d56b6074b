# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether Blender renders beside the interface: then its data may be read at any time, and must stay as they are."""

from typing import Any

import bpy


def is_rendering() -> bool:
    """Whether a picture is rendered or a texture is baked, in a thread of its own."""
    running: Any = bpy.app.is_job_running  # the stubs say that it returns None
    return bool(running("RENDER") or running("OBJECT_BAKE"))

# SPDX-License-Identifier: GPL-3.0-or-later
"""What ./dev does: environments, their Blender, test suites, packages. Standard library only."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ENVIRONMENTS = ROOT / ".env"
EXTENSION = "bl_ext.user_default.natural_gratings"


class DevError(Exception):
    """A fault to show in one line: what, and what to do."""

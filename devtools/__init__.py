# SPDX-License-Identifier: GPL-3.0-or-later
"""The code of ./dev: environments, Blender, test suites, packages. It needs only the standard library."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ENVIRONMENTS = ROOT / ".env"
EXTENSION = "bl_ext.user_default.natural_gratings"


class DevError(Exception):
    """An error that ./dev prints as one line, with its cause and remedy."""

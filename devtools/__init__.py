# SPDX-License-Identifier: GPL-3.0-or-later
"""The code behind ./dev: environments, Blender, test suites, packages. It uses the standard library only."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ENVIRONMENTS = ROOT / ".env"
EXTENSION = "bl_ext.user_default.natural_gratings"


class DevError(Exception):
    """A fault that ./dev shows in one line, which tells what is wrong and what to do."""

# SPDX-License-Identifier: GPL-3.0-or-later
"""How long work tells what it is at."""

from collections.abc import Callable

Progress = Callable[[str, float], None]

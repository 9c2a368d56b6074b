# SPDX-License-Identifier: GPL-3.0-or-later
"""Long work of precompute in a process beside Blender, with its progress and its cancelling."""

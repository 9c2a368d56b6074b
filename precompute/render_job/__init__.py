# SPDX-License-Identifier: GPL-3.0-or-later
"""Render jobs: a file declares many pictures of a scene, and any number of processes and machines render them."""

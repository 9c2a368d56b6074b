# SPDX-License-Identifier: GPL-3.0-or-later
"""Responses in Open Shading Language, for Cycles on the CPU: the thesis's methods, and a bake's table.

The .osl files are parts of shaders. The modules join them and build node groups around the result."""

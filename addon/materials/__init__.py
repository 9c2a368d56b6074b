# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups and materials, built from code: the Diffraction group with its shadows, the responses, and the materials.

A response tells what a baked surface answers to a lamp. One reads a bake's table by nodes (direct/), the others are
shaders in Open Shading Language (osl/)."""

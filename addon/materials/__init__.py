# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials and node groups, built from code: the Diffraction group with its shadows, its responses, and the materials.

A response computes the light that a baked surface sends to the viewer. One response reads a bake's table by nodes
(direct/); the others are shaders in Open Shading Language (osl/)."""

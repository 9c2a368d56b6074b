# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflectance of smooth surfaces: metals, thin films and stacks of layers, and the texts that name them."""

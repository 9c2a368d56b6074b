# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes: smooth direction fields by the connection Laplacian, combing, and UV maps."""

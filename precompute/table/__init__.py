# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of a bake and everything that a material needs of it: layout, files, reading, radiance."""

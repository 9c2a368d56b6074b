# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake holds, and all that a material needs of it: layout, files, reading, radiance."""

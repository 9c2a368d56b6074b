# SPDX-License-Identifier: GPL-3.0-or-later
"""Ready-made surfaces: one JSON file each, with a request for a bake, the look of the material, and its sources."""

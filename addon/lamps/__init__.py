# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's lamps: found, followed by drivers, packed into properties of the scene, and read by nodes of materials.

Light linking is followed too: marks on the objects name the lamps that do not light them."""

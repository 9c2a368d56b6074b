# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's lamps: found, followed by drivers, packed into scene properties, and read by material nodes. For light
linking, marks on objects name the lamps that do not light them."""

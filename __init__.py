# SPDX-License-Identifier: GPL-3.0-or-later
"""Natural Gratings: measured surfaces as iridescent materials. Blender's entry point.

The functions import the add-on, so that this folder can be imported without Blender."""


def register() -> None:
    from . import addon

    addon.register()


def unregister() -> None:
    from . import addon

    addon.unregister()

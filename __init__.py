# SPDX-License-Identifier: GPL-3.0-or-later
"""Natural Gratings: measured surfaces as iridescent materials. Blender's entry point.

The add-on is imported inside the functions, so that this folder stays importable where there is no Blender.
"""


def register() -> None:
    from . import addon

    addon.register()


def unregister() -> None:
    from . import addon

    addon.unregister()

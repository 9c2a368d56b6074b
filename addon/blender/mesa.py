# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesa's software rasteriser, by which EEVEE renders on a Linux machine without a graphics card."""

import os
import sys
from pathlib import Path

_OVERRIDE = "MESA_EXTENSION_OVERRIDE"
_WITHOUT_ANISOTROPY = "-GL_EXT_texture_filter_anisotropic -GL_ARB_texture_filter_anisotropic"
# The files by which the kernel offers graphics cards to Mesa.
_CARDS = Path("/dev/dri")


def filter_as_cards_do() -> None:
    """Switch anisotropic filtering off where Mesa would render on the processor.

    There each look-up of such a texture takes some five times as long, and sharpens the texture, which no graphics card
    does. Blender's own preference does not help. Mesa reads the variable once, when Blender makes its graphics context:
    for a render in background that is the first render by EEVEE. What the user has set stays."""
    if sys.platform == "linux" and not any(_CARDS.glob("renderD*")):
        os.environ.setdefault(_OVERRIDE, _WITHOUT_ANISOTROPY)

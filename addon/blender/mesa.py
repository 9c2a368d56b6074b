# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings for Mesa's software rasteriser, with which EEVEE renders on a Linux machine without a graphics card."""

import os
import sys
from pathlib import Path

_OVERRIDE = "MESA_EXTENSION_OVERRIDE"
_WITHOUT_ANISOTROPY = "-GL_EXT_texture_filter_anisotropic -GL_ARB_texture_filter_anisotropic"
# Where the Linux kernel lists graphics cards.
_CARDS = Path("/dev/dri")


def sharpens_textures() -> bool:
    """Whether Mesa renders on the processor with anisotropic filtering. Then each texture look-up takes about five
    times as long, and textures are sharpened, which no graphics card does. Blender's preference has no effect there."""
    return sys.platform == "linux" and _OVERRIDE not in os.environ and not any(_CARDS.glob("renderD*"))


def filter_as_cards_do() -> None:
    """Disable anisotropic filtering if Mesa renders on the processor.

    Mesa reads the variable once, when Blender creates its graphics context: with a window at the start, in background
    at the first EEVEE render. A value set by the user is kept."""
    if sharpens_textures():
        os.environ[_OVERRIDE] = _WITHOUT_ANISOTROPY

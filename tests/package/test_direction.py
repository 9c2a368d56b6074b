# SPDX-License-Identifier: GPL-3.0-or-later
"""The sub-panel Direction in a Blender with a window: its buttons pressed, its overlay seen."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from .test_interface import blender, display  # noqa: F401  its fixtures

HERE = Path(__file__).parent


def counts(path: Path) -> tuple[int, int]:
    """The pixels of a picture in the colours of arrows and of seams."""
    r, g, b = np.asarray(Image.open(path).convert("RGB"), int).transpose(2, 0, 1)
    return int(((g - r > 90) & (b - r > 90)).sum()), int(((r - g > 120) & (r - b > 120)).sum())


def test_the_overlay_shows_arrows_and_seams_and_the_buttons_work(display, blender, tmp_path):  # noqa: F811
    bake = tmp_path / "bake"
    blender.run_grating("bake", "sample:blazed", "--delta-e", "6", "-o", bake)
    window = replace(blender, command=("env", f"DISPLAY={display}", *blender.command))
    options = ("--enable-event-simulate", "--window-geometry", "0", "0", "1280", "1000")
    window.run(*options, "--python", HERE / "use_direction.py", "--", bake / "blazed.exr", tmp_path)
    off, on, off_again = (counts(tmp_path / f"{name}.png") for name in ("off", "on", "off_again"))
    # Suzanne fills a third of the view; some hundreds of arrows and her seams lie on it. Without the overlay only the
    # axis of the view's corner and icons have such colours.
    assert on[0] > off[0] + 1000 and on[1] > off[1] + 200
    assert abs(off_again[0] - off[0]) < 200 and abs(off_again[1] - off[1]) < 100

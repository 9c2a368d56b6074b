# SPDX-License-Identifier: GPL-3.0-or-later
"""The sub-panel Direction in a Blender with a window: its buttons and its overlay."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from devtools.window import display as screen

from .test_interface import blender  # noqa: F401  its fixture

HERE = Path(__file__).parent
# High enough to show the whole panel.
SIZE = (1280, 1800)


def counts(path: Path) -> tuple[int, int, int]:
    """The number of pixels of a picture in the colours of arrows, of seams, and of singular faces."""
    r, g, b = np.asarray(Image.open(path).convert("RGB"), int).transpose(2, 0, 1)
    kinds = (g - r > 90) & (b - r > 90), (r - g > 120) & (r - b > 120), (r - b > 120) & (g - b > 90)
    return tuple(int(kind.sum()) for kind in kinds)


@pytest.mark.night("tests/addon/direction/test_seams.py")
def test_the_overlay_shows_arrows_and_seams_and_the_buttons_work(blender, tmp_path):  # noqa: F811
    if shutil.which("Xvfb") is None:
        pytest.skip("no Xvfb: on Debian the package xvfb brings it")
    bake, file = tmp_path / "bake", tmp_path / "empty.blend"
    blender.run_grating("bake", "sample:blazed", "--delta-e", "6", "--coherence-um", "4", "-o", bake)
    blender.run("--background", "--python-expr", f"import bpy; bpy.ops.wm.save_as_mainfile(filepath={str(file)!r})")
    with screen.display(*SIZE, folder=tmp_path) as name:
        window = replace(blender, command=("env", f"DISPLAY={name}", *blender.command))
        options = ("--enable-event-simulate", "--window-geometry", "0", "0", *map(str, SIZE))
        window.run(*options, file, "--python", HERE / "use_direction.py", "--", bake / "blazed.exr", tmp_path)
    seen = {path.stem: counts(path) for path in tmp_path.glob("*.png")}
    off, on, off_again = (seen[name] for name in ("off", "on", "off_again"))
    # Suzanne fills a third of the view, with some hundreds of arrows and her seams. Without the overlay only the view's
    # axes and icons have these colours.
    assert on[0] > off[0] + 1000 and on[1] > off[1] + 200
    assert abs(off_again[0] - off[0]) < 200 and abs(off_again[1] - off[1]) < 100
    # The other meshes are as large in the view. They have no seam, and Blender cannot draw an empty batch.
    for name in ("grid", "combed", "snake"):
        assert seen[f"{name}_on"][0] > seen[f"{name}_off"][0] + 1000, name
        assert seen[f"{name}_on"][1] < seen[f"{name}_off"][1] + 50, name
    # A closed body has at least two singular points, some of them visible, each in a ring some ten pixels wide.
    assert seen["combed_on"][2] > seen["combed_off"][2] + 30
    assert abs(seen["fault"][0] - seen["snake_off"][0]) < 100

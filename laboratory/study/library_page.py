# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the picture of docs/library.md from what its examples compute:

python -m laboratory.study.library_page FILE
"""

import contextlib
import doctest
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import precompute
from devtools import ROOT
from precompute.cli.parser import OneLineParser
from precompute.maps.brdf_map import picture

from . import plots

PAGE = ROOT / "docs" / "library.md"
# The part of the scan that is shown, in metres, and the side of the map in pixels.
_PART_M, _SIDE = 15e-6, 256


def computed() -> dict[str, Any]:
    """The values of the page's examples by their names. Raises AssertionError if an example is wrong."""
    sys.modules["natural_gratings"] = precompute  # the library's name where it is installed
    examples = doctest.DocTestParser().get_doctest(PAGE.read_text(encoding="utf-8"), {}, PAGE.name, str(PAGE), 0)
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        assert not doctest.DocTestRunner().run(examples, clear_globs=False).failed
    return examples.globs


def draw(found: dict[str, Any], path: Path) -> None:
    """Draw the scan, the light that its bake reflects into each angle, and the colours over the hemisphere."""
    scan, table, light, ng = (found[name] for name in ("scan", "table", "light", "ng"))
    pyplot = plots.pyplot()
    figure, (heights, orders, colours) = pyplot.subplots(1, 3, figsize=(10, 3.2), layout="constrained")

    pixels = round(_PART_M / scan.pixel_size_m[0])
    image = heights.imshow(scan.height_m[:pixels, :pixels] * 1e9, cmap="gray", extent=2 * (0, _PART_M * 1e6))
    figure.colorbar(image, label="height, nm")
    heights.set(xlabel="x, um", ylabel="y, um", title="scan.height_m")

    degrees = np.linspace(-90, 90, 1441)
    angles = np.radians(degrees)
    views = np.stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)], axis=-1)
    luminance = ng.reflected_xyz(table, light, views, variance=table.kernel_variance)[:, 1]
    orders.plot(degrees, luminance, "k", linewidth=1)
    orders.set(xlabel="view, degrees", ylabel="Y, 1/sr", title="ng.reflected_xyz", yscale="log", ylim=(1e-4, 10))

    colours.imshow(picture(ng.brdf_map(table, _SIDE, light)), extent=(-1, 1, -1, 1))
    colours.set(xlabel="view.x", ylabel="view.y", title="ng.brdf_map")

    figure.savefig(path, dpi=80)
    pyplot.close(figure)


def main(argv: Sequence[str] | None = None) -> None:
    """Draw the picture."""
    parser = OneLineParser(prog="laboratory.study.library_page", description=__doc__.split(":")[0])
    parser.add_argument("file", type=Path, metavar="FILE", help="the picture, a PNG")
    file = parser.parse_args(argv).file
    draw(computed(), file)


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: GPL-3.0-or-later
"""The correlation length of hue along a snake's body."""

import numpy as np
import pytest
from PIL import Image

from laboratory.study.streaks import LINES, Line, correlation_length, correlations, hues_along, main

PLATE = 12
LINE = Line(480, PLATE, ((0.0, 60.0), (479.0, 60.0)))


def tiled(plates: int) -> Image.Image:
    """A picture of tiles, `plates` plates long and one wide, each of a random colour."""
    colours = np.random.default_rng(1).integers(0, 256, (10, 40 // plates, 3), np.uint8)
    return Image.fromarray(colours.repeat(PLATE, axis=0).repeat(PLATE * plates, axis=1))


@pytest.mark.parametrize("plates", [1, 4])
def test_the_length_grows_with_what_has_one_colour(plates):
    """The correlation of independent tiles falls evenly to zero over one tile."""
    length = correlation_length(correlations(hues_along(tiled(plates), LINE)))
    assert length == pytest.approx((1 - np.exp(-1)) * plates, rel=0.25)


def test_it_prints_a_line_for_each_line_along_the_body(tmp_path, capsys):
    tiled(1).save(tmp_path / "tiles.png")
    assert main(["hero", str(tmp_path / "tiles.png")]) == 0
    assert capsys.readouterr().out.count("plates; next plates") == len(LINES["hero"])

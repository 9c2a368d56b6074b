# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact sheets: every picture is on it, and a missing one has its place."""

import numpy as np
from PIL import Image

from precompute.render_job.pictures import write_sheet

COLOURS = [(250, 0, 0), (0, 250, 0), (0, 0, 250), (250, 250, 0), (0, 250, 250)]


def test_each_picture_is_on_the_sheet(tmp_path):
    paths = [tmp_path / f"{index}.png" for index in range(len(COLOURS))]
    for path, colour in zip(paths, COLOURS, strict=True):
        Image.new("RGB", (320, 240), colour).save(path)
    assert write_sheet(tmp_path / "sheet.png", paths) == 0
    sheet = np.asarray(Image.open(tmp_path / "sheet.png"))
    for colour in COLOURS:
        # A tile is 192 pixels wide, so 144 high.
        assert (sheet == colour).all(axis=-1).sum() == 192 * 144


def test_missing_and_damaged_pictures_are_counted(tmp_path):
    Image.new("RGB", (32, 24)).save(tmp_path / "there.png")
    (tmp_path / "damaged.png").write_bytes(b"no picture")
    paths = [tmp_path / name for name in ("there.png", "damaged.png", "missing.png")]
    assert write_sheet(tmp_path / "sheet.png", paths) == 2


def test_a_long_name_fits_under_its_tile(tmp_path):
    path = tmp_path / f"{'long_' * 30}end.png"
    Image.new("RGB", (32, 24), (0, 0, 0)).save(path)
    write_sheet(tmp_path / "sheet.png", [path])
    sheet = np.asarray(Image.open(tmp_path / "sheet.png"))
    paper = (24, 24, 24)
    assert (sheet[:, -6:] == paper).all(), "the label ends at the tile's edge"

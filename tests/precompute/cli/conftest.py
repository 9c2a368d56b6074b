# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of the command line share: a picture, a bake, and functions that run a command line."""

import numpy as np
import pytest
from PIL import Image

from precompute.cli import parser
from precompute.table import atlas, atlas_file
from precompute.table.table import Table

PICTURE = ("--size-um", "4", "--height-nm", "250")
# A coherence length at which the picture, 4 um wide, has a small table.
SHORT = ("--coherence-um", "4")


@pytest.fixture
def scan(tmp_path):
    """A grey picture of an irregular grating, 48 x 48 pixels, in a folder of its own."""
    folder = tmp_path / "scans"
    folder.mkdir()
    x, y = np.meshgrid(*[np.arange(48) / 48] * 2)
    grey = 127 + 90 * np.sin(2 * np.pi * 5 * x + np.sin(2 * np.pi * y)) + 30 * np.cos(2 * np.pi * 3 * y)
    Image.fromarray(grey.astype(np.uint8)).save(folder / "skin.png")
    return folder / "skin.png"


@pytest.fixture
def run(capsys):
    """A function that runs a command line and returns its status, its standard output and its standard error."""

    def run_line(*argv):
        capsys.readouterr()
        try:
            status = parser.main([str(each) for each in argv])
        except SystemExit as end:
            status = end.code
        return status, *capsys.readouterr()

    return run_line


@pytest.fixture
def refused(run, tmp_path):
    """A function that runs a command line that must fail, and returns its line of error.

    It checks the status, that nothing is on standard output, that the error is one line, and that nothing was written.
    """

    def run_line(*argv, status=1):
        before = contents(tmp_path)
        got, out, err = run(*argv)
        assert got == status
        assert out == ""
        assert err.startswith("error: ") and err.endswith("\n")
        assert len(err.splitlines()) == 1, err
        assert contents(tmp_path) == before
        # The line says what is wrong, and after the semicolon what to do about it.
        assert "; " in err
        return err

    return run_line


def contents(folder):
    """The bytes of a folder's files by their paths. Empty folders are left out, since one more does no harm."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def small_bake(tmp_path):
    """The file of a bake of 4 tiles of 256 texels a side, each of one colour."""
    tiles = np.ones((4, 256, 256, 3), np.float32) * np.array([4, 3, 2, 1])[:, None, None, None]
    table = Table(tiles, np.full((512, 3), 0.5), 0.05, 4 / 252, "D65")
    (tmp_path / "bakes").mkdir()
    path = tmp_path / "bakes" / "small.exr"
    atlas_file.write_together({path: atlas.pack(table)}, {"source": "small"})
    return path

# SPDX-License-Identifier: GPL-3.0-or-later
"""Bundled packages that are missing or broken: verbs that do not need the package work, the others report it in one
line, early, and leave nothing."""

import sys

import numpy as np
import pytest
from PIL import Image

from precompute.base.failure import GratingError
from precompute.base.machine import bundled, missing_packages
from precompute.cli.parser import main
from precompute.mesh.unwrap import Mesh, write_mesh

# Errors of packages for another platform or a newer system, raised on import.
BROKEN = {
    "ImportError": "raise ImportError('libm.so.6: version `GLIBC_2.38` not found')",
    "OSError": "raise OSError('invalid ELF header')",
    "AttributeError": "import math; math.nothing",
}
STATES = ("missing", *BROKEN)
PACKAGES = {"OpenEXR": "OpenEXR", "Pillow": "PIL", "xatlas": "xatlas"}
# A command line for each verb that works in the test's folder, and the package that it needs.
LINES = {
    "info of a sample": ("info sample:flat", None),
    "info of a text": ("info heights.txt --size-um 4 --height-nm 100", None),
    "info of a picture": ("info waves.png --size-um 4 --height-nm 100", "Pillow"),
    "comb's help": ("comb --help", None),
    "bake": ("bake sample:flat -o out --no-cache --coherence-um 3 --delta-e 9 --illuminant 532nm", "OpenEXR"),
    "dft": ("dft sample:blazed -o out --terms 1", "OpenEXR"),
    "map to .png": ("map sample:flat --method flss -o out/map.png --size 8", "Pillow"),
    "map to .exr": ("map sample:flat --method flss -o out/map.exr --size 8", "OpenEXR"),
    "unwrap": ("unwrap mesh.npz -o out", "xatlas"),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working folder, with a picture, a text and a mesh."""
    grey = np.add.outer(np.zeros(32), 100 + 90 * np.sin(np.arange(32)))
    Image.fromarray(grey.astype(np.uint8)).save(tmp_path / "waves.png")
    np.savetxt(tmp_path / "heights.txt", grey / 255)
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    write_mesh(tmp_path / "mesh.npz", Mesh(square, np.array([(0, 1, 2), (0, 2, 3)]), np.array([0, 0])))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def spoil(tmp_path_factory, monkeypatch):
    """A function that removes a package or replaces it by a broken one."""

    def spoil(package, state):
        for name in [name for name in sys.modules if name.partition(".")[0] == package]:
            monkeypatch.delitem(sys.modules, name)
        if state == "missing":
            monkeypatch.setitem(sys.modules, package, None)
            return
        place = tmp_path_factory.mktemp("site")
        (place / package).mkdir()
        (place / package / "__init__.py").write_text(BROKEN[state])
        monkeypatch.syspath_prepend(str(place))

    return spoil


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_that_cannot_be_loaded_is_one_line(spoil, package, state):
    spoil(PACKAGES[package], state)
    fault = "it is not installed for Python 3" if state == "missing" else rf"cannot be loaded \({state}: .*\)"
    with pytest.raises(GratingError, match=rf"^{package}: {fault}.*; install the extension's zip for this platform"):
        bundled(PACKAGES[package])


@pytest.mark.parametrize("package", PACKAGES)
def test_a_missing_package_is_listed(spoil, package):
    assert missing_packages() == []
    spoil(PACKAGES[package], "missing")
    assert missing_packages() == [package]


@pytest.mark.short("OpenEXR-missing", "Pillow-ImportError")
@pytest.mark.parametrize("state", ["missing", "ImportError"])
@pytest.mark.parametrize("package", PACKAGES)
def test_what_needs_no_such_package_works_and_the_rest_says_so(folder, spoil, capsys, package, state):
    spoil(PACKAGES[package], state)
    for name, (line, needs) in LINES.items():
        if state == "missing" and needs != package:
            continue  # covered by the broken package
        status = run(line)
        told = [each for each in capsys.readouterr().err.splitlines() if "%" not in each]
        if needs != package:
            assert status == 0, (name, told)
        else:
            assert status == 1 and len(told) == 1 and told[0].startswith(f"error: {package}: "), (name, told)
            assert not list(folder.glob("out/**/*.*")), name
        for made in folder.glob("out/**/*.*"):
            made.unlink()


def run(line):
    try:
        return main(line.split())
    except SystemExit as end:  # raised by --help
        return end.code

# SPDX-License-Identifier: GPL-3.0-or-later
"""Files saved by one version of Blender, opened and rendered by another that traces shadows differently."""

from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare
from precompute.table import atlas

from .conftest import Blender

HERE = Path(__file__).parent
VERSIONS = ("bpy-4.5", "bpy-5.3")


@pytest.fixture(scope="module")
def blenders(install) -> dict[str, Blender]:
    """Both versions, with the extension installed from its zip."""
    return {name: install(name) for name in VERSIONS}


@pytest.fixture(scope="module")
def blazed(tmp_path_factory) -> Path:
    """A quick bake."""
    image, layout = atlas.pack(bake(prepare(read_height_map("sample:blazed")), BakeRequest(coherence_length_m=8e-6)))
    path = tmp_path_factory.mktemp("bake") / "blazed.exr"
    atlas.write_together({path: (image, layout)}, {})
    return path


def halves(picture: Path) -> tuple[np.ndarray, np.ndarray]:
    """The colours (rows, columns, 3) of a render's left half, which is lit, and of its right half, which is shaded."""
    with OpenEXR.File(str(picture)) as file:
        colours = next(each.pixels[..., :3] for each in file.channels().values() if each.pixels.ndim == 3)
    middle = colours.shape[1] // 2
    return colours[:, :middle], colours[:, middle:]


@pytest.mark.short("bpy-4.5-bpy-5.3")
@pytest.mark.parametrize(("saves", "opens"), [VERSIONS, VERSIONS[::-1]])
def test_a_file_of_another_version_shows_the_same(blenders, blazed, tmp_path, saves, opens):
    """4.5 has no Raycast node: its highlights had half of their light. 5.2 runs no script, so nothing was shaded."""
    file, by_saver, by_opener = tmp_path / "file.blend", tmp_path / "saved.exr", tmp_path / "opened.exr"
    script = HERE / "other_version.py"
    blenders[saves].run_script(script, file, by_saver, blazed)
    answer = blenders[opens].start("--background", "--python-exit-code", "1", "--python", script, "--", file, by_opener)
    assert answer.returncode == 0, answer.stderr
    assert answer.stderr.count("Diffraction waves: nodes rebuilt") == 1
    (lit, _), (found, shaded) = halves(by_saver), halves(by_opener)
    assert lit.max() > 0.1
    # Versions of Cycles round single precision differently. Half the light, or no shadow, would be 50 % off.
    np.testing.assert_allclose(found.mean(axis=(0, 1)), lit.mean(axis=(0, 1)), rtol=0.01)
    # Leaves out the columns where the pixel filter mixes in the lit half.
    assert shaded[:, 2:].max() < 0.01 * lit.max()

# SPDX-License-Identifier: GPL-3.0-or-later
"""A forged .blend: custom properties of wrong types, lengths and values, and deleted parts. It is loaded, edited,
drawn, assigned, mended and saved without an exception."""

import shutil

import bpy
import pytest

from tests.hostile import blends, lying_scene

# Files with many forged properties each, and a sixth of the edits, others in each Blender: an edit rebuilds materials.
FIRST = 0 if bpy.app.version >= (5, 0, 0) else 3
ROUNDS = [names for number, names in enumerate(blends.rounds()) if len(names) > 1 or number % 6 == FIRST]


@pytest.fixture(scope="module")
def blend(extension, baked, tmp_path_factory):
    """A file that holds one of everything, and the add-on's modules."""
    from devtools.extension import AddonModules

    addon = AddonModules(extension.__name__)
    folder = tmp_path_factory.mktemp("lies")
    scan = lying_scene.write_scan(folder / "waves.png")
    yield addon, lying_scene.build(addon, scan, baked)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    shutil.rmtree(folder)


def test_there_are_enough_lies():
    assert len(blends.LIES) >= 300
    assert {name for names in blends.rounds() for name in names} <= set(blends.LIES)


@pytest.mark.short("frame_map leads to a lamp", "every third driver", "the picture is sRGB")
@pytest.mark.parametrize("names", ROUNDS, ids=lambda names: f"{names[0]} and {len(names) - 1} more")
def test_nothing_raises(blend, names):
    assert blends.faults_of(*blend, names) == []

# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are dropped on a 3D view."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from benchmarks.hostile import instruments
from precompute.surface.readers.registry import dropped, extensions


def test_files_of_microscopes_may_be_dropped_on_a_3d_view(scene):
    handler = bpy.types.GRATING_FH_height_map
    assert handler.bl_file_extensions == dropped()
    # Blender keeps 511 bytes.
    assert len(dropped()) < 512
    assert {".nid", ".spm", ".001", ".gwy"} <= set(dropped().split(";"))
    assert not {".tif", ".png", ".txt"} & set(dropped().split(";"))
    area = SimpleNamespace(type="VIEW_3D")
    assert handler.poll_drop(SimpleNamespace(area=area))
    area.type = "IMAGE_EDITOR"
    assert not handler.poll_drop(SimpleNamespace(area=area))
    assert not handler.poll_drop(SimpleNamespace(area=None))
    assert handler.bl_import_operator == "grating.import_height_map"


def test_the_menu_names_a_few_formats(addon):
    """All of them would be wider than the screen."""
    drawn = []
    layout = SimpleNamespace(operator=lambda name, text: drawn.append((name, text)))
    addon.import_operator.menu_entry(SimpleNamespace(layout=layout), None)
    ((name, text),) = drawn
    assert name == "grating.import_height_map"
    named = text.removeprefix("Height Map (").removesuffix(", ...)").split(", ")
    assert len(named) > 2 and set(named) <= set(extensions())


@pytest.mark.parametrize("make, name", [(instruments.nanoscope, "drop.spm"), (instruments.gsf, "drop.gsf")])
def test_a_file_that_is_dropped_is_imported_at_once(scene, tmp_path, make, name):
    x = np.arange(64) * 50e-9
    (tmp_path / name).write_bytes(make(50e-9 * np.sin(2 * np.pi * x / 800e-9) * np.ones((64, 1)), 50e-9))
    done = bpy.ops.grating.import_height_map("INVOKE_DEFAULT", filepath=str(tmp_path / name))
    assert done == {"FINISHED"}
    grating = scene.natural_gratings.active()
    assert grating.name == "drop"
    assert grating.summary.startswith("3.2 x 3.2 um, relief ") and grating.summary.endswith(" at 0 deg")

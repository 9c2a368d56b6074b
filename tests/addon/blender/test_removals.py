# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties that this Blender marks for removal in a later one: the add-on does without them."""

import bpy
import pytest

from tests.precompute.test_layering import ROOT, sources, tree_of
from tests.precompute.test_removals import COMPAT, accesses

pytestmark = pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="older Blenders mark nothing")


def marked() -> set[str]:
    """Names of properties that this Blender marks for removal and that no other type keeps."""
    types = (getattr(getattr(bpy.types, name), "bl_rna", None) for name in dir(bpy.types))
    properties = [each for rna in types if rna is not None for each in rna.properties]
    going = {each.identifier for each in properties if each.is_deprecated and each.deprecated_removal_version[0]}
    return going - {each.identifier for each in properties if not each.is_deprecated}


def test_the_add_on_uses_nothing_that_this_blender_marks():
    names = marked() | {"use_nodes"}  # line styles of Freestyle keep use_nodes
    assert "frame_final_start" in names
    found = {path.relative_to(ROOT).as_posix() for path in sources("addon") if accesses(tree_of(path), names)}
    assert found == {COMPAT}


def test_every_test_fails_where_blender_warns_of_a_removal(scene):
    """By the filter in pyproject.toml. So each test of the add-on in this Blender shows that its way has no warning."""
    with pytest.raises(SystemError) as raised:  # Blender's setters do not return the error
        setattr(scene, "use_nodes", True)  # noqa: B010  a test of the sources finds the dot
    assert isinstance(raised.value.__cause__, DeprecationWarning)

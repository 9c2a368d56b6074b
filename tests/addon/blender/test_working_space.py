# SPDX-License-Identifier: GPL-3.0-or-later
"""The working space is read from the colour configuration, whatever its name there is."""

import os
import subprocess
import sys
from types import SimpleNamespace

# ACEScg is scene_linear in it, and it has neither Blender's view transforms nor its names.
_ACES = "ocio://cg-config-v2.1.0_aces-v1.3_ocio-v2.3"
_ASK = """
import sys, bpy
sys.path.append(sys.argv[1])
from natural_gratings.addon.blender.working_space import show_pure_colours, working_space
print([working_space(), show_pure_colours(bpy.context.scene)])
"""


def test_blenders_own_configuration(addon, scene):
    assert (addon.working_space.working_space(), addon.working_space.unknown_space()) == ("Rec.709", [])


def test_another_configuration(extension):
    command = [sys.executable, "-c", _ASK, os.path.dirname(extension.__path__[0])]
    asked = subprocess.run(command, env=os.environ | {"OCIO": _ACES}, capture_output=True, text=True, check=True)
    assert "['ACEScg', 'Un-tone-mapped']" in asked.stdout


def test_a_space_without_a_name_is_told(addon, monkeypatch):
    """Display P3: its primaries are known to no bake."""
    p3 = {(1, 0, 0): (0.487, 0.229, 0), (0, 1, 0): (0.266, 0.692, 0.045), (0, 0, 1): (0.198, 0.079, 1.044)}

    def colour_of_p3(primary):
        return SimpleNamespace(from_scene_linear_to_xyz_d65=lambda: p3[tuple(primary)])

    monkeypatch.setattr(addon.working_space, "Color", colour_of_p3)
    (told,) = addon.working_space.unknown_space()
    assert "The working space is none of Rec.709, Rec.2020, ACEScg: the colours are of Rec.709" in told

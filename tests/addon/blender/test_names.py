# SPDX-License-Identifier: GPL-3.0-or-later
"""File names that would end a shader's string, move a terminal's cursor, or are not valid text."""

import os
import re
import sys
from pathlib import Path

import bpy
import pytest

from laboratory.benchmarks.blender import set_up_cycles

NAMES = (b'a"; } shader b() { "', b"a\nerror: b\x1b[2J\x07\xe2\x80\xae", "Größe 格 ??".encode())
# Blender's text is UTF-8, and its paths cannot hold a backslash.
NOT_FOR_BLENDER = (b"\xff\xfe", b"back\\slash")
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has such file names")


def path_of(folder: Path, name: bytes) -> str:
    return os.fsdecode(os.path.join(os.fsencode(folder), name + b".png"))


def bake_and_assign(addon, scene, path, output):
    grating = addon.importing.add_grating(scene, path, size_um=4, height_nm=100)
    addon.baking.bake_and_wait(grating, str(output))
    return addon.assigning.assign_to_meshes(scene, list(bpy.context.selected_objects))


@pytest.mark.night("test_a_name_that_blender_cannot_keep_is_refused")
@pytest.mark.parametrize("name", NAMES)
def test_a_scan_of_any_name_is_baked_and_assigned(addon, scene, scan, tmp_path, name):
    path = path_of(tmp_path, name)
    os.link(scan, path)
    lines = bake_and_assign(addon, scene, path, tmp_path / "out")
    assert lines and all(line.isprintable() for line in lines)
    assert scene.natural_gratings.active().name.isprintable()


@pytest.mark.parametrize("name", NOT_FOR_BLENDER)
def test_a_name_that_blender_cannot_keep_is_refused(addon, scene, scan, tmp_path, name):
    path = path_of(tmp_path, name)
    os.link(scan, path)
    with pytest.raises(addon.child.GratingError) as caught:
        bake_and_assign(addon, scene, path, tmp_path / "out")
    told = str(caught.value)
    assert told.isprintable() and "; " in told and "name" in told


@pytest.mark.parametrize("name", [*NAMES, *NOT_FOR_BLENDER, b"??/", b"%41\\", b"\\\n", b"\x01"])
def test_no_path_ends_the_string_of_a_shader(addon, name):
    """The literal encodes the path's bytes in plain characters."""
    path = Path(path_of(Path("/tmp"), name))
    literal = addon.script.file_name(path)
    assert re.fullmatch(r'"(?:[A-Za-z0-9/._ -]|\\[0-7]{3})*"', literal)
    decoded = re.sub(rb"\\([0-7]{3})", lambda octal: bytes([int(octal[1], 8)]), literal[1:-1].encode())
    assert decoded == os.fsencode(path)


@pytest.mark.parametrize("name", [*NAMES, b"back\\slash"])
def test_a_shader_with_any_path_compiles(addon, scene, name):
    if not bpy.app.build_options.cycles_osl:
        pytest.skip(addon.script.missing_for_osl(scene))
    set_up_cycles()
    literal = addon.script.file_name(Path(path_of(Path("/tmp"), name)))
    text = f"#define ATLAS {literal}\nshader test(output color Radiance = 0) {{ Radiance = texture(ATLAS, 0, 0); }}\n"
    assert addon.script.script_group("test", text, ()).group is not None
    scene.cycles.shading_system = False

# SPDX-License-Identifier: GPL-3.0-or-later
"""The shim over a bpy wheel handles Blender's arguments like the binary: both run the same list."""

import pytest

from devtools.environments import ALL, dependency_group
from devtools.packages import downloads
from devtools.suites import split_arguments

# What follows from the arguments after --background: (exit status, whether the last argument is still executed).
ENDINGS = {
    "nothing special": ([], 0, True),
    "a script that raises": (["--python-expr", "1 / 0"], 0, True),
    "a script that raises, with a status for it": (
        ["--python-exit-code", "7", "--python-expr", "1 / 0"],
        7,
        False,
    ),
    "a script that exits": (["--python-expr", "import sys; sys.exit(3)"], 3, False),
    "a script that is not there": (["--python", "no_such_script.py"], 0, True),
    "a file that is not there": (["no_such_file.blend"], 1, False),
    "an unknown option": (["--no-such-option"], 1, False),
    "an unknown command": (["--command", "no-such-command"], 1, False),
    "a command after a file that is not there": (["no.blend", "--command", "extension", "no-such-verb"], 2, False),
    "a command's own status": (["--command", "extension", "no-such-verb"], 2, False),
}


# Of the binary the night asks whether the list is still right; the other wheel has the same shim.
@pytest.mark.short("bpy-5.3")
@pytest.mark.parametrize("case", ENDINGS)
def test_exit_status_is_that_of_the_binary(empty_blender, case):
    arguments, status, goes_on = ENDINGS[case]
    answer = empty_blender.start("--background", *arguments, "--python-expr", "print('went' + ' on')")
    assert answer.returncode == status, answer.stdout + answer.stderr
    assert ("went on" in answer.stdout) == goes_on


@pytest.mark.short("bpy-5.3")
def test_script_sees_its_arguments_after_the_dashes(empty_blender):
    tell = "import sys; print('own:', sys.argv[sys.argv.index('--') + 1:])"
    assert "own: ['a', '--b']" in empty_blender.run("--background", "--python-expr", tell, "--", "a", "--b")


@pytest.mark.short("bpy-")
def test_command_with_a_file_open_has_no_window(empty_blender, tmp_path):
    """An operator that needs bpy.context.selected_objects thus fails over the wheel as in Blender."""
    file = tmp_path / "scene.blend"
    save = f"import bpy; bpy.ops.wm.save_as_mainfile(filepath={str(file)!r})"
    empty_blender.run("--background", "--python-expr", save)
    # The wheel of 4.5 crashes on exit if a command is still registered; add-ons unregister theirs.
    register = (
        "import atexit, bpy;"
        "tell = bpy.utils.register_cli_command('tell', lambda _: 40 + (bpy.context.window is None));"
        "atexit.register(bpy.utils.unregister_cli_command, tell)"
    )
    assert empty_blender.start("--background", file, "--python-expr", register, "--command", "tell").returncode == 41


def test_downloads_are_one_for_each_python_system_and_machine():
    plan = downloads(
        [
            "gwyfile-0.3.0-py3-none-any.whl",
            "xatlas-0.0.11-cp311-cp311-manylinux_2_17_x86_64.manylinux2014_x86_64.whl",
            "openexr-3.5.3-cp311-cp311-manylinux_2_28_x86_64.whl",
            "openexr-3.5.3-cp311-cp311-win_amd64.whl",
            "openexr-3.5.3-cp311-cp311-win_arm64.whl",
            "openexr-3.5.3-cp311-cp311-macosx_11_0_arm64.whl",
        ]
    )
    assert [(one.python_tag, one.system, len(one.requirements)) for one in plan] == [
        ("py3", "any", 1),
        ("cp311", "manylinux_x86_64", 2),
        ("cp311", "win_amd64", 1),
        ("cp311", "win_arm64", 1),
        ("cp311", "macosx_arm64", 1),
    ]
    assert plan[1].platforms == {"manylinux_2_17_x86_64", "manylinux2014_x86_64", "manylinux_2_28_x86_64"}


def test_every_requirement_is_pinned():
    assert not [pin for one in ALL for pin in dependency_group(one.name) if "==" not in pin]


def test_pytest_arguments_are_told_from_paths():
    paths, options = split_arguments(["tests/package/test_arguments.py::test_x", "-k", "dev", "-x"])
    assert [path.name for path in paths] == ["test_arguments.py::test_x"]
    assert options == ["-k", "dev", "-x"]

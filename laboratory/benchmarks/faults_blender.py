# SPDX-License-Identifier: GPL-3.0-or-later
"""The faults of `./dev bench faults` that hit a .blend file or the extension in Blender.

Each fault runs in a Blender process of its own: python -m laboratory.benchmarks.faults_blender NUMBER FOLDER"""

import contextlib
import io
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from .faults_bake import ROOT, scan_in
from .faults_case import Case, SkipFault, assert_no_leftovers, contents, read_only, small_disk

_PATIENCE = 240.0


class _Session:
    """A background Blender with the extension, and a .blend that shows a bake beside it."""

    def __init__(self, folder: Path) -> None:
        # Blender reads these once, when it starts, which is below.
        os.environ["BLENDER_USER_RESOURCES"] = str(folder / "user")
        os.environ["NATURAL_GRATINGS_CACHE"] = str(folder / "cache")
        (folder / "user").mkdir()
        from devtools import EXTENSION
        from devtools.blender_shim import show_hidden_packages
        from devtools.extension import AddonModules, link_extension

        link_extension(folder / "user")
        show_hidden_packages()
        import addon_utils
        import bpy

        self.folder, self.bpy = folder, bpy
        self.addon = AddonModules(addon_utils.enable(EXTENSION, default_set=True).__name__)
        self.home = folder / "home"
        self.home.mkdir()

    @property
    def grating(self) -> Any:
        return self.bpy.context.scene.natural_gratings.active()

    def save(self) -> None:
        self.bpy.ops.wm.save_as_mainfile(filepath=str(self.home / "shot.blend"))

    def open(self, file: Path) -> None:
        self.bpy.ops.wm.open_mainfile(filepath=str(file))

    def fill(self) -> None:
        """Import the scan, bake it beside the .blend, assign it, and save."""
        bpy = self.bpy
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        bpy.ops.mesh.primitive_plane_add()
        scan_in(self.home)
        self.save()
        bpy.ops.grating.import_height_map(filepath=str(self.home / "skin.png"), size_um=4, height_nm=100)
        self.grating.delta_e = 9.0
        assert self.press("bake", directory="//bakes") == "" and self.press("assign") == ""
        self.grating.bake_path, self.grating.source = "//bakes/skin.exr", "//skin.png"
        self.save()

    def press(self, button: str, **settings: Any) -> str:
        """Press a button. Returns the line of its refusal, "" if it did its work."""
        for thing in self.bpy.context.scene.objects:
            thing.select_set(thing.type == "MESH")
            self.bpy.context.view_layer.objects.active = thing
        try:
            assert getattr(self.bpy.ops.grating, button)(**settings) == {"FINISHED"}
        except RuntimeError as error:
            line = str(error).strip()
            assert "Traceback" not in line, "a traceback"
            assert line.startswith("Error: ") and len(line.splitlines()) == 1, line
            return line
        return ""

    def unpack(self) -> None:
        """Unpack all pictures into files beside the .blend."""
        for image in self.bpy.data.images:
            if image.packed_file is not None:
                image.unpack(method="WRITE_LOCAL")

    def assert_shown(self) -> None:
        """The material is whole, and Assign finds the bake."""
        assert self.grating.own_group is not None, "the material is lost"
        assert self.press("assign") == "", "Assign refuses"
        assert not self.addon.lost_parts.lost_of_own(self.grating.own_group), "a picture is lost"


def _moved(session: _Session, *, packed: bool) -> str:
    session.fill()
    if not packed:
        session.unpack()
        session.save()
    away = session.folder / "away"
    session.home.rename(away)
    session.open(away / "shot.blend")
    session.assert_shown()
    assert session.addon.finding_bakes.bake_of(session.grating) == away / "bakes" / "skin.exr", "another bake"
    return "the bake, beside the file"


def _as_on_windows(session: _Session) -> str:
    """All relative paths have backslashes after `//`, as Blender on Windows saves them."""
    session.fill()
    session.unpack()
    grating = session.grating
    grating.bake_path, grating.source = "//bakes\\skin.exr", "//.\\skin.png"
    for image in session.bpy.data.images:
        image.filepath = "//" + image.filepath[2:].replace("/", "\\") if image.filepath else ""
    session.save()
    session.open(session.home / "shot.blend")
    session.assert_shown()
    assert session.press("bake") == "", "Bake Grating refuses"
    return "the bake and the scan, as on Windows"


def _of_a_windows_drive(session: _Session) -> str:
    """The bake's pictures are packed, so the material stays; only another bake needs the scan."""
    session.fill()
    grating = session.grating
    grating.bake_path, grating.source = "C:\\bakes\\skin.exr", "C:\\scans\\skin.png"
    session.save()
    session.open(session.home / "shot.blend")
    session.assert_shown()
    assert session.addon.finding_bakes.bake_of(session.grating).is_file(), "the bake is lost"
    return session.press("bake")


def _pictures_deleted(session: _Session) -> str:
    session.fill()
    session.unpack()
    session.save()
    shutil.rmtree(session.home / "textures")
    shutil.rmtree(session.home / "bakes")
    session.open(session.home / "shot.blend")
    line = session.press("assign")
    assert session.press("bake") == "", "Bake Again refuses"
    session.assert_shown()
    return line


def _of_a_server(session: _Session) -> str:
    session.fill()
    before = contents(session.home)
    line = session.press("bake", directory="\\\\server\\share\\bakes") if os.sep == "/" else ""
    assert contents(session.home) == before, "files are left"
    session.assert_shown()
    return line


def _disk(session: _Session, *, full: bool) -> str:
    """The cache's disk, where Blender's bakes lie too. The grating stays as it was."""
    session.fill()
    session.grating.delta_e = 8.0
    bake, cache = session.grating.bake_path, session.folder / "cache"
    shutil.rmtree(cache)
    cache.mkdir()
    with small_disk(cache, 64) if full else read_only(cache):
        line = session.press("bake")
        assert_no_leftovers(cache)
    assert line and session.grating.bake_path == bake, "the grating lost its bake"
    session.assert_shown()
    return line


def _two_blenders(session: _Session) -> str:
    """Two Blenders bake one scan at once, in one cache."""
    session.fill()
    shutil.rmtree(session.folder / "cache")
    command = [sys.executable, str(ROOT / "devtools" / "blender_shim.py")]
    script = "import bpy; g = bpy.context.scene.natural_gratings.active(); g.delta_e = 7; bpy.ops.grating.bake(); "
    script += "print('baked', g.bake_path)"
    words = ["--background", str(session.home / "shot.blend"), "--python-expr", script]
    both = [subprocess.Popen([*command, *words], stdout=subprocess.PIPE, text=True, cwd=ROOT) for _ in range(2)]
    told = {line for each in both for line in each.communicate(timeout=_PATIENCE)[0].splitlines() if "baked " in line}
    assert len(told) == 1 and Path(next(iter(told)).split(maxsplit=1)[1]).is_file(), told
    assert_no_leftovers(session.folder / "cache", Path(next(iter(told)).split(maxsplit=1)[1]).parent)
    return "both have the bake"


_INJECTED: dict[str, Callable[[_Session], str]] = {
    "a .blend and its folder are moved, pictures packed": partial(_moved, packed=True),
    "a .blend and its folder are moved, pictures unpacked": partial(_moved, packed=False),
    "a .blend with backslash paths, as saved on Windows": _as_on_windows,
    "a .blend with paths of a Windows drive": _of_a_windows_drive,
    "a .blend whose unpacked pictures and bake are deleted": _pictures_deleted,
    r"a bake into \\server\share on Linux": _of_a_server,
    "Bake Grating, the cache's disk is full": partial(_disk, full=True),
    "Bake Grating, the cache is read-only": partial(_disk, full=False),
    "two Blenders on one cache at once": _two_blenders,
}


def _inject(name: str, folder: Path) -> str:
    """Run a fault in a process of its own."""
    command = [sys.executable, "-P", "-m", __spec__.name if __spec__ else __name__, name, str(folder)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=_PATIENCE, check=False)
    told = [line for line in done.stdout.splitlines() if line.startswith('{"fault"')]
    assert told, f"Blender ended with status {done.returncode}: {done.stderr[-300:]}"
    found = json.loads(told[-1])["fault"]
    if found["skipped"]:
        raise SkipFault(found["skipped"])
    assert not found["failed"], found["failed"]
    assert "Traceback" not in done.stderr + done.stdout, "a traceback"
    return found["sees"]


CASES = [Case(name, partial(_inject, name)) for name in _INJECTED]


def _run(name: str, folder: Path) -> None:
    found = {"sees": "", "skipped": "", "failed": ""}
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            found["sees"] = _INJECTED[name](_Session(folder))
    except SkipFault as reason:
        found["skipped"] = str(reason)
    except AssertionError as harm:
        found["failed"] = str(harm) or "an assertion"
    print("\n" + json.dumps({"fault": found}), flush=True)


if __name__ == "__main__":
    _run(sys.argv[1], Path(sys.argv[2]))
    os._exit(0)  # at exit, Blender 4.5 may wait for ever for the thread that closes its sound device

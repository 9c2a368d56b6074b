# SPDX-License-Identifier: GPL-3.0-or-later
"""The working tree as an installed extension: links in a Blender user folder, so no copy gets outdated."""

import importlib
import re
import zipfile
from functools import cache
from pathlib import Path
from types import ModuleType

from . import ROOT

LINKED = ("__init__.py", "addon", "precompute")
WHEELS_LIST = re.compile(r"^wheels = \[.*?^\]\n", re.DOTALL | re.MULTILINE)


def write_if_changed(path: Path, text: str) -> None:
    """Write the text unless the file already has it, because Blender checks its add-ons again if a manifest changes."""
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def link(path: Path, target: Path) -> None:
    if not (path.is_symlink() and path.readlink() == target):
        path.unlink(missing_ok=True)
        path.symlink_to(target)


def link_extension(user_folder: Path, wheels: bool = False) -> Path:
    """Link the working tree into `user_folder` (a BLENDER_USER_RESOURCES) as natural_gratings. Returns the folder.

    Without `wheels` the manifest lists no wheels, because the environment of a bpy wheel has the packages."""
    folder = user_folder / "extensions" / "user_default" / "natural_gratings"
    folder.mkdir(parents=True, exist_ok=True)
    manifest = (ROOT / "blender_manifest.toml").read_text()
    write_if_changed(folder / "blender_manifest.toml", manifest if wheels else WHEELS_LIST.sub("", manifest))
    for name in (*LINKED, "wheels") if wheels else LINKED:
        link(folder / name, ROOT / name)
    # These links lead nowhere until `./dev build` makes the drafts, and `./dev docs` the manual.
    link(folder / "drafts", ROOT / "drafts")
    link(folder / "manual", ROOT / "dist" / "docs")
    return folder


def unpack_extension(package: Path, user_folder: Path) -> Path:
    """Unpack a zip of `./dev build` into `user_folder` in place of link_extension's links. Returns the folder. The
    wheels are left out, because the environment of a bpy wheel has the packages."""
    folder = user_folder / "extensions" / "user_default" / "natural_gratings"
    with zipfile.ZipFile(package) as archive:
        archive.extractall(folder, [name for name in archive.namelist() if not name.startswith("wheels/")])
    manifest = folder / "blender_manifest.toml"
    manifest.write_text(WHEELS_LIST.sub("", manifest.read_text()))
    return folder


class AddonModules:
    """The modules of an enabled extension's add-on as attributes, each by its file's name: `sky` is lamps/sky.py."""

    def __init__(self, extension_name: str) -> None:
        self.package = importlib.import_module(f"{extension_name}.addon")

    def __getattr__(self, name: str) -> ModuleType:
        if name not in _dotted_names():
            raise AttributeError(f"no file {name}.py in addon/")
        module = importlib.import_module(f"{self.package.__name__}.{_dotted_names()[name]}")
        setattr(self, name, module)
        return module


@cache
def _dotted_names() -> dict[str, str]:
    """The dotted name within addon/ of each module, by its file's name."""
    folder = ROOT / "addon"
    files = [path.relative_to(folder).with_suffix("") for path in folder.rglob("*.py")]
    return {file.name: ".".join(file.parts) for file in files}

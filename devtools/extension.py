# SPDX-License-Identifier: GPL-3.0-or-later
"""The working tree as an installed extension: links in a Blender user folder, so that no copy goes stale."""

import importlib
import re
from pathlib import Path
from types import SimpleNamespace

from . import ROOT

LINKED = ("__init__.py", "addon", "precompute")
# The add-on's modules that tests and benchmarks call, by short names.
MODULES = {
    "add_snake": "actions.add_snake",
    "adopt": "actions.adopt",
    "assign": "actions.assign",
    "bake": "actions.bake",
    "comb": "actions.comb",
    "level_preview": "actions.level_preview",
    "level_steps": "operators.level_steps",
    "levelling": "scene.levelling",
    "remove": "actions.remove",
    "grating_material": "actions.material",
    "import_height_map": "actions.import_height_map",
    "import_operator": "operators.import_height_map",
    "osl_reference": "actions.osl_reference",
    "commands": "batch.commands",
    "child": "jobs.child",
    "find": "lamps.find",
    "seams": "frames.seams",
    "arrows": "frames.arrows",
    "combed": "frames.combed",
    "direction_lines": "actions.direction_lines",
    "unwrap": "actions.unwrap",
    "unwrap_operator": "operators.unwrap",
    "frame_source": "scene.frame_source",
    "choose_frame": "actions.frame_source",
    "vary": "actions.vary",
    "variation": "scene.variation",
    "frame_map": "frames.frame_map",
    "bake_frame_map": "actions.frame_map",
    "field": "frames.field",
    "frame": "frames.frame",
    "sky": "lamps.sky",
    "constants": "nodes.constants",
    "fit_world": "actions.fit_world",
    "facts": "ui.facts",
    "changes": "scene.changes",
    "follow": "lamps.follow",
    "lamps": "actions.lamps",
    "handlers": "actions.handlers",
    "pack": "lamps.pack",
    "read": "lamps.read",
    "group": "lamps.group",
    "direct": "materials.direct.response",
    "material": "materials.material",
    "mesa": "scene.mesa",
    "data_pictures": "materials.data_pictures",
    "osl_baked": "materials.osl.baked",
    "osl_script": "materials.osl.script",
    "osl_thesis": "materials.osl.thesis",
    "lost": "materials.lost",
    "mend": "actions.mend",
    "pictures": "materials.pictures",
    "replace": "materials.replace",
    "restore": "actions.restore",
    "response": "materials.response",
    "skin": "materials.skin",
    "users": "materials.users",
    "builder": "nodes.builder",
    "interface": "nodes.interface",
    "report": "operators.report",
    "panel": "ui.panel",
    "steps_panel": "ui.steps_panel",
    "bakes": "scene.bakes",
    "compat": "scene.compat",
    "gratings": "scene.gratings",
    "guard": "scene.guard",
    "snake_body": "snakes.body",
    "snake_lattice": "snakes.lattice",
    "snake_shape": "snakes.shape",
    "snake_spine": "snakes.spine",
    "snake_poses": "snakes.poses",
    "snake_species": "snakes.species",
    "footprint": "materials.footprint",
    "overlay": "actions.overlay",
    "settings": "actions.settings",
    "fan": "actions.fan",
    "needs": "actions.needs",
    "outside": "actions.outside",
    "region": "scene.region",
    "cameras": "views.cameras",
    "look": "views.look",
    "moving": "views.moving",
    "seen": "views.seen",
    "sent": "lamps.sent",
    "shown": "lamps.shown",
    "strength": "lamps.strength",
    "fingerprint": "worlds.fingerprint",
    "probe": "worlds.probe",
    "stand_alone": "worlds.stand_alone",
}
WHEELS_LIST = re.compile(r"^wheels = \[.*?^\]\n", re.DOTALL | re.MULTILINE)


def write_if_changed(path: Path, text: str) -> None:
    """Write the text unless the file holds it already: Blender checks its add-ons anew when a manifest is newer than
    its notes."""
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def link(path: Path, target: Path) -> None:
    if not (path.is_symlink() and path.readlink() == target):
        path.unlink(missing_ok=True)
        path.symlink_to(target)


def link_extension(user_folder: Path, wheels: bool = False) -> Path:
    """Put the working tree into `user_folder` (a BLENDER_USER_RESOURCES) as natural_gratings; returns the place.

    Without `wheels` the manifest names no wheels, because the environment around a bpy wheel has the packages itself.
    """
    folder = user_folder / "extensions" / "user_default" / "natural_gratings"
    folder.mkdir(parents=True, exist_ok=True)
    manifest = (ROOT / "blender_manifest.toml").read_text()
    write_if_changed(folder / "blender_manifest.toml", manifest if wheels else WHEELS_LIST.sub("", manifest))
    for name in (*LINKED, "wheels") if wheels else LINKED:
        link(folder / name, ROOT / name)
    return folder


def addon_modules(extension_name: str) -> SimpleNamespace:
    """The modules of an enabled extension's add-on by their short names, and the add-on itself as `package`."""
    root = f"{extension_name}.addon"
    found = {short: importlib.import_module(f"{root}.{path}") for short, path in MODULES.items()}
    return SimpleNamespace(package=importlib.import_module(root), **found)

# SPDX-License-Identifier: GPL-3.0-or-later
"""What the verbs share: the gratings and objects that they work on, inputs as NAME=VALUE, and saving the file.

By default a verb works on the active grating and on the selected objects."""

import argparse
import math
from collections.abc import Iterable, Mapping
from pathlib import Path

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.cli.arguments import name_argument, path_argument
from ..blender.written import save_copy
from ..gratings.grating import Grating, active_grating
from ..materials.holograms.hologram_nodes import input_set_by_artist
from ..materials.material import diffraction_nodes, shown_by
from ..nodes.interface import Socket


def add_objects(parser: argparse.ArgumentParser, default: str = "the selected meshes") -> None:
    """Add the option that names objects. `default` is what the verb takes without it, for the help."""
    parser.add_argument(
        "--object",
        action="append",
        type=name_argument,
        metavar="NAME",
        help=f"a mesh (repeatable); default: {default}",
    )


def chosen_objects(names: list[str] | None) -> list[bpy.types.Object]:
    """The objects with these names, including hidden and unselectable ones; without names, the selected objects. Named
    objects become the selection, as far as Blender allows. Raises GratingError if one is missing."""
    if not names:
        return [o for o in bpy.context.view_layer.objects if o.select_get()]
    objects = bpy.context.view_layer.objects
    for name in names:
        if name not in objects:
            raise GratingError(name, "no such object in the scene", f"there are {', '.join(o.name for o in objects)}")
    for candidate in objects:
        candidate.select_set(candidate.name in names)
    return [objects[name] for name in dict.fromkeys(names)]


def chosen_meshes(names: list[str] | None) -> list[bpy.types.Object]:
    """The meshes with these names, by default the selected ones. Raises GratingError if there is none."""
    chosen = chosen_objects(names)
    meshes = [o for o in chosen if o.type == "MESH"]
    if not meshes:
        told = ", ".join(o.name for o in chosen) or f"scene {bpy.context.scene.name}"
        raise GratingError(told, "no mesh is selected", "name one by --object")
    return meshes


def add_grating_option(parser: argparse.ArgumentParser) -> None:
    """Add the option that names a grating."""
    parser.add_argument(
        "--grating", type=name_argument, metavar="NAME", help="grating of the scene; default: the active one"
    )


def add_gratings(parser: argparse.ArgumentParser) -> None:
    """Add the options that choose gratings, by name or by the meshes that show them."""
    add_grating_option(parser)
    add_objects(parser, default="the active grating, whatever shows it")


def chosen_grating(scene: bpy.types.Scene, name: str | None) -> Grating:
    """The grating with a name, by default the active one. Raises GratingError if there is none, or several."""
    items = scene.natural_gratings.items
    if name is None:
        return active_grating(scene)
    if [each.name for each in items].count(name) > 1:
        raise GratingError(f"--grating {name}", "several gratings have this name", "rename all but one")
    if name not in items:
        raise GratingError(f"--grating {name}", "no such grating", f"there are {', '.join(items.keys()) or 'none'}")
    return items[name]


def chosen_gratings(scene: bpy.types.Scene, arguments: argparse.Namespace) -> list[Grating]:
    """The gratings that --grating or --object choose, by default the active one. Raises GratingError if both are given,
    or if a named mesh shows no grating of the scene."""
    if not arguments.object:
        return [chosen_grating(scene, arguments.grating)]
    if arguments.grating is not None:
        raise GratingError("--grating", "--object is given too", "give one of them")
    meshes = chosen_meshes(arguments.object)
    shown = {index: set(shown_by(each.group)) for index, each in enumerate(scene.natural_gratings.items)}
    bare = [mesh.name for mesh in meshes if not any(mesh in things for things in shown.values())]
    if bare:
        raise GratingError(", ".join(bare), "no grating of the scene is on it", "use `assign` first")
    return [scene.natural_gratings.items[index] for index, things in shown.items() if things & set(meshes)]


def add_save(parser: argparse.ArgumentParser) -> None:
    """Add the option for the path of the saved file."""
    parser.add_argument("--save", type=path_argument, metavar="BLEND", help="save the file here; default: in place")


def save(path: Path | None) -> None:
    """Save the open file, whole or not at all, to a path or in place; a file that was there stays as .blend1, unless
    the preferences want no versions. Raises GratingError if it was never saved and no path is given, or if it cannot be
    written."""
    if path is None and not bpy.data.filepath:
        raise GratingError("", "the scene has no file yet", "give --save FILE.blend")
    target = Path(path or bpy.data.filepath).resolve()
    save_copy(target, keep=bpy.context.preferences.filepaths.save_version > 0)


def finish(arguments: argparse.Namespace, report: Iterable[GratingError | str]) -> None:
    """Save the file that a verb has changed, and print its lines. Raises GratingError as `save` does."""
    save(arguments.save)
    print("\n".join(map(printable, report)))


def setting(text: str, inputs: Mapping[str, Socket]) -> tuple[str, float]:
    """Parse NAME=VALUE, angles in degrees. Raises GratingError for an unknown input and for a value outside its
    range."""
    name, _, given = text.partition("=")
    socket = inputs.get(name)
    if socket is None:
        raise GratingError(f"--set {text}", "no such input", f"there are {', '.join(inputs)}")
    try:
        value = float(given)
    except ValueError:
        value = math.nan
    value = math.radians(value) if socket.subtype == "ANGLE" else value
    assert socket.low is not None and socket.high is not None  # every input with a default has a range
    if not socket.low <= value <= socket.high:
        unit = " degrees" if socket.subtype == "ANGLE" else ""
        low, high = (math.degrees(x) if unit else x for x in (socket.low, socket.high))
        raise GratingError(f"--set {text}", "", f"{name} is a number from {low:g} to {high:g}{unit}")
    return name, value


def set_inputs(objects: Iterable[bpy.types.Object], group: bpy.types.NodeTree, values: dict[str, float]) -> None:
    """Set inputs of a grating's Diffraction nodes in the materials of objects."""
    materials = {slot.material for thing in objects for slot in thing.material_slots}
    for node in (node for material in materials for node in diffraction_nodes(material) if node.node_tree == group):
        for name, value in values.items():
            input_set_by_artist(node, name).default_value = value

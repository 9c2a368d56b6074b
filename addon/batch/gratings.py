# SPDX-License-Identifier: GPL-3.0-or-later
"""The gratings that a verb works on: one by its name, those on named meshes, or by default the active one."""

import argparse

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.cli.option_types import name_argument
from ..gratings.grating import Grating, active_grating
from ..materials.group_users import shown_by
from .objects import add_objects, chosen_meshes


def add_grating(parser: argparse.ArgumentParser) -> None:
    """Add the option that names a grating."""
    parser.add_argument(
        "--grating", type=name_argument, metavar="NAME", help="grating of the scene; default: the active one"
    )


def add_gratings(parser: argparse.ArgumentParser) -> None:
    """Add the options that choose gratings, by name or by the meshes that show them."""
    add_grating(parser)
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

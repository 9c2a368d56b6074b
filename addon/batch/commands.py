# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line inside Blender. Its verbs call the same functions as the buttons, and read many options from the
buttons' properties (operator_options.py).

Each verb works on the file that is open in Blender. A verb that changes the file saves it, by default in place."""

import argparse
import importlib
import os.path
import re
import sys
from collections.abc import Sequence
from itertools import takewhile

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.cli.parser import OneLineParser, exit_status
from ...precompute.cli.printing import check_targets
from ..blender.session import in_window
from ..blender.written import fault_of

# Modules of this folder, and help texts. Of the verb `direction-map` a module has direction_map_options(parser) and
# run_direction_map(arguments).
VERBS = {
    "import": ("bake_verbs", "add a height map to the scene"),
    "bake": ("bake_verbs", "import a height map and bake it"),
    "assign": ("material_verbs", "put a bake's material on meshes and save the file"),
    "vary": ("material_verbs", "vary a bake's material over the meshes with it and save the file"),
    "hologram": ("material_verbs", "give the gratings on meshes a hologram's pattern and save the file"),
    "sticker": ("material_verbs", "stick a piece of foil with a grating on a mesh and save the file"),
    "light-rig": ("light_verbs", "add lamps that bring out a grating's colours and save the file"),
    "lights": ("light_verbs", "choose the lights that gratings respond to, and save the file"),
    "direction": ("direction_verbs", "choose what the direction of gratings follows, and save the file"),
    "needs": ("bake_verbs", "measure which part of a bake the scene needs, bake only that, and save the file"),
    "comb": ("direction_verbs", "store a smooth direction on meshes and save the file"),
    "unwrap": ("direction_verbs", "give meshes a UV map without overlaps and save the file"),
    "direction-map": ("direction_verbs", "bake a grating's direction into a picture and save the file"),
    "diffraction-lamp": ("light_verbs", "add a Diffraction Lamp to a mesh with a grating and save the file"),
    "cache": ("file_verbs", "list, prune or verify the cache of bakes"),
    "assets": ("file_verbs", "write the presets as an asset library for Blender's Asset Browser"),
    "job": ("job_verb", "render all pictures of a job: frames, cameras, lamps, gratings, engines"),
    "render": ("file_verbs", "render the open file's scene to a picture"),
}
_BLEND = re.compile(r"\.blend\d*", re.IGNORECASE)


def execute(argv: Sequence[str]) -> int:
    """Run one verb and return Blender's exit status."""
    try:
        arguments = build_parser(argv).parse_args(argv)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else 0
    return exit_status(lambda: _run(arguments))


def _run(arguments: argparse.Namespace) -> object:
    check_opened(sys.argv)
    check_targets(arguments)
    try:
        with in_window():
            return arguments.run(arguments)
    except RuntimeError as error:  # from Blender's own operators, such as save and render
        raise GratingError(
            "Blender", fault_of(error), "check the path, its permissions, and the space left there"
        ) from error


def check_opened(line: Sequence[str]) -> None:
    """Raise GratingError if Blender's command line names a file that is not the open one. A script on the line may have
    opened or saved another."""
    own = list(takewhile(lambda word: word not in ("-c", "--command", "--"), line))
    named = [word for word in own if _BLEND.fullmatch(os.path.splitext(word)[1])]
    if not named:
        return
    asked, opened = named[-1], bpy.data.filepath
    if not os.path.exists(asked):
        raise GratingError(asked, "there is no such file", "correct its path")
    with_script = any(word.startswith(("-P", "--python")) for word in own)
    if not opened or not (with_script or os.path.samefile(asked, opened)):
        raise GratingError(asked, "Blender did not open it", "open it in a window of Blender to see why")


def build_parser(argv: Sequence[str] = tuple(VERBS)) -> OneLineParser:
    """The parser of all verbs. Only verbs in `argv` are imported and know their arguments."""
    parser = OneLineParser(prog="blender --command grating", description="Diffraction gratings in batch.")
    verbs = parser.add_subparsers(required=True, metavar="VERB", parser_class=OneLineParser)
    for name, (module_name, text) in VERBS.items():
        verb = verbs.add_parser(name, help=text)
        if name in argv:
            module, word = importlib.import_module(f".{module_name}", __package__), name.replace("-", "_")
            getattr(module, f"{word}_options")(verb)
            verb.set_defaults(run=getattr(module, f"run_{word}"))
    return parser

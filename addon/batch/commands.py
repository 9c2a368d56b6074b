# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line inside Blender. Its verbs call the same functions as the buttons.

Each verb works on the file that is open in Blender. A verb that changes the file saves it, by default in place."""

import argparse
import importlib
import sys
from collections.abc import Sequence

from ...precompute.base.failure import GratingError
from ...precompute.cli.parser import OneLineParser, exit_status
from ...precompute.cli.printing import check_targets
from ..blender.session import in_window
from .opened_file import check_opened

# Modules of this folder with add_arguments(parser) and run(arguments), and help texts.
VERBS = {
    "import": ("import_command", "add a height map to the scene"),
    "bake": ("bake_command", "import a height map and bake it"),
    "assign": ("assign_command", "put a bake's material on meshes and save the file"),
    "vary": ("vary_command", "vary a bake's material over the meshes with it and save the file"),
    "hologram": ("hologram_command", "give the gratings on meshes a hologram's pattern and save the file"),
    "sticker": ("sticker_command", "stick a piece of foil with a grating on a mesh and save the file"),
    "light-rig": ("light_rig_command", "add lamps that bring out a grating's colours and save the file"),
    "lights": ("lights_command", "choose the lights that gratings respond to, and save the file"),
    "direction": ("direction_command", "choose what the direction of gratings follows, and save the file"),
    "needs": ("needs_command", "measure which part of a bake the scene needs, bake only that, and save the file"),
    "comb": ("comb_command", "store a smooth direction on meshes and save the file"),
    "unwrap": ("unwrap_command", "give meshes a UV map without overlaps and save the file"),
    "direction-map": ("direction_map_command", "bake a grating's direction into a picture and save the file"),
    "diffraction-lamp": (
        "diffraction_lamp_command",
        "add a Diffraction Lamp to a mesh with a grating and save the file",
    ),
    "cache": ("cache_command", "list, prune or verify the cache of bakes"),
    "assets": ("assets_command", "write the presets as an asset library for Blender's Asset Browser"),
    "job": ("job_command", "render all pictures of a job: frames, cameras, lamps, gratings, engines"),
    "render": ("render_command", "render the open file's scene to a picture"),
}


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
        told = " ".join(str(error).split()).removeprefix("Error: ")
        raise GratingError("Blender", told, "check the path, its permissions, and the space left there") from error


def build_parser(argv: Sequence[str] = tuple(VERBS)) -> OneLineParser:
    """The parser of all verbs. Only verbs in `argv` are imported and know their arguments."""
    parser = OneLineParser(prog="blender --command grating", description="Diffraction gratings in batch.")
    verbs = parser.add_subparsers(required=True, metavar="VERB", parser_class=OneLineParser)
    for name, (module_name, text) in VERBS.items():
        verb = verbs.add_parser(name, help=text)
        if name in argv:
            module = importlib.import_module(f".{module_name}", __package__)
            module.add_arguments(verb)
            verb.set_defaults(run=module.run)
    return parser

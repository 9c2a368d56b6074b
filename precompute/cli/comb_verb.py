# SPDX-License-Identifier: GPL-3.0-or-later
"""`comb`: smooth direction fields on the meshes that Comb Grating in Blender writes."""

import argparse
from pathlib import Path

from ..base.failure import GratingError
from ..base.progress import part_of
from ..mesh.comb import comb
from ..mesh.mesh_files import read_mesh, write_combed
from .arguments import add_json, add_progress, path_argument
from .printing import Progress, emit, refuse_to_replace

# The shown length of a mesh's name, which is Blender's limit.
_NAME_MAX = 255
# The stage in which a mesh may still be refused.
_READING = "reading the mesh"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `comb`."""
    parser.add_argument("mesh", nargs="+", type=path_argument, metavar="MESH.npz", help="as Comb Grating writes it")
    parser.add_argument(
        "-o",
        "--output",
        required=True,
        type=path_argument,
        metavar="DIR",
        help="folder for the combed meshes, of the same names",
    )
    add_json(parser)
    add_progress(parser)


def progress_of(arguments: argparse.Namespace) -> Progress:
    """The progress of a comb, in the style of --progress."""
    return Progress(arguments.progress, may_be_refused=(_READING,))


def run(arguments: argparse.Namespace) -> None:
    """Run the verb `comb`."""
    progress = progress_of(arguments)
    names = [path.name for path in arguments.mesh]
    if len(set(names)) < len(names):
        raise GratingError("MESH.npz", "two have one name", "give them different names")
    refuse_to_replace(arguments.mesh, [arguments.output / name for name in names])
    combed = {}
    for number, path in enumerate(arguments.mesh):
        progress(_READING, number / len(names))
        polygons, request = read_mesh(path)
        part = part_of(progress, "combing", done=number, total=len(names))
        name = str(request.get("name", path.stem))[:_NAME_MAX]
        combed[path.name] = comb(name, polygons, request, progress=part)
    arguments.output.mkdir(parents=True, exist_ok=True)
    for name, field in combed.items():
        write_combed(arguments.output / name, field)
    facts = [
        {
            "file": str(Path(arguments.output) / name),
            "singular": int((field.index != 0).sum()),
            "flips": int((field.index == 0).sum()),
            "index": int(field.index.sum()),
            "residual": field.residual,
        }
        for name, field in combed.items()
    ]
    lines = [f"{fact['file']}: {fact['singular']} singular points, residual {fact['residual']:.1e}" for fact in facts]
    emit({"meshes": facts}, arguments.json, lambda: lines)

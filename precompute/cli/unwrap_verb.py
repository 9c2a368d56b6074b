# SPDX-License-Identifier: GPL-3.0-or-later
"""`unwrap`: a UV map of a mesh without overlaps, by xatlas."""

import argparse
import time

import numpy as np

from ..base.files import write_whole
from ..mesh.unwrap import Packing, read_mesh, unwrap
from .arguments import add_json, add_progress, count, number, path_argument
from .printing import Progress, emit, refuse_to_replace


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `unwrap`."""
    parser.add_argument(
        "mesh", type=path_argument, metavar="MESH.npz",
        help="arrays points (n, 3), triangles (m, 3) and polygons (m,): the face of each triangle",
    )  # fmt: skip
    parser.add_argument("-o", "--output", required=True, type=path_argument, metavar="DIR", help="folder for uv.npz")
    parser.add_argument(
        "--size", type=count(16, 1 << 15), default=1024, metavar="PIXELS", help="of the map; default 1024"
    )
    parser.add_argument("--padding", type=count(0, 256), default=4, metavar="PIXELS", help="between islands; default 4")
    parser.add_argument(
        "--density", type=number(0, 1e9), default=0.0, metavar="PER_METRE",
        help="pixels per metre of the surface; default 0: as many as the map holds",
    )  # fmt: skip
    add_json(parser)
    add_progress(parser)


def run(arguments: argparse.Namespace) -> None:
    """Run the verb `unwrap`: write uv.npz with the array uv (m, 3, 2), the UV of each triangle's corners."""
    begun = time.monotonic()
    packing = Packing(arguments.size, arguments.padding, arguments.density)
    path = arguments.output / "uv.npz"
    refuse_to_replace([arguments.mesh], [path])
    found = unwrap(read_mesh(arguments.mesh), packing, progress=Progress(arguments.progress))
    arguments.output.mkdir(parents=True, exist_ok=True)
    write_whole(path, lambda partial: np.savez(partial, uv=found.uv))
    facts = {"files": [str(path)], "islands": found.islands, "filled": found.filled}
    facts["seconds"] = time.monotonic() - begun
    emit(facts, arguments.json, lambda: [f"{path}: {found.islands} islands fill {found.filled:.0%} of the map"])

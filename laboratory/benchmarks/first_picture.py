# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds from opening a file to EEVEE's first picture, most of which EEVEE spends compiling shaders.

    ./dev bench first_picture [--lamps 1 --lamps 3] [--limit SECONDS] [--json FILE|-]

Each row is a file with a sphere under a number of suns. A separate process opens and renders it (64 x 64 pixels, 1
sample). Mesa's shader cache is off, so that each process compiles everything, including EEVEE's own shaders. The first
row, a Principled metal, shows how long EEVEE's own shaders take. The table gives wall seconds, and processor seconds,
which other work on the machine changes little.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser

from . import report
from .render_time import Studio, Subject

# The number of world sources that the default material gets beside its suns, in the rows with sources. A sky with a sun
# has one source, an HDRI of a room has more.
_SOURCES = 8
_OPEN = """
import bpy, sys, time
start = time.time(), time.process_time()
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
bpy.ops.render.render(write_still=True)
print("seconds", time.process_time() - start[1], time.time() - start[0])
"""


def main(argv: list[str] | None = None) -> int:
    """Print the table and return the exit status."""
    parser = OneLineParser(prog="./dev bench first_picture", description=__doc__.splitlines()[0])
    parser.add_argument("--lamps", type=count(1, 8), action="append", help="default: 1, 3 and 8")
    parser.add_argument("--limit", type=count(1, 36000), default=900, help="seconds after which a row is given up")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        rows = measured(Studio.started(Path(folder), 64), arguments)
    report.write({"rows": rows}, arguments.json)
    return 0


def measured(studio: Studio, arguments: argparse.Namespace) -> list[dict]:
    """Measure the rows, printing each as soon as it is known."""
    report.say(f"{'material':40}{'nodes':>7}{'processor s':>13}{'wall s':>8}", arguments.json)
    studio.build("sphere")
    lamps = arguments.lamps or [1, 3, 8]
    subjects = [(Subject("Principled metal", studio.metal), 0)]
    for told, made in (("", {}), (", shadow rays", {"shadows": True}), (", footprint", {"footprint": True})):
        make = partial(studio.direct, **made)
        subjects += [(Subject(f"lamps only, {n} suns{told}", make, n), 0) for n in lamps]
    for told, made in (("", {}), (", footprint", {"footprint": True})):
        make = partial(studio.direct, lights="REST", **made)
        for n, k in ((1, 0), (3, _SOURCES)):
            subjects.append((Subject(f"lamps and world, {n} suns, {k} sources{told}", make, n), k))
    rows = []
    for subject, sources in subjects:
        path = _saved(studio, subject, sources)
        seconds = _opened(path, arguments.limit)
        nodes = _nodes_of(studio.mesh.active_material.node_tree)
        rows.append({"material": subject.name, "lamps": subject.lamps, "nodes": nodes, "seconds": seconds})
        told = "{:13.1f}{:8.1f}".format(*seconds) if seconds else "given up"
        report.say(f"{subject.name:40}{nodes:7}{told:>21}", arguments.json)
    return rows


def _saved(studio: Studio, subject: Subject, sources: int) -> Path:
    """Save a file in which the sphere has the subject's material and EEVEE is the renderer."""
    import bpy

    studio.show(subject)
    skin = studio.addon.skin
    for group in filter(skin.is_diffraction, bpy.data.node_groups):
        if sources:
            skin.fill_group(group, skin.responses_in(group), [False] * subject.lamps, sources=sources)
    scene = studio.scene
    scene.render.engine, scene.eevee.taa_render_samples = studio.addon.compat.eevee_engine(), 1
    scene.render.resolution_x = scene.render.resolution_y = studio.pixels
    scene.render.filepath = str(studio.folder / "first.exr")
    path = studio.folder / "first.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def _opened(path: Path, limit: int) -> list[float] | None:
    """Processor and wall seconds of a process that opens and renders the file; None after `limit` seconds."""
    environment = os.environ | {"MESA_SHADER_CACHE_DISABLE": "true"}
    command = [sys.executable, "-c", _OPEN, str(path)]
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=limit, check=True)
    except subprocess.TimeoutExpired:
        return None
    line = next(line for line in done.stdout.splitlines() if line.startswith("seconds"))
    return [float(word) for word in line.split()[1:]]


def _nodes_of(tree) -> int:
    """The number of nodes that reach the output of a tree, including the nodes inside groups."""
    reached, left = set(), [node for node in tree.nodes if node.type in {"OUTPUT_MATERIAL", "GROUP_OUTPUT"}]
    while left:
        node = left.pop()
        if node not in reached:
            reached.add(node)
            left += [link.from_node for socket in node.inputs for link in socket.links]
    return sum(_nodes_of(node.node_tree) if node.type == "GROUP" else 1 for node in reached)

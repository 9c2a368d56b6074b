# SPDX-License-Identifier: GPL-3.0-or-later
"""What lamps of their own spectra cost: look-ups, memory and render time of bakes of three, six and nine channels.

    ./dev --bpy 5.2 bench lamp_spectra [--engine cycles --engine eevee] [--lamps 3] [--pixels 96] [--repeat 3]
        [--json FILE|-]

A sphere has the sample Elaphe under one sun and under several. Time is measured as in render_time, relative to a
Principled metal under the same suns. "Coloured": the suns are of 2700 K, of LED-B1 and of 10000 K by turns. Look-ups
are those of pictures that the material's output needs.
"""

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.colour.illuminants import canonical
from precompute.surface.readers.reader_registry import read_height_map
from precompute.table.atlas import read_header
from precompute.table.table import BYTES_PER_TEXEL

from . import report
from .render_time import Studio, Subject

_SAMPLES, _SURFACE = 32, "sample:elaphe"
_LIGHTS = {"three": "D65", "six": "smooth", "nine": "led"}
_SPECTRA = ("2700K", "LED-B1", "10000K")


@dataclass(frozen=True)
class Row:
    """A material: its bake's channels, and whether the suns are coloured."""

    channels: str
    coloured: bool

    @property
    def name(self) -> str:
        """The row's name."""
        return f"{self.channels} channels, {'coloured' if self.coloured else 'white'} suns"


ROWS = (
    *(Row(channels, False) for channels in _LIGHTS),
    *(Row(channels, True) for channels in ("six", "nine")),
)


def main(argv: list[str] | None = None) -> int:
    """Print the tables and return the exit status."""
    parser = OneLineParser(prog="./dev bench lamp_spectra", description=__doc__.splitlines()[0])
    parser.add_argument("--engine", action="append", choices=("cycles", "eevee"))
    parser.add_argument("--lamps", type=count(1, 32), action="append", help="default: 1 and 3")
    parser.add_argument("--pixels", type=count(4, 8192), default=96)
    parser.add_argument("--repeat", type=count(1, 1000), default=3)
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    facts = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        studio = Studio.started(folder, arguments.pixels)
        bakes = {"three": studio.bake} | {channels: _bake(folder, channels) for channels in ("six", "nine")}
        studio.build("sphere")
        for engine in arguments.engine or ("cycles", "eevee"):
            for lamps in arguments.lamps or (1, 3):
                facts += _measured(studio, bakes, engine, lamps, arguments)
    report.write({"rows": facts}, arguments.json)
    return 0


def _bake(folder: Path, channels: str) -> Path:
    request = BakeRequest(illuminant=canonical(_LIGHTS[channels]))
    made = bake_to_folder([read_height_map(_SURFACE)], request, folder / channels)
    return Path(made["files"][0])


def _measured(
    studio: Studio, bakes: dict[str, Path], engine: str, lamps: int, arguments: argparse.Namespace
) -> list[dict[str, Any]]:
    """Measure and print the rows of one engine and one number of suns."""
    subjects = [Subject("Principled metal", studio.metal, lamps)]
    subjects += [Subject(row.name, lambda row=row: _material(studio, bakes, row), lamps) for row in ROWS]
    least = np.full((len(subjects), 2), np.inf)
    look_ups = [0] * len(subjects)
    for _ in range(arguments.repeat):
        for index, subject in enumerate(subjects):
            studio.show(subject)
            least[index] = np.minimum(least[index], studio.spans(subject, engine, _SAMPLES))
            look_ups[index] = _look_ups(studio.mesh.material_slots[0].material.node_tree)
    us = 1e6 * (least[:, 1] - least[:, 0])
    report.say(f"\n{engine}, {lamps} suns, {arguments.pixels}^2 pixels", arguments.json)
    report.say(f"{'material':34}{'us':>8}{'to metal':>10}{'look-ups':>10}{'MiB':>8}", arguments.json)
    found = []
    for subject, cost, looked, row in zip(subjects, us, look_ups, (None, *ROWS), strict=True):
        mib = 0.0 if row is None else _mebibytes(bakes[row.channels])
        report.say(f"{subject.name:34}{cost:8.3f}{cost / us[0]:10.2f}{looked:10d}{mib:8.1f}", arguments.json)
        facts = {"engine": engine, "lamps": lamps, "material": subject.name, "look_ups": looked, "MiB": mib}
        found.append(facts | {"us": float(cost), "to_metal": float(cost / us[0])})
    return found


def _material(studio: Studio, bakes: dict[str, Path], row: Row) -> object:
    """The add-on's own material of a row, under suns of its spectra."""
    lamps = [thing for thing in studio.scene.objects if thing.type == "LIGHT"]
    for index, lamp in enumerate(lamps):
        lamp.data.diffraction_spectrum = _SPECTRA[index % len(_SPECTRA)] if row.coloured else ""
    studio.addon.follow.follow_lamps(studio.scene)
    studio.bake = bakes[row.channels]
    return studio.direct()


def _look_ups(tree: Any) -> int:
    """The number of look-ups in pictures that a material's output needs, inside of groups too."""
    (output,) = (node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    return len([node for node in _needed(output.inputs["Surface"], ()) if node[0].type == "TEX_IMAGE"])


def _needed(socket: Any, groups: tuple[Any, ...]) -> set[tuple[Any, tuple[Any, ...]]]:
    """The nodes, each with the group nodes that it is in, that an input needs."""
    found: set[tuple[Any, tuple[Any, ...]]] = set()
    pending = [(socket, groups)]
    done = set()
    while pending:
        socket, within = pending.pop()
        for link in socket.links:
            node, output = link.from_node, link.from_socket
            if (key := (node, within, output.name)) in done:
                continue
            done.add(key)
            found.add((node, within))
            if node.type == "GROUP_INPUT":
                pending.append((within[-1].inputs[output.name], within[:-1]))
            elif node.type == "GROUP":
                inside = next(each for each in node.node_tree.nodes if each.type == "GROUP_OUTPUT")
                pending.append((inside.inputs[output.name], (*within, node)))
            else:
                pending += [(each, within) for each in node.inputs]
    return found


def _mebibytes(bake: Path) -> float:
    layout = read_header(bake)[0]
    return layout.width * layout.height * BYTES_PER_TEXEL / 2**20

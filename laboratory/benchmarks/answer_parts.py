# SPDX-License-Identifier: GPL-3.0-or-later
"""Nanoseconds that Cycles takes for each kind of node, and for each part of a material's answer to a lamp.

    ./dev bench answer_parts [--repeat 5] [--json FILE|-]

A sphere fills the picture and only emits a colour, which one chain of nodes computes. A row is the processor time of a
sample of a pixel, less that of a constant colour, in one run. For a kind of node the chain has forty of it. For an
answer it is the response's node for one sun, of which one output is linked, so Blender evaluates only what this output
needs. `sample:elaphe` is baked as by default.
"""

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path

from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser

from . import report
from .render_time import Studio, Subject

_CHAIN, _SAMPLES = 40, 64


def main(argv: list[str] | None = None) -> int:
    """Print the tables and return the exit status."""
    parser = OneLineParser(prog="./dev bench answer_parts", description=__doc__.splitlines()[0])
    parser.add_argument("--repeat", type=count(1, 1000), default=5)
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        rows = measured(Studio.started(Path(folder), 96), arguments)
    report.write({"rows": rows}, arguments.json)
    return 0


def measured(studio: Studio, arguments: argparse.Namespace) -> list[dict]:
    """Measure and print all rows."""
    studio.build("sphere")
    subjects = [Subject("a constant", lambda: _material(studio, lambda tree: 0.5), 0)]
    for name in _KINDS:
        subjects.append(Subject(name, lambda name=name: _material(studio, lambda tree: _chain(tree, name)), 0))
    for name in ("Likely", "Finer", "Coarser", "Mirror"):
        subjects.append(Subject(f"answer: {name}", lambda name=name: _material(studio, _answer(studio, name)), 0))
    cost = 1e9 * studio.costs(subjects, _SAMPLES, arguments.repeat)
    rows = []
    for subject, each in zip(subjects[1:], cost[1:] - cost[0], strict=True):
        ns = float(each if subject.name.startswith("answer") else each / _CHAIN)
        rows.append({"part": subject.name, "ns": ns})
        report.say(f"{subject.name:44}{ns:9.1f}", arguments.json)
    return rows


def _closest(tree, value):
    node = tree.node("ShaderNodeTexImage", value, image=_picture(), interpolation="Closest", extension="EXTEND")
    return tree.value(node.outputs["Color"])


def _picture():
    import bpy

    return bpy.data.images.get("Timed") or bpy.data.images.new("Timed", 256, 256, float_buffer=True, is_data=True)


# By name, a function that adds one node of a kind to a tree, after a value.
_KINDS: dict[str, Callable] = {
    "Math, multiply": lambda tree, value: value * 0.999,
    "Math, power": lambda tree, value: tree.math("POWER", value, 0.999),
    "Vector Math, add": lambda tree, value: value + (1e-3, 0.0, 0.0),
    "Vector Math, dot product, and a conversion": lambda tree, value: tree.dot(value, (0.3, 0.3, 0.3)),
    "Vector Math, normalize": lambda tree, value: tree.normalize(value),
    "Mix, vector": lambda tree, value: tree.blend(0.999, (0.0, 0.0, 0.0), value),
    "Image, cubic": lambda tree, value: tree.image(_picture(), value),
    "Image, closest": _closest,
}


def _chain(tree, name: str):
    """A chain of nodes of one kind, which begins with the shaded place: Blender computes no constant in advance."""
    value = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Position"])
    if name.startswith("Math"):
        value = tree.dot(value, (0.3, 0.4, 0.5))
    for _ in range(_CHAIN):
        value = _KINDS[name](tree, value)
    return value


def _answer(studio: Studio, output: str) -> Callable:
    """A function that adds the answer to one sun, and returns one of its outputs."""

    def add(tree):
        group = studio.addon.making_materials.new_diffraction_group(studio.bake, False, "LAMPS")
        direct = next(node.node_tree for node in group.nodes if node.label == "Response")
        geometry = tree.node("ShaderNodeNewGeometry")
        tangent = tree.node("ShaderNodeTangent", direction_type="RADIAL", axis="Z")
        asked = {
            "Normal": tree.value(geometry.outputs["Normal"]),
            "Tangent": tree.value(tangent.outputs["Tangent"]),
            "To Light": (0.36, 0.48, 0.8),
            "Irradiance": (1.0, 1.0, 1.0),
            "Variance": 2e-5,
        }
        return tree.group(direct, asked)[output]

    return add


def _material(studio: Studio, colour: Callable):
    """A material that emits a colour."""
    import bpy

    material = bpy.data.materials.new("timed")
    studio.addon.compat.enable_nodes(material)
    material.node_tree.nodes.clear()
    tree = studio.addon.builder.Tree(material.node_tree)
    tree.node("ShaderNodeOutputMaterial", tree.emission(colour(tree), 1.0))
    return material

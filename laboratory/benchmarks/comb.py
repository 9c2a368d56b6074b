# SPDX-License-Identifier: GPL-3.0-or-later
"""How the time of a comb grows with the number of faces, and how accurate its direction field is.

    ./dev bench comb [--faces 1000000] [--guide tail] [--json FILE]

The mesh is a torus, ten times as long as thick, whose points are moved at random by up to a sixth of their distance.
"""

import time

import numpy as np

from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.mesh.comb import GUIDES, comb
from precompute.mesh.layout import Polygons

from .report import add_json, say, write

_FACES = (10_000, 100_000, 1_000_000)


def main(argv: list[str] | None = None) -> int:
    """Comb a mesh of each size with each guide and print a line for each."""
    parser = OneLineParser(prog="./dev bench comb", description=__doc__.splitlines()[0])
    parser.add_argument("--faces", type=count(100, 10**8), action="append", help=f"default: {_FACES}")
    parser.add_argument("--guide", choices=GUIDES, action="append", help="default: all")
    add_json(parser)
    arguments = parser.parse_args(argv)
    rows = []
    for faces in arguments.faces or _FACES:
        mesh = torus(faces)
        for guide in arguments.guide or GUIDES:
            begun = time.perf_counter()
            combed = comb("torus", mesh, {"guide": np.array(guide), **given(mesh)})
            row = {
                "faces": len(mesh.face), "guide": guide, "seconds": time.perf_counter() - begun,
                "residual": combed.residual, "singular": int((combed.index != 0).sum()),
                "flips": int((combed.index == 0).sum()), "index": int(combed.index.sum()),
            }  # fmt: skip
            rows.append(row)
            say(
                "{faces:8d} faces  {guide:9s}  {seconds:6.1f} s  residual {residual:.0e}  {singular} singular points, "
                "index {index:+d}, {flips} flips".format(**row),
                arguments.json,
            )
    write({"rows": rows}, arguments.json)
    return 0


def torus(faces: int) -> Polygons:
    """A torus of about this many triangles, with smooth normals."""
    across = max(8, round((faces / 20) ** 0.5))
    around = max(8, round(faces / 2 / across))
    random = np.random.default_rng(0).uniform(-1 / 6, 1 / 6, (2, around, across))
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    u, v = (u + random[0]) * 2 * np.pi / around, (v + random[1]) * 2 * np.pi / across
    normals = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1)
    centre = np.stack([np.cos(u), np.sin(u), np.zeros_like(u)], axis=-1)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    here, right = i * across + j, i * across + (j + 1) % across
    below, across_from = (i + 1) % around * across + j, (i + 1) % around * across + (j + 1) % across
    cut = (np.stack([here, below, across_from], axis=-1), np.stack([here, across_from, right], axis=-1))
    point = np.concatenate([each.reshape(-1, 3) for each in cut]).ravel()
    corners = np.arange(len(point)).reshape(-1, 3)
    points = (centre + 0.1 * normals).reshape(-1, 3)
    return Polygons(points, point, normals.reshape(-1, 3)[point], corners, np.arange(len(corners)))


def given(mesh: Polygons) -> dict[str, np.ndarray]:
    """Everything the guides need: an axis, UV around and across, and a stroke around a quarter of the torus."""
    at = mesh.points[mesh.point]
    uv = np.stack([np.arctan2(at[:, 1], at[:, 0]), np.arctan2(at[:, 2], np.hypot(at[:, 0], at[:, 1]) - 1)], axis=1)
    angle = np.linspace(0, np.pi / 2, 30)
    line = np.stack([1.1 * np.cos(angle), 1.1 * np.sin(angle), 0 * angle], axis=1)
    return {"axis": np.array([1.0, 0, 0]), "uv": uv, "segments": np.stack([line[:-1], line[1:]], axis=1)}

# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged meshes for the verbs `unwrap` and `comb`: wrong numbers, forged array headers or zip archives, bad bytes."""

import io
import random
import struct
import zipfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from precompute.mesh.comb import GUIDES
from precompute.mesh.layout import Polygons

from .mutations import mutated
from .runner import Case, read_written, run_verb

_FLOATS = (0.0, -1.0, 1e9, 1e30, 1e38, 1e300, 1e-30, 1e-300, 5e-324, float("nan"), float("inf"), -float("inf"))
_INTEGERS = (-1, 0, 1, 2**15, 2**31 - 1, -(2**31), 2**40, 2**63 - 1, -(2**63))
_SIZES = (0, 1, 2, 3, 10**6, 2**31, 2**40, 10**10 - 1, 2**63)
_KINDS = ("<f8", "<f4", "<f2", "<i8", "<u4", "|i1", "|b1", "<c16", "<U4", "|S4", "|O", "<M8[s]", "|V8", "<f16", ">f8")
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
# Offsets and formats of the numbers in a zip's directory entry (PKWARE, "APPNOTE.TXT", section 4.3.12).
_FIELDS = ((8, "<H"), (10, "<H"), (20, "<I"), (24, "<I"), (28, "<H"), (30, "<H"), (42, "<I"))


def cases(count: int, seed: int, folder: Path) -> Iterator[Case]:
    """Yield `count` meshes for each verb."""
    mesh = torus(64)
    arrays = {name: getattr(mesh, name) for name in ("points", "point", "normals", "corners", "face")}
    triangles = {"points": mesh.points, "triangles": mesh.triangles, "polygons": mesh.face}
    combs = [{**arrays, **given(mesh), "guide": np.array(guide), "name": np.array("ring")} for guide in GUIDES]
    for verb, wholes in (("unwrap", [triangles]), ("comb", combs)):
        for number, whole in enumerate(wholes):  # loads modules before the first fork
            read_written(folder / f"whole{number}.npz", _packed(whole), partial(_run, verb))
        for number in range(count):
            draw = random.Random(f"{seed} {verb} {number}")
            what, data = _spoiled(draw, wholes[number % len(wholes)])
            file = folder / f"{verb}{number}.npz"
            yield Case(f"{verb} {number}: {what}", verb, partial(read_written, file, data, partial(_run, verb)))


def _spoiled(draw: random.Random, whole: dict[str, np.ndarray]) -> tuple[str, bytes]:
    """A description and a damaged file."""
    way = draw.choice(("bytes", "numbers", "numbers", "header", "archive"))
    if way == "bytes":
        return mutated(draw, _packed(whole))
    if way == "numbers":
        return _with_numbers(draw, whole)
    return _with_header(draw, whole) if way == "header" else _with_archive(draw, whole)


def _with_numbers(draw: random.Random, whole: dict[str, np.ndarray]) -> tuple[str, bytes]:
    """Replace some or all of an array's numbers, or drop rows."""
    name = draw.choice(sorted(set(whole) - {"guide", "name"}))
    array = np.array(whole[name])
    if draw.random() < 0.2:
        array = array[: draw.randrange(len(array))]
        return f"{name} of {len(array)} rows", _packed(whole | {name: array})
    value = draw.choice(_FLOATS if array.dtype.kind == "f" else _INTEGERS)
    count = draw.choice((1, 3, array.size))
    with np.errstate(all="ignore"):
        array.flat[draw.sample(range(array.size), min(count, array.size))] = value
    return f"{count} of {name} are {value}", _packed(whole | {name: array})


def _with_header(draw: random.Random, whole: dict[str, np.ndarray]) -> tuple[str, bytes]:
    """Declare another type or shape for an array than it has."""
    name = draw.choice(sorted(whole))
    shape = [draw.choice((*_SIZES, size)) for size in whole[name].shape]
    shape = draw.choice((shape, whole[name].shape, shape * draw.choice((2, 40)), []))
    kind = draw.choice((whole[name].dtype.str, *_KINDS))
    order = draw.choice(("False", "True", "1", "None"))
    text = f"{{'descr': '{kind}', 'fortran_order': {order}, 'shape': ({', '.join(map(str, shape))},), }}"
    return f"{name} declares {text[:60]}", _packed(whole, headers={name: text})


def _with_archive(draw: random.Random, whole: dict[str, np.ndarray]) -> tuple[str, bytes]:
    """Compress the archive by another method, and perhaps forge a number in its directory."""
    method = draw.choice(_METHODS)
    data = bytearray(_packed(whole, method=method))
    if draw.random() < 0.3:
        return f"packed by {method}", bytes(data)
    entries = [at for at in range(len(data)) if data[at : at + 4] == b"PK\1\2"]
    at, form = draw.choice(_FIELDS)
    value = draw.choice((0, 1, 9, 99, 2**15, 2**16 - 1, 2**31, 2**32 - 1)) % (1 << 8 * struct.calcsize(form))
    struct.pack_into(form, data, draw.choice(entries) + at, value)
    return f"packed by {method}, {value} at {at} of its directory", bytes(data)


def _packed(
    arrays: dict[str, np.ndarray], *, method: int = zipfile.ZIP_STORED, headers: dict[str, str] | None = None
) -> bytes:
    """An .npz of arrays; `headers` replaces the headers of the arrays that it names."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, array in arrays.items():
            member = io.BytesIO()
            np.save(member, array)
            data = member.getvalue()
            if headers and name in headers:
                text = headers[name].encode("latin-1") + b"\n"
                data = data[:8] + struct.pack("<H", len(text)) + text + array.tobytes()
            archive.writestr(f"{name}.npy", data)
    return out.getvalue()


def _run(verb: str, file: Path) -> None:
    run_verb([verb, file, "-o", file.with_suffix(""), "--progress", "none"])


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

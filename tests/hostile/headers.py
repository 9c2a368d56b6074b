# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes with forged headers or damaged bytes, for everything that reads bakes.

Forged values go into every field of a real bake's header. The readers are `map`, `check`, the checks before a material
is built, the reader of sample sets, and the reader of the images from `dft`."""

import json
import random
import struct
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image

from precompute.base.exr_reader import TEXELS_MAX, open_picture
from precompute.methods.dft_layout import read_sound_layout
from precompute.table import sample_set
from precompute.table.atlas import HEADER_KEY, read_sound_header
from precompute.table.blur_levels import TERMS_MAX

from .mutations import mutated
from .runner import Case, read_written, run_verb

_SIZES = ("--size-um", "2", "--height-nm", "60")
_QUIET = ("--progress", "none")
# JSON texts, because json.dumps cannot write some of these values.
_VALUES = (
    "0", "-1", "1", "2", "3", "7", "8", "16", "0.5", "2.0", "-0.0", "true", "false", "null", '""', '"1"', '"D65"', "[]",
    "{}", "[1]", '{"a": 1}', "1e308", "1e-308", "-1e308", "1e400", "1e-400", "NaN", "Infinity", "-Infinity", "20000",
    "1000000000", "2147483648", "9007199254740991", "9007199254740993", "9" * 400, "0." + "9" * 400, "9" * 5000,
    "[" * 40 + "]" * 40, "[" * 100_000 + "]" * 100_000, '"' + "x" * 100_000 + '"', '"\\ud800"', '"\\0"', '"\\u001b"',
)  # fmt: skip


def cases(count: int, seed: int, folder: Path) -> Iterator[Case]:
    """Yield `count` files for each reader: two thirds with forged headers, one third with damaged bytes."""
    scan, bake, lobes, images = _whole(folder)
    check = ("--pairs", "200", "--groups", "1", "--step-nm", "20", *_SIZES, *_QUIET)
    readers: dict[str, tuple[Path, Callable[[Path], object]]] = {
        "map": (bake, lambda file: run_verb(["map", file, "-o", folder / "map.png", "--size", "32", *_QUIET])),
        "check": (bake, lambda file: run_verb(["check", file, scan, *check])),
        "material": (bake, _read_for_material),
        "sample set": (lobes, sample_set.read),
        "images": (images, read_sound_layout),
    }
    for group, (whole, read) in readers.items():
        read(whole)  # Load the modules before the first fork; the valid file is accepted.
        data = whole.read_bytes()
        for number in range(count):
            draw = random.Random(f"{seed} {group} {number}")
            what, spoiled = mutated(draw, data) if number % 3 == 2 else _with_lie(draw, whole, data)
            file = folder / f"{group.replace(' ', '_')}{number}.exr"
            yield Case(f"{group} {number}: {what}", group, partial(read_written, file, spoiled, read), str(file))


def with_record(whole: Path, data: bytes, text: bytes) -> bytes:
    """Return the file with another header record and with its table of blocks adjusted to the new length."""
    picture = open_picture(whole)
    mark = HEADER_KEY.encode() + b"\0string\0"
    size_at = data.index(mark) + len(mark)
    (size,) = struct.unpack_from("<i", data, size_at)
    longer, blocks = len(text) - size, -(-picture.height // 16)
    places = struct.unpack_from(f"<{blocks}q", data, picture.table_at)
    table = struct.pack(f"<{blocks}q", *(place + longer for place in places))
    head = data[:size_at] + struct.pack("<i", len(text)) + text + data[size_at + 4 + size : picture.table_at]
    return head + table + data[picture.table_at + len(table) :]


def _whole(folder: Path) -> tuple[Path, Path, Path, Path]:
    """Make a scan, its bake, the bake's sample set, and the scan's images from `dft`; return their paths."""
    scan = folder / "skin.png"
    x = np.arange(24) / 24
    grey = 127 + 90 * np.sin(6 * np.pi * x + np.sin(2 * np.pi * x[:, None]))
    Image.fromarray(grey.astype(np.uint8)).save(scan)
    bake = ("--coherence-um", "2", "--delta-e", "5", "--no-cache")
    run_verb(["bake", scan, *_SIZES, *bake, "-o", folder / "bake", *_QUIET])
    run_verb(["dft", scan, *_SIZES, "--terms", "3", "--coherence-um", "2", "-o", folder / "images", *_QUIET])
    table = folder / "bake" / "skin.exr"
    return scan, table, sample_set.path_beside(table), folder / "images" / "skin_flss.exr"


def _with_lie(draw: random.Random, whole: Path, data: bytes) -> tuple[str, bytes]:
    """A description and the file with a forged header record."""
    record = json.loads(open_picture(whole).texts[HEADER_KEY])
    if draw.random() < 0.15:
        what, text = mutated(draw, json.dumps(record).encode())
        return f"JSON {what}", with_record(whole, data, text)
    what, text = with_lies(draw, record)
    return what, with_record(whole, data, text)


def with_lies(draw: random.Random, truth: dict) -> tuple[str, bytes]:
    """Replace one to three values of a record; return a description and the JSON."""
    record, lies, told = json.loads(json.dumps(truth)), {}, []
    for path in draw.sample(list(_paths(record)), k=draw.choice((1, 1, 1, 2, 3))):
        marker = f"lie {len(lies)}"
        lies[f'"{marker}"'], value = _lie(draw, _at(record, path))
        told.append(f"{'.'.join(map(str, path))} {value}")
        _put(record, path, marker)
    text = json.dumps(record)
    for marker, lie in lies.items():
        text = text.replace(marker, lie, 1)
    return ", ".join(told), text.encode()


def _lie(draw: random.Random, truth: object) -> tuple[str, str]:
    """A JSON text that replaces a true value, and its description."""
    near = []
    if type(truth) in (int, float):
        near = [json.dumps(each) for each in (truth + 1, truth - 1, truth * 2, truth // 2, -truth, [truth], str(truth))]
    lie = draw.choice((*near, *draw.sample(_VALUES, k=len(near) or 5)))
    return lie, lie if len(lie) <= 20 else f"{lie[:12]}... of {len(lie)} characters"


def _paths(value: object, path: tuple = ()) -> Iterator[tuple]:
    """The paths of all values inside a record."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, each in inner:
        yield (*path, key)
        yield from _paths(each, (*path, key))


def _at(record: object, path: tuple) -> object:
    for key in path:
        if isinstance(record, str):  # replaced by a marker
            return None
        record = record[key]
    return record


def _put(record: object, path: tuple, value: object) -> None:
    parent = _at(record, path[:-1])
    if isinstance(parent, dict | list):
        parent[path[-1]] = value


def _read_for_material(file: Path) -> None:
    """Check a bake as the add-on does before it builds a material, and check that its tiles lie inside the picture."""
    layout, _ = read_sound_header(file)
    width, height = layout.width, layout.height
    assert layout.terms <= TERMS_MAX and width * height <= TEXELS_MAX, layout
    for level in range(layout.levels):
        for term in range(layout.terms):
            rows, columns = layout.tile_block(term, level)
            assert 0 <= rows.start < rows.stop <= height and 0 <= columns.start < columns.stop <= width, layout

# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile files for every reader, each given to `info`."""

import json
import os
import random
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from . import scans
from .mutations import mutated
from .runner import Case, run_verb

# Each format's file extension and the makers of its whole files. Those of a format share its count.
FORMATS: dict[str, tuple[Callable[[], bytes], ...]] = {
    ".nid": (scans.nid,),
    ".gwy": (scans.gwy,),
    ".png": (scans.png, scans.png_16, scans.png_alpha),
    ".tif": (scans.tiff, scans.tiff_lzw),
    ".bmp": (scans.bmp,),
}
# Files made to cost more than they weigh, by the extension of their format.
BOMBS: tuple[tuple[str, Callable[[], bytes]], ...] = (
    (".png", scans.png_bomb), (".png", scans.png_text_bomb), (".tif", scans.tiff_of_many_pages),
    (".tif", scans.tiff_of_shared_tags), (".bmp", scans.bmp_of_long_skips), (".gwy", scans.gwy_of_many_components),
)  # fmt: skip
_TAIL_BYTES = 4 << 30
_SIZES = ("--size-um", "1", "--height-nm", "200")
_PICTURES = (".png", ".tif", ".bmp")


def cases(count: int, seed: int, folder: Path) -> Iterator[Case]:
    """`count` mutations of the files of each format, then bombs, and what is no file."""
    for extension, makers in FORMATS.items():
        whole = [make() for make in makers]
        for data in whole:
            # What is taken here has loaded its modules before the first fork.
            file = folder / f"whole{extension}"
            file.write_bytes(data)
            _take(file)
        for number in range(count):
            draw = random.Random(f"{seed} {extension} {number}")
            ways, data = mutated(draw, whole[number % len(whole)])
            file = folder / f"{number}{extension}"
            yield _case(f"{extension} {number}: {ways}", extension, file, partial(file.write_bytes, data))
    for extension, bomb in BOMBS:
        file = folder / f"{bomb.__name__}{extension}"
        yield _case(f"bomb: {bomb.__name__}", "bombs", file, partial(_write, file, bomb))
    for extension, makers in FORMATS.items():
        for name, make in _places(makers[0]).items():
            file = folder / f"{name}{extension}"
            yield _case(f"place: {name}{extension}", "places", file, partial(make, file))


def _write(file: Path, make: Callable[[], bytes]) -> None:
    file.write_bytes(make())


def _places(whole: Callable[[], bytes]) -> dict[str, Callable[[Path], object]]:
    """What may stand where a file is named, and a file with a tail of zeros that takes no room."""

    def tailed(file: Path) -> None:
        _write(file, whole)
        os.truncate(file, file.stat().st_size + _TAIL_BYTES)

    def linked(file: Path) -> None:
        true = file.with_stem("true")
        _write(true, whole)
        file.symlink_to(true)

    return {
        "fifo": os.mkfifo,
        "folder": Path.mkdir,
        "device": lambda file: file.symlink_to("/dev/zero"),
        "circle": lambda file: file.symlink_to(file),
        "missing": lambda file: file.symlink_to(file.with_stem("nothing")),
        "link": linked,
        "tail": tailed,
        "empty": Path.touch,
    }


def _case(name: str, group: str, file: Path, make: Callable[[], object]) -> Case:
    """The case that makes a file and gives it to `info`."""

    def take() -> None:
        make()
        _take(file)

    return Case(name, group, take, str(file))


def _take(file: Path) -> None:
    """Let `info` describe a file. Raises as run_verb does, and ValueError where its JSON is not JSON."""
    facts = file.with_name(file.name + ".json")
    options = _SIZES if file.suffix in _PICTURES else ()
    try:
        run_verb(["info", file, *options, "--json", facts])
        json.loads(facts.read_text(), parse_constant=_refuse_constant)
    finally:
        facts.unlink(missing_ok=True)


def _refuse_constant(text: str) -> None:
    raise ValueError(f"{text} in JSON")

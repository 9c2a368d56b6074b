# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile files for every reader, each given to `info`."""

import json
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
_SIZES = ("--size-um", "1", "--height-nm", "200")
_PICTURES = (".png", ".tif", ".bmp")


def cases(count: int, seed: int, folder: Path) -> Iterator[Case]:
    """`count` mutations of the files of each format."""
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

# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile files for every reader, each given to `info`."""

import json
import os
import random
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from . import hdf5, instruments, microscopes, scan_bombs, scans
from .mutations import mutated
from .runner import Case, run_verb


def _instruments(*makers: Callable[..., bytes]) -> tuple[Callable[[], bytes], ...]:
    """Bind makers of valid files to the heights of scans.py."""
    return tuple(partial(make, scans.HEIGHTS, scans.PIXEL_M) for make in makers)


# Each format's file extension and the makers of its valid files, which share the format's count.
FORMATS: dict[str, tuple[Callable[[], bytes], ...]] = {
    ".nid": (scans.nid,),
    ".gwy": (scans.gwy,),
    ".png": (scans.png, scans.png_16, scans.png_alpha),
    ".tif": (scans.tiff, scans.tiff_lzw, scans.tiff_of_floats),
    ".bmp": (scans.bmp,),
    ".spm": _instruments(instruments.nanoscope, instruments.nanoscope_5),
    ".ibw": _instruments(instruments.ibw, partial(instruments.ibw, order=">")),
    ".jpk": _instruments(instruments.jpk),
    ".tiff": _instruments(instruments.park, partial(instruments.park, version=1)),
    ".top": _instruments(instruments.wsxm, partial(instruments.wsxm, kind="double")),
    ".mi": _instruments(instruments.agilent),
    ".mdt": _instruments(microscopes.ntmdt, microscopes.ntmdt_mda),
    ".sxm": _instruments(microscopes.sxm),
    ".nhf": _instruments(hdf5.nhf, partial(hdf5.nhf, version=2, packed=True)),
    ".h5-jpk": _instruments(hdf5.h5_jpk),
    ".asd": _instruments(microscopes.asd, partial(microscopes.asd, version=0)),
    ".gsf": _instruments(instruments.gsf),
    ".txt": _instruments(instruments.gwyddion_text, partial(instruments.gwyddion_text, german=True)),
    ".sur": _instruments(instruments.digital_surf, partial(instruments.digital_surf, packed=True)),
    ".sdf": _instruments(instruments.sdf, partial(instruments.sdf, text=True)),
    ".x3p": _instruments(
        instruments.x3p,
        partial(instruments.x3p, packed=False),
        partial(instruments.x3p, packed=False, kind="L"),
        instruments.x3p_listed,
    ),
    ".xyz": _instruments(instruments.xyz),
    ".asc": _instruments(instruments.matrix),
    ".exr": _instruments(instruments.exr),
    ".npy": _instruments(instruments.npy),
}
# Small files that are expensive to read, with the extension of their format.
BOMBS: tuple[tuple[str, Callable[[], bytes]], ...] = (
    (".png", scans.png_bomb), (".png", scans.png_text_bomb), (".tif", scans.tiff_of_many_pages),
    (".tif", scans.tiff_of_shared_tags), (".bmp", scans.bmp_of_long_skips), (".gwy", scans.gwy_of_many_components),
    (".x3p", scan_bombs.x3p_of_zeros), (".sur", scan_bombs.sur_of_zeros), (".asc", scan_bombs.text_of_one_row),
    (".asc", scan_bombs.text_of_many_rows), (".xyz", scan_bombs.points_far_apart), (".jpk", scan_bombs.jpk_in_a_circle),
    (".jpk", scan_bombs.jpk_of_long_strips), (".x3p", scan_bombs.x3p_of_entities), (".x3p", scan_bombs.x3p_of_elements),
    (".npy", scan_bombs.npy_of_zeros), (".nhf", hdf5.nhf_continued_in_a_circle), (".nhf", hdf5.nhf_of_zeros),
)  # fmt: skip
_TAIL_BYTES = 4 << 30
_SIZES = ("--size-um", "1", "--height-nm", "200")
# The formats that store no size.
BARE = (".png", ".tif", ".bmp", ".xyz", ".asc", ".exr", ".npy")


def cases(count: int, seed: int, folder: Path) -> Iterator[Case]:
    """Yield `count` mutations for each format, then bombs, then paths that are not regular files."""
    for extension, makers in FORMATS.items():
        whole = [make() for make in makers]
        for data in whole:
            # Loads the reader's modules before the first fork.
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
        # `info` reports these before it looks at the format, so one format is enough.
        no_files = _NO_FILES if extension == ".nid" else {}
        for name, make in (no_files | _files(makers[0])).items():
            file = folder / f"{name}{extension}"
            yield _case(f"place: {name}{extension}", "places", file, partial(make, file))


def _write(file: Path, make: Callable[[], bytes]) -> None:
    file.write_bytes(make())


# Things other than a file that a path may lead to.
_NO_FILES: dict[str, Callable[[Path], object]] = {
    "fifo": os.mkfifo,
    "folder": Path.mkdir,
    "device": lambda file: file.symlink_to("/dev/zero"),
    "circle": lambda file: file.symlink_to(file),
    "missing": lambda file: file.symlink_to(file.with_stem("nothing")),
    "empty": Path.touch,
}


def _files(whole: Callable[[], bytes]) -> dict[str, Callable[[Path], object]]:
    """A link to a valid file, and a valid file with a sparse tail of zeros."""

    def tailed(file: Path) -> None:
        _write(file, whole)
        os.truncate(file, file.stat().st_size + _TAIL_BYTES)

    def linked(file: Path) -> None:
        true = file.with_stem("true")
        _write(true, whole)
        file.symlink_to(true)

    return {"link": linked, "tail": tailed}


def _case(name: str, group: str, file: Path, make: Callable[[], object]) -> Case:
    """The case that makes a file and gives it to `info`."""

    def take() -> None:
        make()
        _take(file)

    return Case(name, group, take, str(file))


def _take(file: Path) -> None:
    """Describe a file by `info`. Raises as run_verb does, and ValueError if the printed JSON is invalid."""
    facts = file.with_name(file.name + ".json")
    options = _SIZES if file.suffix in BARE else ()
    try:
        run_verb(["info", file, *options, "--json", facts])
        json.loads(facts.read_text(), parse_constant=_refuse_constant)
    finally:
        facts.unlink(missing_ok=True)


def _refuse_constant(text: str) -> None:
    raise ValueError(f"{text} in JSON")

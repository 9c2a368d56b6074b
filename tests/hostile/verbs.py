# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged scans for `bake`, `dft`, `evaluate`, `map` and `check` (which takes a scan after the bake).

A few formats are enough here, since readers.py covers all formats: this suite tests what verbs do with heights and
sizes that a reader accepts. The options keep accepted cases quick."""

import json
import random
import shutil
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from . import instruments, microscopes
from .mutations import mutated
from .readers import BARE
from .runner import Case, run_verb

# Waves 0.8 um long and 120 nm high over 3.2 um; every row has another phase.
_SIDE, _PIXEL_M, _WAVE = 32, 100e-9, 8
_X = np.arange(_SIDE)
_HEIGHTS = 60e-9 * np.sin(2 * np.pi * _X / _WAVE + np.sin(2 * np.pi * _X[:, None] / _SIDE) / 4)
_MAKERS: dict[str, Callable[[np.ndarray, float], bytes]] = {
    ".gsf": instruments.gsf,
    ".npy": instruments.npy,
    ".spm": instruments.nanoscope,
    ".x3p": instruments.x3p,
    ".sur": instruments.digital_surf,
    ".sxm": microscopes.sxm,
    ".xyz": instruments.xyz,
}
# .npy and .xyz hold nanometres.
_SIZES = ("--size-um", "3.2", "--height-nm", "1")
_QUIET = ("--progress", "none")
_BAKE = ("--delta-e", "20", "--no-cache", "--coherence-um", "1.5")
# A region of (u, v) beside the zero order, and a range of w.
_NEEDS = {"format": 1, "u": [0.2, 0.5], "v": [-0.1, 0.2], "w": [1.2, 1.6]}
# A bake of the ensemble model takes seconds, so only every sixth case runs one. NumPy with several threads multiplies
# the processor time.
_SELDOM, _SECONDS_MAX = 6, 20


def cases(count: int, seed: int, folder: Path) -> Iterator[Case]:
    """Yield `count` damaged scans for each verb."""
    wholes = [(extension, make(_HEIGHTS, _PIXEL_M)) for extension, make in _MAKERS.items()]
    needs, whole = folder / "needs.json", folder / "whole.gsf"
    needs.write_text(json.dumps(_NEEDS))
    whole.write_bytes(instruments.gsf(_HEIGHTS, _PIXEL_M))
    run_verb(["bake", whole, *_BAKE, "-o", folder / "whole", *_QUIET])
    for verb in ("bake", "dft", "evaluate", "map", "check"):
        for number in (0, 1):  # loads modules before the first fork
            run_verb(_line(verb, whole, number, folder=folder))
            shutil.rmtree(folder / "out", ignore_errors=True)
        for number in range(count):
            draw = random.Random(f"{seed} {verb} {number}")
            # `check` refuses all surfaces except the baked one, which is a .gsf.
            extension, data = wholes[0 if verb == "check" else number % len(wholes)]
            what, spoiled = mutated(draw, data)
            file = folder / f"{verb}{number}{extension}"
            run = partial(_take, file, spoiled, _line(verb, file, number, folder=folder))
            limit = _SECONDS_MAX if number % _SELDOM == 0 else None
            yield Case(f"{verb} {number}: {extension} {what}", verb, run, str(file), limit)


def _line(verb: str, file: Path, number: int, *, folder: Path) -> list[object]:
    """The command line that gives a scan to a verb and writes into the folder `out`."""
    out = folder / "out"
    options: dict[str, tuple[object, ...]] = {
        "bake": ("-o", out, *_BAKE, *_quick(number, folder)),
        "dft": ("-o", out, "--terms", "2", "--coherence-um", "1.5"),
        "evaluate": ("--methods", "flss,nmm", "--coherence-um", "1.5"),
        "map": ("-o", out / "map.exr", "--size", "16", "--step-nm", "50", "--coherence-um", "1.5", *_method(number)),
        "check": ("--pairs", "50", "--groups", "1", "--step-nm", "50"),
    }
    given = (folder / "whole",) if verb == "check" else ()
    return [verb, *given, file, *(_SIZES if file.suffix in BARE else ()), *options[verb], *_QUIET]


def _quick(number: int, folder: Path) -> tuple[object, ...]:
    seldom = ("--illuminant", "532nm")
    return seldom if number % _SELDOM == 0 else ("--model", "patch", "--needs", folder / "needs.json")


def _method(number: int) -> tuple[str, ...]:
    return () if number % _SELDOM == 0 else ("--method", ("chebyshev", "flss", "stam")[number % 3])


def _take(file: Path, data: bytes, line: list[object]) -> None:
    """Write a scan and give it to a verb. Raises as run_verb does, and AssertionError if a refusal leaves files."""
    out = file.with_name("out")
    file.write_bytes(data)
    try:
        run_verb(line)
    except Exception:
        assert not [path for path in out.rglob("*") if path.is_file()], "a refused scan left files"
        raise
    finally:
        shutil.rmtree(out, ignore_errors=True)
        file.unlink()

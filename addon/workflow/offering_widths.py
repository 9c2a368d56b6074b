# SPDX-License-Identifier: GPL-3.0-or-later
"""The width that the import dialog offers for files that do not store theirs: from their names, else the last one."""

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.surface.height_map import is_synthetic
from ...precompute.surface.readers.pictures import named_width_um
from ...precompute.surface.readers.reader_registry import reader_of
from ..gratings.grating import scan_record
from .importing import import_scans

# The width that was used last in this session, in micrometres; none before the first.
_last: list[float] = []


@dataclass(frozen=True)
class Offer:
    """A width in micrometres, and the words that say where it comes from. 0: there is none to offer."""

    width_um: float = 0.0
    origin: str = ""


def offer_for(paths: Sequence[str]) -> Offer:
    """The width to offer for files that are chosen together. There is none if their names differ in it."""
    named = {named_width_um(path) for path in paths if needs_width(path)}
    if not named:
        return Offer()
    if named == {None}:
        return Offer(_last[0], "as in your last import") if _last else Offer()
    (width, *others) = named
    if others or width is None:
        return Offer()
    return Offer(width, "from the file's name" if len(paths) == 1 else "from the files' names")


def needs_width(path: str) -> bool:
    """Whether a file does not store its width. False for a file that cannot be read."""
    try:
        return not is_synthetic(path) and reader_of(path).needs_size
    except GratingError:
        return False


def import_chosen(
    scene: bpy.types.Scene, paths: Sequence[str], *, size_um: float, height_nm: float, channel: str, averaged: bool,
    origin: str,
) -> list[str]:  # fmt: skip
    """Import files as import_scans does, and remember the width. `origin` says where the width comes from if it is an
    offer: then only files that do not store theirs take it, and their lines name it."""
    sizes = [0.0 if origin and not needs_width(path) else size_um for path in paths]
    records = [scan_record(p, size, height_nm, channel=channel) for p, size in zip(paths, sizes, strict=True)]
    lines = import_scans(scene, records, averaged=averaged)
    if any(sizes):
        _last[:] = [size_um]
    notes = [f", width {size_um:.6g} um {origin}" if origin and size else "" for size in sizes]
    return [line + note for line, note in zip(lines, [max(notes)] if averaged else notes, strict=True)]


def forget_width() -> None:
    """Forget the last width, as in a new session."""
    _last.clear()

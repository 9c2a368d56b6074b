# SPDX-License-Identifier: GPL-3.0-or-later
"""Finding the file of a grating's bake, or writing it again from pictures packed in the .blend; and warning about
objects that show light from outside the region for which their grating was baked: there they are black.

A few rays are cast through the scene's camera in the present frame, which takes a tenth of a second."""

import hashlib
from functools import partial
from pathlib import Path

import bpy

from ...precompute.bake.shown_directions import Shown, held_share, joined, left_out
from ...precompute.base.failure import GratingError, printable
from ...precompute.base.files import short_stem, told_of, write_together
from ...precompute.table.atlas import read_header
from ...precompute.table.sample_set import path_beside
from ..blender.guard import absolute, is_there, pure
from ..cameras.camera_look import look
from ..gratings.bakes import asked, has_regions, note_outside, noted_region
from ..gratings.cache_folder import bakes_folder, cache_folder
from ..gratings.grating import Grating
from ..materials.lost_parts import lost_of_own
from ..materials.pictures import fault_of, pictures_of
from ..materials.response import Response, own_trees, responses_in

# The first bytes of an OpenEXR file.
_EXR = b"\x76\x2f\x31\x01"


def bake_of(grating: Grating) -> Path:
    """The file of a grating's bake. If it is not at the recorded path, it is searched for in the cache, else written
    there from the pictures packed in the .blend. The grating then records the new path. Raises GratingError if the bake
    is in none of these places, or if the file cannot be written."""
    try:
        return grating.baked_file()
    except GratingError:
        found = (grating.bake_path and _kept(grating)) or _unpacked(grating)
        if found is None:
            raise
    grating.bake_path = str(found)
    return found


def is_lost(grating: Grating) -> bool:
    """Whether a grating has no intact node group, and bake_of would raise. Writes no file."""
    group = grating.own_group
    if not grating.bake_path or (group is not None and (not lost_of_own(group) or _packed(own_trees(group)[0]))):
        return False
    try:
        grating.baked_file()
    except GratingError:
        return _kept(grating) is None
    return False


def _kept(grating: Grating) -> Path | None:
    """The bake in this machine's cache for the grating's settings, or None."""
    name = pure(grating.bake_path).name
    try:
        path = bakes_folder(asked(grating.bake_request())) / name
    except GratingError:  # no bake has these settings
        return None
    return path if is_there(path) else None


def _unpacked(grating: Grating) -> Path | None:
    """The bake, written from the packed pictures of the grating's node group; None if they are lost."""
    return None if grating.group is None else unpacked_bake(grating.group)


def unpacked_bake(group: bpy.types.NodeTree) -> Path | None:
    """Write a Diffraction group's packed pictures as the files of a bake and return its path. Without the packed sample
    set, only the table is written. None if the table is lost. Raises GratingError if a file cannot be written."""
    tree, world = own_trees(group)
    table = next(iter(_packed(tree)), None)
    if table is None:
        return None
    others = [image for image in _packed(world) if image != table]
    content = bytes(table.packed_file.data)
    folder = cache_folder() / "bakes" / hashlib.sha256(content).hexdigest()[:16]
    stem = short_stem(printable(Path(bpy.path.basename(table.filepath) or table.name).stem))
    path = folder / f"{stem}.exr"
    held = {path: content} | {path_beside(path): bytes(other.packed_file.data) for other in others[:1]}
    with told_of(folder):
        folder.mkdir(parents=True, exist_ok=True)
    write_together({each: partial(_write_bytes, data=data) for each, data in held.items()})
    try:
        read_header(path)
    except GratingError:  # the picture is not a bake
        return None
    return path


def bake_shown_by(group: bpy.types.NodeTree) -> Path:
    """The file of the bake that a Diffraction group without a grating shows. Raises GratingError if it is lost."""
    pictures = [image for tree in own_trees(group) if tree is not None for image in pictures_of(tree)]
    files = (Path(absolute(image.filepath)) for image in pictures if image is not None and image.filepath)
    found = unpacked_bake(group) or next((file for file in files if file.is_file()), None)
    if found is None:
        raise GratingError(group.name, "the bake that it shows is lost", "assign another grating to its objects")
    return found


def _packed(tree: bpy.types.NodeTree | None) -> list[bpy.types.Image]:
    """The intact pictures of a node group that are packed as OpenEXR files."""
    pictures = (
        [] if tree is None else [image for image in pictures_of(tree) if image is not None and not fault_of(image)]
    )
    return [i for i in pictures if i.packed_file is not None and i.filepath and i.packed_file.data[:4] == _EXR]


def _write_bytes(path: Path, data: bytes) -> None:
    path.write_bytes(data)


# Number of rays, and the smallest share of an object's light that gives a warning: the needs leave out a thousandth,
# and with so few rays the error is a few times that.
_RAYS, _WORTH_A_WORD = 2000, 0.005


def notice_outside(scene: bpy.types.Scene) -> list[str]:
    """A warning for each object that shows light from outside the region of its grating's bake: the share of its light,
    and how far it reaches. It checks the open scene as last evaluated; for any other scene it returns nothing."""
    if not has_regions() or scene != bpy.context.scene:
        note_outside(scene, [])
        return []
    seen = look(scene, bpy.context.evaluated_depsgraph_get(), rays=_RAYS)
    parts: dict[tuple[bpy.types.Object, Response], list[Shown]] = {}
    if seen is not None:
        for places in seen.places:
            for response in responses_in(places.node.node_tree):
                parts.setdefault((places.thing, response), []).append(seen.shown(response, places))
    told = [_told(thing, response, joined(shown)) for (thing, response), shown in parts.items()]
    lines = [line for line in told if line]
    note_outside(scene, lines)
    return lines


def _told(thing: bpy.types.Object, response: Response, shown: Shown) -> str:
    """The warning about one object; empty if there is nothing to warn about."""
    region = noted_region(response.group)
    if region is None or shown.is_dark or (outside := 1 - held_share(shown, region)) < _WORTH_A_WORD:
        return ""
    reached = "; ".join(left_out(shown, region, share=_WORTH_A_WORD / 6))
    return (
        f"{thing.name}: {outside:.0%} of its light is black, because its grating was baked for another camera or other "
        f"lamps ({reached}); press Bake for This Scene again"
    )

# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures that responses read, and checks whether an artist deleted, exchanged, edited or unpacked them.

Each picture stores what it was made from, and each node group stores this for its pictures."""

import hashlib
from collections.abc import Iterable
from pathlib import Path

import bpy

from ..blender import compat, stored
from ..blender.guard import absolute
from ..nodes.interface import lost_in, note_parts

# Custom properties of pictures, saved in files: what the picture was made from, and its packed size in bytes.
_MADE_FROM, _BYTES = "ng_picture", "ng_picture_bytes"
# Custom property of a node group: what its pictures were made from.
_PICTURES = "ng_pictures"


def content_of(path: Path) -> str:
    """The SHA-256 of a picture's file, as the record of what the picture was made from."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def note_content(image: bpy.types.Image, content: str) -> None:
    """Store on a packed picture what it was made from."""
    image[_MADE_FROM], image[_BYTES] = content, str(image.packed_file.size)


def noted_content(image: bpy.types.Image) -> str:
    """What a picture was made from; empty if this was not stored."""
    return stored.text(image, _MADE_FROM)


def picture_of(content: str) -> bpy.types.Image | None:
    """The local, intact picture that was made from this content, or None."""
    for image in bpy.data.images:
        if image.library is None and stored.text(image, _MADE_FROM) == content and not fault_of(image):
            return image
    return None


def note_pictures(tree: bpy.types.NodeTree | None) -> None:
    """Store on a response's node group its numbers of nodes and links, and what its pictures were made from."""
    if tree is not None:
        note_parts(tree)
        tree[_PICTURES] = _made_from(pictures_of(tree))


def made_from(tree: bpy.types.NodeTree | None) -> str:
    """What the pictures of a response's node group were made from; empty if this was not stored."""
    return "" if tree is None else stored.text(tree, _PICTURES)


def pictures_of(tree: bpy.types.NodeTree) -> list[bpy.types.Image | None]:
    """The pictures that a node group reads, without duplicates; None stands for deleted ones."""
    return list(dict.fromkeys(node.image for node in tree.nodes if node.type == "TEX_IMAGE"))


def parts_of(tree: bpy.types.NodeTree | None) -> list[bpy.types.ID]:
    """A response's node group, followed by the groups in it and the images that it reads, without duplicates."""
    if tree is None:
        return []
    held = [node.node_tree for node in tree.nodes if node.type == "GROUP"]
    held += pictures_of(tree)
    return [tree, *filter(None, dict.fromkeys(held))]


def remove_unused(parts: Iterable[bpy.types.ID]) -> None:
    """Delete data-blocks that nothing uses, each after the last of the groups that used it."""
    for part in reversed(dict.fromkeys(reversed(list(parts)))):
        if part.users == 0:
            compat.remove_replaced(part)


def fault_in(tree: bpy.types.NodeTree) -> str:
    """What is wrong with the nodes and pictures of a node group, in a few words; empty if nothing is."""
    if fault := lost_in(tree):
        return fault
    pictures = pictures_of(tree)
    for picture in pictures:
        if fault := fault_of(picture):
            return fault
    if stored.text(tree, _PICTURES, _made_from(pictures)) != _made_from(pictures):
        names = ", ".join(picture.name for picture in pictures if picture is not None)
        return f"{names or 'no picture'} took the place of its own picture"
    return ""


def fault_of(image: bpy.types.Image | None) -> str:
    """What is wrong with a picture, in a few words; empty if nothing is."""
    if image is None:
        return "its picture was deleted"
    if image.is_dirty:
        return f"the picture {image.name} was edited"
    packed = image.packed_file
    if packed is None:
        path = absolute(image.filepath, image.library)
        is_there = image.source == "FILE" and image.filepath and Path(path).is_file()
        return "" if is_there and _is_file_of(image, path) else f"the picture {image.name} is not packed, and lost"
    if stored.text(image, _BYTES, str(packed.size)) != str(packed.size):
        return f"the picture {image.name} was edited"
    return "" if image.colorspace_settings.is_data else f"the picture {image.name} is no longer Non-Color data"


def _is_file_of(image: bpy.types.Image, path: str) -> bool:
    """Whether a file has the size of the file that a picture was made from; true if the size was not stored."""
    size = str(Path(path).stat().st_size)
    return stored.text(image, _BYTES, size) == size


def _made_from(pictures: list[bpy.types.Image | None]) -> str:
    """What the pictures were made from, as one text."""
    return " ".join(sorted(noted_content(picture) for picture in pictures if picture is not None))

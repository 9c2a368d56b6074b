# SPDX-License-Identifier: GPL-3.0-or-later
"""Several bakes as layers of one picture (precompute/bake/layers.py): a response that reads one of them at each place,
at the price of one.

It stands beside the responses of the bakes in a group that varies (skin_nodes.py), which keep their own pictures."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

import bpy
import numpy as np

from ....precompute.base.failure import GratingError
from ....precompute.table import atlas, sample_set
from ...blender import compat, stored
from ...blender.guard import absolute
from ...blender.working_space import working_space
from ..pictures import fault_in, fault_of, noted_content, parts_of, remove_unused
from ..response import Response
from .direct_response import load_atlas, response_of_pictures

# Custom properties of the node groups for lamps and for a world, saved in files: what their layers were made from.
_LAYERS, _WORLD_LAYERS = "ng_layers", "ng_world_layers"
# The labels of the nodes that read a table and a sample set.
_TABLE, _DRAWS = "B0", "q"

_Held = TypeVar("_Held")


def layers_of(responses: Sequence[Response]) -> Response | None:
    """The file's response that holds these responses as layers, or None."""
    return _marked(_mark(responses), with_world=_have_worlds(responses))


def make_layers(responses: Sequence[Response]) -> None:
    """Make a response that holds these as layers, unless the file has one or the bakes do not fit together."""
    mark = _mark(responses) if len(responses) > 1 else ""
    if not mark or _marked(mark, with_world=_have_worlds(responses)) is not None:
        return
    # If they cannot be joined (a bake of another version, a full disk), each response answers for itself.
    with suppress(GratingError, OSError), TemporaryDirectory() as folder:
        made = _made(responses, Path(folder))
        if made is not None:
            made.group[_LAYERS] = mark
            if made.world is not None:
                made.world[_WORLD_LAYERS] = mark


def remove_unused_layers() -> None:
    """Delete the file's node groups of layers that no group shows any more, and their pictures."""
    marked = [group for group in bpy.data.node_groups if _LAYERS in group or _WORLD_LAYERS in group]
    remove_unused(part for group in marked if group.users == 0 for part in parts_of(group))


def _made(responses: Sequence[Response], folder: Path) -> Response | None:
    from ....precompute.bake.layers import as_layers, can_be_layers  # most sessions do not need it

    bakes = [_read(response.group, _TABLE, folder, atlas.read) for response in responses]
    sets = [_read(response.world, _DRAWS, folder, sample_set.read)[0] for response in responses if response.world]
    tables = [table for table, _ in bakes]
    matter, *others = (atlas.matter_in(atlas.layout_of(table), record, folder) for table, record in bakes)
    same = all(other == matter for other in others) and len({each.q.shape for each in sets}) < 2
    if not same or len(sets) not in (0, len(tables)) or not can_be_layers(tables):
        return None
    picture, layout = atlas.pack_layers(as_layers(tables, min(record.get("asked_delta_e", 1.0) for _, record in bakes)))
    image, draws = _packed(folder / "layers.exr", picture), None
    if sets:
        picture, layouts = sample_set.pack_layers(sets)
        draws = _packed(folder / "layers.lobes.exr", picture, alpha="CHANNEL_PACKED"), layouts
    return response_of_pictures("Layers", image, layout, matter=matter, draws=draws, layers=len(tables))


def _packed(path: Path, picture: np.ndarray, *, alpha: str = "NONE") -> bpy.types.Image:
    """A picture as a data-block, packed into the .blend, by a file that may go afterwards.

    Blender itself writes the file: another OpenEXR library beside its own may fail, and what it packs without a file it
    does not compress."""
    rows, columns, channels = picture.shape
    image = bpy.data.images.new(path.stem, columns, rows, float_buffer=True, is_data=True, alpha=True)
    pixels = np.ones((rows, columns, 4), np.float32)
    pixels[..., :channels] = picture
    image.pixels.foreach_set(pixels.ravel())
    half = picture.dtype == np.float16
    scene = bpy.data.scenes.new(path.stem)
    settings = scene.render.image_settings
    compat.write_pictures(settings, "OPEN_EXR")
    settings.color_mode, settings.color_depth, settings.exr_codec = "RGBA", "16" if half else "32", "ZIP"
    try:
        image.save_render(str(path), scene=scene)
    except RuntimeError as error:
        raise GratingError(path, "Blender cannot write it", "check the folder of temporary files") from error
    finally:
        bpy.data.scenes.remove(scene)
        bpy.data.images.remove(image)
    image = load_atlas(path, half=half, alpha=alpha)
    image.filepath_raw = f"//{image.name}.exr"  # its own, if an artist unpacks it
    return image


def _read(
    tree: bpy.types.NodeTree, label: str, folder: Path, read: Callable[[Path], tuple[_Held, dict[str, Any]]]
) -> tuple[_Held, dict[str, Any]]:
    """Read the bake's file that is packed in a response's picture. Raises GratingError if there is no such file."""
    image, path = _picture(tree, label), folder / "bake.exr"
    if image is None:
        raise GratingError(tree.name, "its picture was deleted", "bake again")
    packed = image.packed_file
    path.write_bytes(Path(absolute(image.filepath)).read_bytes() if packed is None else packed.data)
    return read(path)


def _picture(tree: bpy.types.NodeTree, label: str) -> bpy.types.Image | None:
    """The intact picture that a node of a response reads."""
    images = (node.image for node in tree.nodes if node.type == "TEX_IMAGE" and node.label == label)
    return next((image for image in images if not fault_of(image)), None)


def _mark(responses: Sequence[Response]) -> str:
    """What a response that holds these as layers is made from, and the space of its colours; empty if a picture is
    lost."""
    pictures = [_picture(response.group, _TABLE) for response in responses]
    pictures += [_picture(response.world, _DRAWS) for response in responses if response.world]
    contents = [noted_content(picture) for picture in pictures if picture is not None]
    return " ".join([working_space(), *contents]) if len(contents) == len(pictures) else ""


def _marked(mark: str, *, with_world: bool) -> Response | None:
    """The file's intact response with a mark, or None."""
    own, world = _group_with(_LAYERS, mark), _group_with(_WORLD_LAYERS, mark)
    return None if own is None or (with_world and world is None) else Response(own, world)


def _group_with(key: str, mark: str) -> bpy.types.NodeTree | None:
    groups = [group for group in bpy.data.node_groups if mark and group.library is None]
    return next((group for group in groups if stored.text(group, key) == mark and not fault_in(group)), None)


def _have_worlds(responses: Sequence[Response]) -> bool:
    return all(response.world is not None for response in responses)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The verbs of the scan's direction on meshes: `direction`, `comb`, `unwrap` and `direction-map`."""

import argparse

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.cli.arguments import add_json, add_progress, name_argument, path_argument
from ...precompute.cli.comb_verb import progress_of
from ...precompute.cli.printing import Progress, emit
from ...precompute.mesh.unwrap import Packing
from ..gratings.direction_source import AXIS, COMB_SOURCES, FRAME_MAP, KINDS, RADIAL, UV_MAP, DirectionSource
from ..operators.direction import XATLAS, BakeDirectionMap, ChooseDirection, Unwrap
from ..workflow.combing import bake_direction_map, comb_and_wait
from ..workflow.directing import choose_frame
from ..workflow.unwrapping import unwrap_and_wait, unwrap_by_blender
from .operator_options import add_properties, add_property, values
from .shared_options import (
    add_gratings,
    add_objects,
    add_save,
    chosen_gratings,
    chosen_meshes,
    chosen_objects,
    finish,
    save,
)

# The word for each source on the command line. "frame" is an animation's frame to an artist.
_WORDS = {name: "direction-map" if name == FRAME_MAP else name.lower().replace("_", "-") for name, _, _ in KINDS}
# The option of a property, and the sources that it belongs to.
_OF = {"uv_map": ("--uv-map", UV_MAP), "axis": ("--axis", RADIAL, AXIS), "frame_map": ("--map", FRAME_MAP)}
_AXES = ("x", "y", "z")


def direction_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `direction`."""
    parser.add_argument(
        "source", choices=list(_WORDS.values()), metavar="SOURCE",
        help="stored: the direction that `comb` stored, else the UV map that renders; uv-map: U of a named UV map; "
        "radial: away from an axis of the object, as on a disc; axis: along an axis of the object; direction-map: the "
        "picture that `direction-map` made",
    )  # fmt: skip
    add_gratings(parser)
    add_properties(parser, ChooseDirection, "uv_map", "axis", "angle")
    add_property(parser, ChooseDirection, "frame_map", flag="--map")
    add_save(parser)


def run_direction(arguments: argparse.Namespace) -> None:
    """The `direction` verb."""
    kind = next(name for name, word in _WORDS.items() if word == arguments.source)
    for name, (told, *kinds) in _OF.items():
        if getattr(arguments, name) is not None and kind not in kinds:
            of = " or ".join(_WORDS[each] for each in kinds)
            raise GratingError(told, f"{arguments.source} has no use for it", f"leave it out, or choose {of}")
    found = values(arguments, ChooseDirection)
    name = found.pop("frame_map")
    if name and name not in bpy.data.images:
        raise GratingError(f"--map {name}", "no such picture in the file", "make it by `direction-map`")
    source = DirectionSource(kind, **found, frame_map=bpy.data.images[name] if name else None)
    finish(arguments, [choose_frame(each, source) for each in chosen_gratings(bpy.context.scene, arguments)])


def comb_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `comb`."""
    parser.add_argument(
        "--object", action="append", required=True, type=name_argument, metavar="NAME",
        help="a mesh to comb, or an object to follow: a curve, hair, an armature (repeatable)",
    )  # fmt: skip
    kinds = [name.lower() for name, _, _ in COMB_SOURCES]
    parser.add_argument(
        "--source", choices=[*(kind for kind in kinds if kind not in _AXES), "axis"], default="tail",
        help="what the direction follows; default tail: along the body, found from its shape",
    )  # fmt: skip
    parser.add_argument("--axis", choices=_AXES, default="x", help="axis of the object, for --source axis; default x")
    add_progress(parser)
    add_save(parser)


def run_comb(arguments: argparse.Namespace) -> None:
    """The `comb` verb."""
    chosen = chosen_objects(arguments.object)
    source = arguments.axis if arguments.source == "axis" else arguments.source
    finish(arguments, comb_and_wait(bpy.context.scene, chosen, source.upper(), progress=progress_of(arguments)))


def unwrap_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `unwrap`."""
    add_objects(parser)
    add_properties(parser, Unwrap, "method", "size", "padding", "density")
    add_json(parser)
    add_progress(parser)
    add_save(parser)


def run_unwrap(arguments: argparse.Namespace) -> None:
    """The `unwrap` verb. It saves only if all meshes are unwrapped."""
    found = values(arguments, Unwrap)
    method, packing = found.pop("method"), Packing(**found)
    lines, progress = [], Progress(arguments.progress)
    meshes = {mesh.data: mesh for mesh in chosen_meshes(arguments.object)}  # linked duplicates share a mesh
    for mesh in meshes.values():
        if method == XATLAS:
            lines += unwrap_and_wait(mesh, packing, progress=progress)
        else:
            lines += unwrap_by_blender(bpy.context, mesh, packing)
    save(arguments.save)
    emit({"report": lines}, arguments.json, lambda: map(printable, lines))


def direction_map_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `direction-map`."""
    add_objects(parser)
    add_properties(parser, BakeDirectionMap, "uv_map", "size", "margin")
    parser.add_argument(
        "-o", "--output", type=path_argument, metavar="EXR", help="also save the picture here; it is always packed"
    )
    parser.add_argument("--keep-source", action="store_true", help="do not make the grating use the picture")
    add_json(parser)
    add_save(parser)
    parser.set_defaults(output_is_file=True)


def run_direction_map(arguments: argparse.Namespace) -> None:
    """The `direction-map` verb."""
    meshes = chosen_meshes(arguments.object)
    if len(meshes) > 1:
        raise GratingError(
            ", ".join(o.name for o in meshes), "a direction map belongs to one mesh", "name one by --object"
        )
    if meshes[0].modifiers and not meshes[0].visible_get():
        raise GratingError(meshes[0].name, "hidden in the viewport, where its modifiers do nothing", "show it")
    lines = bake_direction_map(
        bpy.context, meshes[0], path=arguments.output, read=not arguments.keep_source,
        **values(arguments, BakeDirectionMap),
    )  # fmt: skip
    save(arguments.save)
    emit({"report": lines}, arguments.json, lambda: map(printable, lines))

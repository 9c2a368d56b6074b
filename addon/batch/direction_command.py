# SPDX-License-Identifier: GPL-3.0-or-later
"""`direction`: choose what the direction of gratings of the open file follows."""

import argparse

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.cli.arguments import name_argument
from ..gratings.direction_source import AXES, AXIS, FRAME_MAP, KINDS, RADIAL, UV_MAP, DirectionSource
from ..workflow.directing import choose_frame
from .chosen import add_gratings, add_save, chosen_gratings, save

# The word for each source on the command line. "frame" is an animation's frame to an artist.
_WORDS = {name: "direction-map" if name == FRAME_MAP else name.lower().replace("_", "-") for name, _, _ in KINDS}
# The sources that an option belongs to, by the option's name.
_OF = {"uv_map": (UV_MAP,), "axis": (RADIAL, AXIS), "map": (FRAME_MAP,)}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `direction`."""
    parser.add_argument(
        "source", choices=list(_WORDS.values()), metavar="SOURCE",
        help="stored: the direction that `comb` stored, else the UV map that renders; uv-map: U of a named UV map; "
        "radial: away from an axis of the object, as on a disc; axis: along an axis of the object; direction-map: the "
        "picture that `direction-map` made",
    )  # fmt: skip
    add_gratings(parser)
    parser.add_argument("--uv-map", type=name_argument, metavar="NAME", help="the UV map, for uv-map")
    axes = [name.lower() for name, _, _ in AXES]
    parser.add_argument("--axis", choices=axes, help="the object's axis, for radial and axis; default z")
    parser.add_argument("--map", type=name_argument, metavar="PICTURE", help="the file's picture, for direction-map")
    parser.add_argument(
        "--angle", type=name_argument, metavar="PROPERTY",
        help="custom property of the objects that turns the scan on each, in radians; default: none",
    )  # fmt: skip
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `direction` verb."""
    kind = next(name for name, word in _WORDS.items() if word == arguments.source)
    for option, kinds in _OF.items():
        if getattr(arguments, option) is not None and kind not in kinds:
            told = f"--{option.replace('_', '-')}"
            of = " or ".join(_WORDS[each] for each in kinds)
            raise GratingError(told, f"{arguments.source} has no use for it", f"leave it out, or choose {of}")
    if arguments.map is not None and arguments.map not in bpy.data.images:
        raise GratingError(f"--map {arguments.map}", "no such picture in the file", "make it by `direction-map`")
    picture = bpy.data.images[arguments.map] if arguments.map is not None else None
    source = DirectionSource(
        kind, arguments.uv_map or "", (arguments.axis or "z").upper(), frame_map=picture, angle=arguments.angle or ""
    )
    lines = [choose_frame(grating, source) for grating in chosen_gratings(bpy.context.scene, arguments)]
    save(arguments.save)
    print("\n".join(map(printable, lines)))

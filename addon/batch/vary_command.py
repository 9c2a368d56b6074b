# SPDX-License-Identifier: GPL-3.0-or-later
"""`vary`: have a grating of the open file vary over the skins that show it."""

import argparse
import math

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.cli.option_types import name_argument, number
from ..gratings.variation import ATTRIBUTE, NOISE, Variation
from ..workflow.varying import vary
from .assign_command import index_of
from .save import add_save, save

_OTHERS_MAX = 2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `vary`."""
    parser.add_argument("bake", type=name_argument, metavar="BAKE", help="the .exr that `bake` wrote, or its folder")
    parser.add_argument(
        "--with", action="append", type=_shared, metavar="BAKE=SHARE", dest="others", default=[],
        help="a further bake, and its share of the surface from 0 to 1 (twice at most)",
    )  # fmt: skip
    parser.add_argument(
        "--by", type=name_argument, default="noise", metavar="noise|ATTRIBUTE",
        help="lay the bakes out in patches of noise (default), or by a number from 0 to 1 that the meshes hold, such "
        "as scale_random",
    )  # fmt: skip
    parser.add_argument("--softness", type=number(0, 1), default=0.0, help="how far they run into each other, 0 to 1")
    parser.add_argument(
        "--turn", type=number(0, 90), default=0.0, metavar="DEGREES", help="of the direction, either way"
    )
    parser.add_argument(
        "--size-mm", type=number(1e-3, 1e9), default=20.0, help="width of the patches in the object's space; default 20"
    )
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `vary` verb."""
    if len(arguments.others) > _OTHERS_MAX:
        too_many, _ = arguments.others[_OTHERS_MAX]
        raise GratingError(f"--with {too_many}", "one too many", f"a bake has {_OTHERS_MAX} others at most")
    names = [arguments.bake, *(name for name, _ in arguments.others)]
    # All are added before any is kept, as adding one may move the others in memory.
    gratings = bpy.context.scene.natural_gratings.items
    grating, *others = (gratings[index] for index in [index_of(name) for name in names])
    choice = Variation(
        shares=tuple(share for _, share in arguments.others),
        pattern=NOISE if arguments.by == "noise" else ATTRIBUTE,
        attribute="" if arguments.by == "noise" else arguments.by,
        softness=arguments.softness, turn=math.radians(arguments.turn), size_m=arguments.size_mm * 1e-3,
    )  # fmt: skip
    report = vary(bpy.context.scene, grating, choice, others=others)
    save(arguments.save)
    print("\n".join(map(printable, report)))


def _shared(text: str) -> tuple[str, float]:
    """The type of an option that takes BAKE=SHARE."""
    name, _, share = text.rpartition("=")
    if not name:
        raise argparse.ArgumentTypeError(f"{text}: give BAKE=SHARE, such as skin.exr=0.3")
    return name, number(0, 1)(share)

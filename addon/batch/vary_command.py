# SPDX-License-Identifier: GPL-3.0-or-later
"""`vary`: vary a grating of the open file over the meshes that show it."""

import argparse
import math

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.cli.arguments import name_argument, number
from ..gratings.grating import ATTRIBUTE, NOISE, Variation
from ..workflow.importing import index_of
from ..workflow.making_materials import vary
from .chosen import add_save, save

_OTHERS_MAX = 2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `vary`."""
    parser.add_argument("bake", type=name_argument, metavar="BAKE", help="the .exr that `bake` wrote, or its folder")
    parser.add_argument(
        "--with", action="append", type=_shared, metavar="BAKE=SHARE", dest="others", default=[],
        help="another bake to mix in, and its share of the surface from 0 to 1 (at most twice)",
    )  # fmt: skip
    parser.add_argument(
        "--by", type=name_argument, default="noise", metavar="noise|ATTRIBUTE",
        help="spread the bakes in patches of noise (default), or by a mesh attribute with values from 0 to 1, such as "
        "scale_random",
    )  # fmt: skip
    parser.add_argument(
        "--softness", type=number(0, 1), default=0.0, help="how widely they blend into each other, 0 to 1"
    )
    parser.add_argument(
        "--turn", type=number(0, 90), default=0.0, metavar="DEGREES", help="largest turn of the direction either way"
    )
    parser.add_argument(
        "--size-mm", type=number(1e-3, 1e9), default=20.0, help="width of the patches in object space; default 20"
    )
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `vary` verb."""
    if len(arguments.others) > _OTHERS_MAX:
        too_many, _ = arguments.others[_OTHERS_MAX]
        raise GratingError(f"--with {too_many}", "one too many", f"a bake has {_OTHERS_MAX} others at most")
    names = [arguments.bake, *(name for name, _ in arguments.others)]
    # Adding a grating may move the others in memory, so all are added before any is kept.
    gratings = bpy.context.scene.natural_gratings.items
    grating, *others = (gratings[index] for index in [index_of(bpy.context.scene, name) for name in names])
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
    """Parse BAKE=SHARE."""
    name, _, share = text.rpartition("=")
    if not name:
        raise argparse.ArgumentTypeError(f"{text}: give BAKE=SHARE, such as skin.exr=0.3")
    return name, number(0, 1)(share)

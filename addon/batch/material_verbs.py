# SPDX-License-Identifier: GPL-3.0-or-later
"""The verbs that put gratings on meshes and vary them: `assign`, `vary`, `hologram` and `sticker`."""

import argparse

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.cli.arguments import add_progress, name_argument, number
from ...precompute.cli.printing import Progress
from ...precompute.presets.presets import read_preset
from ..gratings.grating import ATTRIBUTE, LIGHTS, NOISE, Variation
from ..materials.holograms.patterns import NONE, OWN_INPUTS, PICTURE
from ..materials.skin import SETTABLE
from ..operators.add_things import AddSticker
from ..operators.vary import AddHologram, VaryGrating
from ..workflow.adding_things import FIRST, Sticker, add_sticker
from ..workflow.assigning import add_to_meshes, assign_to_meshes
from ..workflow.lights.fitting_frames import fit_frames
from ..workflow.lights.lighting import warnings_about
from ..workflow.loading_bakes import bake_file, index_of
from ..workflow.making_materials import refresh_group, vary
from ..workflow.varying_inputs import Hologram, add_hologram
from .operator_options import add_properties, add_property, values
from .shared_options import add_objects, add_save, chosen_meshes, chosen_objects, finish, set_inputs, setting

_OTHERS_MAX = 2


def _add_bake(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("bake", type=name_argument, metavar="BAKE", help="the .exr that `bake` wrote, or its folder")


def assign_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `assign`."""
    _add_bake(parser)
    add_objects(parser)
    parser.add_argument(
        "--lights",
        choices=[name.lower() for name, _, _ in LIGHTS],
        help="rest: lamps without noise, other light by random samples; lamps: only lamps; all: every light by random "
        "samples, exact but noisy. Default: the grating's setting, rest for a new one",
    )
    parser.add_argument("--over", action="store_true", help="add the diffraction on top of the meshes' own materials")
    parser.add_argument(
        "--fit-frames",
        action="store_true",
        help="fit an animated world's bright parts in each frame of the scene's range, some seconds a frame",
    )
    parser.add_argument("--no-shadows", action="store_true", help="objects cast no shadows on the diffraction")
    parser.add_argument(
        "--set",
        action="append",
        type=name_argument,
        metavar="NAME=VALUE",
        help=f"set an input of the material, angles in degrees (repeatable): {', '.join(SETTABLE)}",
    )
    add_progress(parser)
    add_save(parser)


def run_assign(arguments: argparse.Namespace) -> None:
    """The `assign` verb."""
    settings = dict(setting(text, SETTABLE) for text in arguments.set or ())
    gratings = bpy.context.scene.natural_gratings
    bake_file(arguments.bake)
    chosen = chosen_objects(arguments.object)
    gratings.active_index = index = index_of(bpy.context.scene, arguments.bake)
    if arguments.lights:
        gratings.items[index].lights = arguments.lights.upper()
    if arguments.no_shadows:
        gratings.items[index].shadows = False
    refresh_group(gratings.items[index])
    put = add_to_meshes if arguments.over else assign_to_meshes
    report = put(bpy.context.scene, chosen)
    set_inputs(chosen, gratings.items[index].group, settings)
    if arguments.fit_frames:
        report.append(fit_frames(bpy.context.scene, progress=Progress(arguments.progress)))
    report += warnings_about(bpy.context.scene, bpy.context.evaluated_depsgraph_get())
    finish(arguments, report)


def vary_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `vary`."""
    _add_bake(parser)
    parser.add_argument(
        "--with", action="append", type=_shared, metavar="BAKE=SHARE", dest="others", default=[],
        help="another bake to mix in, and its share of the surface from 0 to 1 (at most twice)",
    )  # fmt: skip
    parser.add_argument(
        "--by", type=name_argument, default="noise", metavar="noise|ATTRIBUTE",
        help="spread the bakes in patches of noise (default), or by a mesh attribute with values from 0 to 1, such as "
        "scale_random",
    )  # fmt: skip
    add_properties(parser, VaryGrating, "softness", "turn")
    parser.add_argument(
        "--size-mm", type=number(1e-3, 1e9), default=20.0, help="width of the patches in object space; default 20"
    )
    add_save(parser)


def run_vary(arguments: argparse.Namespace) -> None:
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
        size_m=arguments.size_mm * 1e-3, **values(arguments, VaryGrating),
    )  # fmt: skip
    finish(arguments, vary(bpy.context.scene, grating, choice, others=others))


def _shared(text: str) -> tuple[str, float]:
    """Parse BAKE=SHARE."""
    name, _, share = text.rpartition("=")
    if not name:
        raise argparse.ArgumentTypeError(f"{text}: give BAKE=SHARE, such as skin.exr=0.3")
    return name, number(0, 1)(share)


def hologram_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `hologram`."""
    add_property(parser, AddHologram, "pattern", flag="pattern")
    add_objects(parser)
    add_property(parser, AddHologram, "filepath", flag="--picture")
    add_properties(parser, AddHologram, "uv_map")
    inputs = "; ".join(f"{name.lower()}: {', '.join(each.name for each in own)}" for name, own in OWN_INPUTS.items())
    parser.add_argument(
        "--set", action="append", type=name_argument, metavar="NAME=VALUE",
        help=f"set an input of the pattern, angles in degrees (repeatable). {inputs}",
    )  # fmt: skip
    add_save(parser)


def run_hologram(arguments: argparse.Namespace) -> None:
    """The `hologram` verb."""
    found = values(arguments, AddHologram)
    pattern = found["pattern"]
    if found["filepath"] and pattern != PICTURE:
        raise GratingError("--picture", f"{arguments.pattern} reads no picture", "leave it out, or choose picture")
    if arguments.set and pattern == NONE:
        raise GratingError("--set", f"{arguments.pattern} has no inputs", "leave it out")
    inputs = {socket.name: socket for socket in OWN_INPUTS.get(pattern, ())}
    settings = dict(setting(text, inputs) for text in arguments.set or ())
    choice = Hologram(pattern, settings, picture=found["filepath"], uv_map=found["uv_map"])
    finish(arguments, add_hologram(bpy.context.scene, chosen_meshes(arguments.object), choice))


def sticker_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `sticker`."""
    parser.add_argument(
        "--preset", type=name_argument, dest="surface", metavar="NAME",
        help=f"what it is made of; default: the scene's active grating, or without one {FIRST}",
    )  # fmt: skip
    add_property(parser, AddSticker, "filepath", flag="--picture")
    add_properties(parser, AddSticker, "size", "rotation")
    add_objects(parser)
    add_save(parser)


def run_sticker(arguments: argparse.Namespace) -> None:
    """The `sticker` verb."""
    if arguments.surface:
        read_preset(arguments.surface)  # an unknown one is refused before anything is changed
    found = values(arguments, AddSticker)
    choice = Sticker(arguments.surface or "", found.pop("filepath"), **found)
    meshes, report = chosen_meshes(arguments.object), []
    for mesh in meshes:
        report += add_sticker(bpy.context, mesh, choice)
    finish(arguments, report)

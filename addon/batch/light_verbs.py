# SPDX-License-Identifier: GPL-3.0-or-later
"""The verbs of lamps: `light-rig`, `lights` and `diffraction-lamp`."""

import argparse

import bpy
from mathutils import Vector

from ...precompute.base.failure import GratingError
from ...precompute.cli.arguments import name_argument, number
from ..operators.light import AddDiffractionLamp, AddLightRig, ChooseLights
from ..workflow.lights.adding_diffraction_lamps import add_diffraction_lamp, shows_grating
from ..workflow.lights.adding_light_rigs import Rig, add_light_rig, carriers
from ..workflow.lights.lighting import keep_lamp
from ..workflow.making_materials import choose_lights
from .operator_options import add_properties, add_property, values
from .shared_options import add_gratings, add_objects, add_save, chosen_gratings, chosen_meshes, finish

_ANYWHERE = number(-1e6, 1e6)


def light_rig_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `light-rig`."""
    add_properties(parser, AddLightRig, "kind", "strength", "softness")
    add_objects(parser, "the active object if it shows a grating, else all that do")
    add_save(parser)


def run_light_rig(arguments: argparse.Namespace) -> None:
    """The `light-rig` verb. Without names it lights the active object, else all objects with a grating."""
    scene = bpy.context.scene
    objects = chosen_meshes(arguments.object) if arguments.object else carriers(scene, bpy.context.active_object)
    for each in objects:
        if not shows_grating(each):
            raise GratingError(each.name, "it shows no grating", "use `assign` first")
    rig = Rig(**values(arguments, AddLightRig))
    finish(arguments, add_light_rig(scene, bpy.context.evaluated_depsgraph_get(), rig, objects=objects))


def lights_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `lights`."""
    add_property(parser, ChooseLights, "lights", flag="lights", nargs="?")
    add_gratings(parser)
    parser.add_argument("--shadows", choices=("on", "off"), help="whether objects cast shadows on the diffraction")
    parser.add_argument(
        "--leave-out", action="append", type=name_argument, metavar="LAMP",
        help="the lamp does not light the diffraction; it still lights everything else (repeatable)",
    )  # fmt: skip
    parser.add_argument(
        "--keep-in", action="append", type=name_argument, metavar="LAMP",
        help="the lamp lights the diffraction (repeatable)",
    )  # fmt: skip
    add_save(parser)


def run_lights(arguments: argparse.Namespace) -> None:
    """The `lights` verb."""
    scene = bpy.context.scene
    if not (arguments.lights or arguments.shadows or arguments.leave_out or arguments.keep_in):
        raise GratingError("", "nothing to change is given", "name the lights, or give --shadows or --leave-out")
    gratings = chosen_gratings(scene, arguments)
    lines = []
    for names, counts in ((arguments.leave_out, False), (arguments.keep_in, True)):
        for name in names or ():
            lines += keep_lamp(scene, name, counts=counts)
    for grating in gratings:
        if arguments.shadows:
            grating.shadows = arguments.shadows == "on"
        chosen = values(arguments, ChooseLights)["lights"] if arguments.lights else grating.lights
        lines += choose_lights(grating, chosen)
    finish(arguments, lines)


def diffraction_lamp_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `diffraction-lamp`."""
    parser.add_argument("--object", required=True, type=name_argument, metavar="NAME", help="a mesh with a grating")
    parser.add_argument(
        "--near", nargs=3, type=_ANYWHERE, metavar=("X", "Y", "Z"), default=None,
        help="place the patch where the mesh is nearest to this point, in metres; default: the 3D cursor",
    )  # fmt: skip
    add_properties(parser, AddDiffractionLamp, "size_mm")
    add_property(parser, AddDiffractionLamp, "lamp", flag="--lit-by")
    add_save(parser)


def run_diffraction_lamp(arguments: argparse.Namespace) -> None:
    """The `diffraction-lamp` verb."""
    scene = bpy.context.scene
    mesh = scene.objects.get(arguments.object)
    if mesh is None or not shows_grating(mesh):
        raise GratingError(arguments.object, "no mesh of the scene with a grating", "use `assign` first")
    near = scene.cursor.location if arguments.near is None else Vector(arguments.near)
    found, depsgraph = values(arguments, AddDiffractionLamp), bpy.context.evaluated_depsgraph_get()
    size_m, lamp = found["size_mm"] * 1e-3, found["lamp"]
    _, report = add_diffraction_lamp(scene, mesh, depsgraph, near=near, size_m=size_m, lamp_name=lamp)
    finish(arguments, report)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of the settings that hide a grating's colours: its bake, material and direction, how the picture is shown,
what lights the grating, and the inputs of its Diffraction nodes."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from ..blender import compat
from ..direction.tangents import frame_field
from ..direction.uv_maps import has_uv_map
from ..gratings.direction_source import AXIS, FRAME_MAP, RADIAL, DirectionSource
from ..gratings.grating import ALL, LAMPS_ONLY, Grating
from ..lamps.brightest_lamps import instanced_lamps, instances_are_not_followed, irradiances, is_left_out, lamps_of
from ..lamps.light_linking import receives
from ..lamps.sky import source_count
from ..materials.group_properties import frame_of, is_diffraction
from ..materials.holograms.hologram_nodes import input_set_by_artist
from ..materials.lost_parts import lost_of_nodes, lost_of_others, lost_of_own
from ..materials.material import diffraction_nodes, empty_nodes, listed, outside_light_groups, shows_diffraction
from ..materials.response import HEIGHT_SCALE, PERIOD_SCALE, ROUGHNESS
from ..materials.skin import SETTABLE, answers_to_world, crowded
from ..worlds.world_light import world_light
from .subject import Button, Cause, Subject, held_out, hidden_by, light_button, mend

_BAKE = Button("grating.bake", "Bake Grating", invoked=True)


def before_assigning(scene: bpy.types.Scene) -> Cause:
    """Why no mesh of the scene shows its active grating."""
    grating = scene.natural_gratings.active()
    if grating is None:
        return Cause("NO_GRATING", "The list has no grating. Import a height map, or add a sample or a preset.")
    if (emptied := _emptied(grating)) is not None:
        return emptied
    if not is_diffraction(grating.group) and (cause := _unbaked(grating)) is not None:
        return cause
    assign = Button("grating.assign", "Assign to Selected")
    return Cause("NOT_ASSIGNED", f"No object shows {grating.name}. Select a mesh and assign the grating to it.", assign)


def _emptied(grating: Grating) -> Cause | None:
    """The cause that the node group of the grating's material was deleted."""
    if grating.material is None or not empty_nodes(grating.material):
        return None
    mended = Button("grating.mend", "Mend Materials")
    return Cause("LOST", f"The node group in {grating.material.name} was deleted.", mended)


def _unbaked(grating: Grating) -> Cause | None:
    """The cause that a grating has no bake to make a material from."""
    bake = _BAKE if grating.source else None
    if not grating.bake_path:
        return Cause("NOT_BAKED", f"{grating.name} is not baked yet.", bake)
    try:
        grating.baked_file()
    except GratingError:
        return Cause("BAKE_GONE", f"The file of the bake of {grating.name} is gone.", bake)
    return None


def lost_parts(subject: Subject) -> Iterator[Cause]:
    """Deleted or edited pictures, nodes and node groups."""
    group = subject.group
    own = lost_of_own(group)
    fault = own or lost_of_nodes(group) or lost_of_others(group)
    if fault:
        bakes_again = own and _unbaked(subject.grating) is not None and subject.grating.source
        mended = _BAKE if bakes_again else Button("grating.mend", "Mend Materials")
        yield Cause("LOST", f"The material of {subject.grating.name} is damaged: {fault}.", mended)
    elif subject.scene.render.engine != "CYCLES":
        yield from (Cause("CROWDED", f"{line[0].upper()}{line[1:]}.") for line in crowded(group))


def unlinked(subject: Subject) -> Iterator[Cause]:
    """Materials whose output does not show their Diffraction node, and meshes without a face in its slot."""
    in_cycles = subject.scene.render.engine == "CYCLES"
    loose = [each for each in subject.materials if not shows_diffraction(each, in_cycles=in_cycles)]
    if loose:
        text = f"The Diffraction node of {listed(loose)} is not connected to the Material Output, or is muted."
        yield Cause("UNLINKED", text, mend("CONNECT", "Connect the Diffraction"))
    bare = [thing for thing in subject.things if not _has_faces(thing, subject.group)]
    if len(bare) == len(subject.things):
        yield Cause(
            "NO_FACES", f"No face of {listed(bare)} uses the material slot with {subject.grating.name}.",
            mend("GIVE_FACES", "Give the Slot All Faces"),
        )  # fmt: skip


def _has_faces(thing: bpy.types.Object, group: bpy.types.NodeTree) -> bool:
    """Whether a face of a mesh uses a slot whose material has a group. True in Edit Mode, where faces are unknown."""
    slots = thing.material_slots
    held = {i for i, slot in enumerate(slots) if any(n.node_tree == group for n in diffraction_nodes(slot.material))}
    if thing.data.is_editmode or len(held) == len(slots) or not thing.data.polygons:
        return True
    return bool(held & _used_slots(thing))


def _used_slots(thing: bpy.types.Object) -> set[int]:
    """The material slots that faces of a mesh use. As in Blender, an index that is too high means the last slot."""
    numbers = np.empty(len(thing.data.polygons), np.int32)
    thing.data.polygons.foreach_get("material_index", numbers)
    return set(np.minimum(np.unique(numbers), len(thing.material_slots) - 1).tolist())


# Triangles of a mesh whose direction is looked at, and the share without one that gives a warning.
_TRIANGLES, _LACKING = 500, 0.5
_AXES = ("X", "Y", "Z")


def lacking_direction(
    subject: Subject, things: list[bpy.types.Object], depsgraph: bpy.types.Depsgraph
) -> Iterator[Cause]:
    """Meshes, of the given ones, on which the source of the direction gives none: no UV map, one without area, an axis
    along the normal."""
    source = frame_of(subject.group)
    if subject.grating.frame_kind == FRAME_MAP and source.kind != FRAME_MAP:
        told = f"The direction map of {subject.grating.name} was deleted, so its UV map is used instead."
        follow = Button("grating.direction", "Follow the UV Map", {"kind": "STORED"})
        yield Cause("DIRECTION_MAP", told, follow)
    for thing in things:
        if thing.data.is_editmode:
            continue
        mesh = thing.evaluated_get(depsgraph).data
        if fault := _fault(mesh, source):
            yield Cause("DIRECTION", f"{thing.name} {fault}, so the grating has no direction there.", _by_axis(mesh))


def _fault(mesh: bpy.types.Mesh, source: DirectionSource) -> str:
    """Why a source gives a mesh no direction, in a few words; empty if it gives one."""
    if not mesh.polygons:
        return ""
    if not has_uv_map(mesh, source):
        return " ".join(filter(None, ("has no UV map", source.named_uv_map)))
    if _lacking_share(mesh, source) < _LACKING:
        return ""
    if source.kind == AXIS:
        return f"faces along its {source.axis} axis, which the direction follows"
    if source.kind == RADIAL:
        return f"faces away from its {source.axis} axis, as the direction does"
    return "has a UV map without area"


def _lacking_share(mesh: bpy.types.Mesh, source: DirectionSource) -> float:
    """The share of a mesh's triangles, evenly chosen, at whose centres a source gives no direction."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    chosen = np.unique(np.linspace(0, count - 1, min(count, _TRIANGLES)).astype(int))
    tangents = frame_field(mesh, chosen, shares=np.full((len(chosen), 3), 1 / 3), source=source).tangents
    return float((~np.isfinite(tangents).all(axis=1)).mean())


def _by_axis(mesh: bpy.types.Mesh) -> Button:
    """The button that makes the direction follow the axis that serves most faces of a mesh."""
    shares = {axis: _lacking_share(mesh, DirectionSource(AXIS, axis=axis)) for axis in _AXES}
    axis = min(_AXES, key=lambda each: shares[each])
    return Button("grating.direction", f"Follow the Object's {axis} Axis", {"kind": AXIS, "axis": axis})


_UNSHADED = {"SOLID": "Solid", "WIREFRAME": "Wireframe"}
# Stops of exposure below which a picture of ordinary light is black.
_DARK_STOPS = -3.0
# View transforms that turn saturated colours to grey, and the words for them.
_GREYING = ("AgX", "Filmic", "Filmic Log", "False Color")
# Fewer samples leave the random orders of a world as single dots.
_FEW_SAMPLES = 32


def unshaded_view(views: list[bpy.types.SpaceView3D]) -> Iterator[Cause]:
    """No 3D view on the screen shows materials."""
    kinds = [view.shading.type for view in views]
    if kinds and all(kind in _UNSHADED for kind in kinds):
        told = f"The 3D view shows {_UNSHADED[kinds[0]]} shading, which has no diffraction."
        yield Cause("SHADING", told, mend("RENDERED", "Switch to Rendered"))


def other_pass(scene: bpy.types.Scene, views: list[bpy.types.SpaceView3D]) -> Iterator[Cause]:
    """The 3D view shows a part of the light, which has no name for diffraction."""
    for view in views[:1]:
        in_cycles = scene.render.engine == "CYCLES"
        if view.shading.type != "RENDERED" and (in_cycles or view.shading.type != "MATERIAL"):
            return
        passes: Any = view.shading.cycles if in_cycles else view.shading
        if passes.render_pass != "COMBINED":
            name = passes.bl_rna.properties["render_pass"].enum_items[passes.render_pass].name
            told = f"The 3D view shows the render pass {name} instead of Combined."
            yield Cause("RENDER_PASS", told, mend("RENDER_PASS", "Show Combined"))


def lights_off(subject: Subject, views: list[bpy.types.SpaceView3D]) -> Iterator[Cause]:
    """Rendered shading leaves the scene's lamps out. Only lamps that are sampled at random vanish from the diffraction.
    Material Preview leaves lamps out by default."""
    for view in views[:1]:
        if view.shading.type != "RENDERED" or view.shading.use_scene_lights_render:
            return
        is_dark = subject.lit_by == ALL
        told = "do not light the diffraction" if is_dark else "light the diffraction, and no other surface"
        on = mend("SCENE_LIGHTS", "Switch Scene Lights On")
        kind = "NO_SCENE_LIGHTS" if is_dark else "SCENE_LIGHTS"
        yield Cause(kind, f"Scene Lights is off in the 3D view: there, lamps {told}.", on)


def layer_settings(layer: bpy.types.ViewLayer) -> Iterator[Cause]:
    """The view layer shows another material on all objects, or no surface at all."""
    reset = mend("VIEW_LAYER", "Show the Materials")
    if layer.material_override is not None:
        told = f"The view layer's Material Override shows {layer.material_override.name} on all objects."
        yield Cause("VIEW_LAYER", told, reset)
    elif not layer.use_solid:
        yield Cause("VIEW_LAYER", f"The view layer {layer.name} leaves out surfaces (Filter > Surfaces).", reset)


def hidden_objects(subject: Subject) -> Iterator[Cause]:
    """All objects that show the grating are hidden; or some are holes in the picture, which look black."""
    reasons = {thing: why for thing in subject.things if (why := _hidden(thing, subject.layer))}
    if len(reasons) == len(subject.things):
        yield Cause("HIDDEN", _told(reasons), mend("SHOW_OBJECTS", f"Show {listed(subject.things)}"))
        return
    holes = {thing: why for thing in reasons if (why := held_out(thing, subject.layer))}
    if holes:
        yield Cause("HELD_OUT", _told(holes))


def _told(reasons: dict[bpy.types.Object, str]) -> str:
    """The first three objects, each with why it is not seen."""
    return f"{'; '.join(f'{thing.name} {why}' for thing, why in list(reasons.items())[:3])}."


def _hidden(thing: bpy.types.Object, layer: bpy.types.ViewLayer) -> str:
    seen = "" if thing.visible_camera else "is hidden from the camera (Ray Visibility)"
    return hidden_by(thing, layer) or seen or held_out(thing, layer)


def dark_exposure(scene: bpy.types.Scene) -> Iterator[Cause]:
    """The exposure makes any picture black."""
    stops = scene.view_settings.exposure
    film = scene.cycles.film_exposure if scene.render.engine == "CYCLES" else 1.0
    reset = mend("EXPOSURE", "Reset the Exposure")
    if stops < _DARK_STOPS:
        yield Cause("EXPOSURE", f"The scene's exposure of {stops:.1f} stops darkens the picture.", reset)
    elif film < 2.0**_DARK_STOPS:
        yield Cause("EXPOSURE", f"The film's exposure of {film:.2g} darkens the picture.", reset)


def few_samples(subject: Subject) -> Iterator[Cause]:
    """Too few samples for light that random samples find."""
    scene = subject.scene
    is_noisy = subject.lit_by == ALL or not lamps_of(scene)
    is_cycles = scene.render.engine == "CYCLES"
    samples = scene.cycles.samples if is_cycles else scene.eevee.taa_render_samples
    if is_noisy and samples < _FEW_SAMPLES:
        told = f"Random samples light {subject.grating.name}, and {samples} samples show them as single dots."
        yield Cause("SAMPLES", told, mend("SAMPLES", "Render 256 Samples"))


def without_light_group(scene: bpy.types.Scene) -> Iterator[Cause]:
    """Diffraction that a compositor does not find in the scene's light groups."""
    yield from (Cause("LIGHT_GROUPS", f"{line}.") for line in outside_light_groups(scene))


def greying_transform(scene: bpy.types.Scene) -> Iterator[Cause]:
    """A view transform that turns the saturated colours of diffraction to grey."""
    name = scene.view_settings.view_transform
    if name in _GREYING:
        told = f"The view transform {name} makes spectral colours greyer than they are."
        yield Cause("VIEW_TRANSFORM", told, mend("VIEW_TRANSFORM", "Show Purer Colours"))


# Nodes that give a world colours that differ from direction to direction.
_UNEVEN = {"TEX_ENVIRONMENT", "TEX_SKY", "TEX_IMAGE", "TEX_COORD", "NEW_GEOMETRY"}


def dark_lamps(subject: Subject) -> Iterator[Cause]:
    """No lamp, or none that is on, and nothing else that gives colours."""
    lamps = lamps_of(subject.scene)
    dark = {lamp: why for lamp in lamps if (why := why_dark(lamp, subject))}
    if len(dark) < len(lamps) or source_count(subject.scene) > 0 or has_other_light(subject):
        return
    if lamps:
        reasons = "; ".join(f"{lamp.name} {why}" for lamp, why in list(dark.items())[:3])
        told = f"No lamp lights {listed(subject.things)}: {reasons}."
        yield Cause("DARK_LAMPS", told, mend("SHOW_LAMPS", "Show the Lamps"))
        return
    instanced = instanced_lamps(subject.layer.depsgraph)
    if instanced:
        line = instances_are_not_followed(instanced)
        yield Cause("INSTANCED", f"{line[0].upper()}{line[1:]}.", light_button())
        return
    yield Cause("NO_LAMP", f"The scene has no lamp, {_without_lamps(subject)}.", light_button())


def why_dark(lamp: bpy.types.Object, subject: Subject) -> str:
    """Why a lamp lights none of the objects; empty if it lights one."""
    hidden = hidden_by(lamp, subject.layer)
    if hidden:
        return hidden
    if is_left_out(lamp) and subject.lit_by != ALL:
        return "is left out of the diffraction"
    if not lamp.visible_glossy:
        return "is hidden from glossy rays (Object > Visibility > Ray Visibility)"
    if lamp.data.energy == 0:
        return "has no power"
    if max(lamp.data.color) <= 0:
        return "is black"
    if not irradiances([lamp], ())[0] > 0:
        return "is so small or weak that it gives no light"
    receivers = lamp.light_linking.receiver_collection
    if receivers is not None and not any(receives(receivers, thing) for thing in subject.things):
        return "is kept away by Light Linking"
    return ""


def _without_lamps(subject: Subject) -> str:
    if _lights_alone(subject):
        return "and with Lamps Only nothing else lights the diffraction, so it is black"
    return "and an even world shows no colours" if world_light(subject.scene.world) > 0 else "and its world is black"


def has_other_light(subject: Subject) -> bool:
    """Whether something may show colours that is neither a lamp nor a source of the world: an uneven world without
    sources, or an object that shines."""
    if _lights_alone(subject):
        return False
    scene = subject.scene
    is_uneven = world_light(scene.world) > 0 and _is_uneven(scene.world) and source_count(scene) == 0
    return is_uneven or any(_shines(each) for each in _other_materials(subject))


def _lights_alone(subject: Subject) -> bool:
    return subject.lit_by == LAMPS_ONLY or not answers_to_world(subject.group)


def _is_uneven(world: bpy.types.World) -> bool:
    """Whether a world's light may differ from direction to direction."""
    tree = compat.world_nodes(world)
    return tree is not None and any(node.type in _UNEVEN or node.type == "GROUP" for node in tree.nodes)


def _other_materials(subject: Subject) -> set[bpy.types.Material]:
    """The materials of the scene's other objects."""
    others = set(subject.scene.objects) - set(subject.things)
    return {slot.material for thing in others for slot in thing.material_slots if slot.material is not None}


def _shines(material: bpy.types.Material) -> bool:
    """Whether a material has nodes that give light."""
    for node in material.node_tree.nodes if material.node_tree is not None else ():
        name = {"EMISSION": "Strength", "BSDF_PRINCIPLED": "Emission Strength"}.get(node.type, "")
        if name in node.inputs and (node.inputs[name].is_linked or node.inputs[name].default_value > 0):
            return True
    return False


# The period in a grating's summary (workflow/importing.py), in nanometres.
_PERIOD = re.compile(r"^period ([0-9.]+) nm\b", re.MULTILINE)
# A first order needs |u| = wavelength / period, and |u| is at most 2, so a finer period sends no violet (400 nm).
_FINEST_NM = 200.0
# Here the orders of 550 nm are 1.6 degrees apart. The next order of violet lies on the former order of red, so the
# colours mix to white.
_COARSEST_NM = 20e3


@dataclass(frozen=True)
class _Limit:
    """An input of a Diffraction node with the values that hide its colours: those up to `low` or from `high`."""

    name: str
    told: str
    low: float = -1.0
    high: float = float("inf")

    def hides(self, value: float) -> bool:
        """Whether a value of the input hides the colours."""
        return value <= self.low or value >= self.high


# Inputs with the values that hide nearly all colours: 1 % of the strength, a relief of a few nanometres.
_LIMITS = (
    _Limit("Strength", "makes the diffraction black", low=0.01),
    _Limit("Base Blend", "hides the diffraction", high=0.99),
    _Limit(HEIGHT_SCALE.name, "flattens the relief to a mirror", low=0.02),
    _Limit(ROUGHNESS.name, "blurs the colours to white", high=0.5),
)


def hiding_inputs(subject: Subject) -> Iterator[Cause]:
    """Inputs of the Diffraction nodes, or of their holograms, that hide the colours."""
    for limit in _LIMITS:
        found = [material for material in subject.materials if any(map(limit.hides, _values(subject, material, limit)))]
        if found:
            default = SETTABLE[limit.name].default
            value = next(value for value in _values(subject, found[0], limit) if limit.hides(value))
            told = f"{limit.name} is {value:.2g} in {listed(found)}, which {limit.told}."
            action = limit.name.upper().replace(" ", "_")
            yield Cause(action, told, mend(action, f"Set {limit.name} to {default:g}"))


def unsuited_period(subject: Subject) -> Iterator[Cause]:
    """A period so fine that no colour leaves the surface, or so coarse that its colours mix."""
    noted = _PERIOD.search(subject.grating.summary)
    scales = [socket.default_value for node in subject.nodes if (socket := set_number(node, PERIOD_SCALE.name))]
    if noted is None:
        return
    scale = scales[0] if scales else 1.0
    period = float(noted[1]) * scale
    if _FINEST_NM <= period <= _COARSEST_NM:
        return
    why = (
        "finer than half a wavelength of light, so the surface sends no colour"
        if period < _FINEST_NM
        else "so coarse that its rainbows overlap and mix to white"
    )
    scaled = f" with a Period Scale of {scale:.3g}" if scale != 1 else ""
    reset = mend("PERIOD_SCALE", "Set Period Scale to 1") if scale != 1 else None
    told = f"{period:.0f} nm" if period < 10e3 else f"{period / 1e3:.3g} um"
    yield Cause("PERIOD", f"The period of {subject.grating.name}{scaled} is {told}: {why}.", reset)


def set_number(node: bpy.types.Node, name: str) -> bpy.types.NodeSocket | None:
    """The socket that holds the number of a Diffraction node's input, which may be its hologram's; None if links or
    deleted sockets make it unknown."""
    if name not in node.inputs:
        return None
    socket = input_set_by_artist(node, name)
    return socket if not socket.is_linked and isinstance(socket.default_value, float) else None


def _values(subject: Subject, material: bpy.types.Material, limit: _Limit) -> list[float]:
    nodes = [node for node in diffraction_nodes(material) if node.node_tree == subject.group]
    return [socket.default_value for node in nodes if (socket := set_number(node, limit.name)) is not None]

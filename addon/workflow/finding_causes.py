# SPDX-License-Identifier: GPL-3.0-or-later
"""Finding out why an artist sees no diffraction colours, and the actions that remove the causes."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain, islice
from typing import Any

import bpy
from mathutils import Vector

from ...precompute.base.failure import GratingError
from ..blender.session import has_window
from ..blender.working_space import show_pure_colours
from ..cameras.seen_surfaces import ViewPixels
from ..causes.seen_causes import WELL_LIT, Seen, badly_lit, few_colours, outside_bake, seen, shaded, unseen
from ..causes.setting_causes import (
    before_assigning,
    dark_exposure,
    dark_lamps,
    few_samples,
    greying_transform,
    has_other_light,
    hidden_objects,
    hiding_inputs,
    lacking_direction,
    layer_settings,
    lights_off,
    lost_parts,
    other_pass,
    set_number,
    unlinked,
    unshaded_view,
    unsuited_period,
    why_dark,
    without_light_group,
)
from ..causes.subject import HARMLESS, Cause, Subject, end_holdout, show, subject_of
from ..lamps.brightest_lamps import AUTO, COUNTS, irradiances, lamps_of
from ..materials.material import add_diffraction, boxes_showing, listed
from ..materials.skin import SETTABLE, set_up
from .lights.lighting import update_lamps


@dataclass(frozen=True)
class Findings:
    """The causes of missing colours, the most decisive first, then warnings; and a sentence about the whole."""

    causes: list[Cause]
    summary: str


def findings(context: bpy.types.Context) -> Findings:
    """Why the active grating shows no colours in the context's scene: the causes, and a sentence that names the first,
    or says that nothing hides the colours. It looks through the 3D view, or through the camera if the view does.
    Nothing is changed."""
    subject = subject_of(context.scene, context.view_layer)
    if subject is None:
        first = before_assigning(context.scene)
        return Findings([first], first.sentence)
    depsgraph = context.evaluated_depsgraph_get()
    causes, look = _settled(context, subject), None
    if all(cause.is_warning for cause in causes):  # a look takes longest, and a black scene shows it nothing
        look = seen(subject, depsgraph, _view_pixels(context))
    # Places without a direction are no part of a look, so what is seen has one.
    others = [thing for thing in subject.things if look is None or thing not in look.things]
    causes += lacking_direction(subject, others, depsgraph)
    if look is not None:
        causes += _seen_causes(subject, look, depsgraph)
    causes += [*few_samples(subject), *greying_transform(subject.scene), *without_light_group(subject.scene)]
    causes.sort(key=lambda cause: cause.is_warning)
    if causes and causes[0].kind not in HARMLESS:
        return Findings(causes, causes[0].sentence)
    return Findings(causes, _nothing_wrong(subject, look))


def _settled(context: bpy.types.Context, subject: Subject) -> list[Cause]:
    """The causes that settings alone tell."""
    views = views_of(context)
    return [
        *lost_parts(subject),
        *unlinked(subject),
        *hidden_objects(subject),
        *layer_settings(subject.layer),
        *unshaded_view(views),
        *other_pass(subject.scene, views),
        *lights_off(subject, views),
        *hiding_inputs(subject),
        *unsuited_period(subject),
        *dark_exposure(subject.scene),
        *dark_lamps(subject),
    ]


def _seen_causes(subject: Subject, look: Seen, depsgraph: bpy.types.Depsgraph) -> Iterator[Cause]:
    """The first cause in a look: the later ones follow from it."""
    found = [unseen(subject, look), outside_bake(subject, look)]
    if not has_other_light(subject):  # of which a look knows nothing
        found += [badly_lit(subject, look), shaded(subject, look, depsgraph), few_colours(look)]
    yield from islice(chain.from_iterable(found), 1)


def _nothing_wrong(subject: Subject, look: Seen | None) -> str:
    """The sentence if nothing hides the colours."""
    if look is None or look.light is None or has_other_light(subject):
        return f"Found nothing wrong with {subject.grating.name}. Not all of its light could be measured."
    share = f"{look.light.coloured_share:.0%} of what {look.by} sees of {listed(look.things)}"
    return f"Nothing is wrong: lamps show diffraction colours on {share}."


def views_of(context: bpy.types.Context) -> list[bpy.types.SpaceView3D]:
    """The 3D views on the context's screen, the one of the context first. None in background, where no one sees
    them."""
    if not has_window() or context.screen is None:
        return []
    views: list[Any] = [area.spaces.active for area in context.screen.areas if area.type == "VIEW_3D"]
    return sorted(views, key=lambda view: view != context.space_data)


def _view_pixels(context: bpy.types.Context) -> ViewPixels | None:
    """The pixels of the 3D view that the artist looks at: that of the context, else the largest on the screen. None if
    it looks through the camera, or without a view."""
    areas = [area for area in context.screen.areas if area.type == "VIEW_3D"] if views_of(context) else []
    if not areas:
        return None
    area = max(areas, key=lambda each: (each == context.area, each.width * each.height))
    view: Any = area.spaces.active
    if view.region_3d.view_perspective == "CAMERA":
        return None
    region = next(each for each in area.regions if each.type == "WINDOW")
    return ViewPixels(view.region_3d, (max(region.width, 1), max(region.height, 1)))


_SAMPLES = 256


def mend_cause(context: bpy.types.Context, action: str) -> str:
    """Do one of ACTIONS. Returns a line to report. Raises GratingError if there is nothing to do it to."""
    return ACTIONS[action](context)


def _subject(context: bpy.types.Context) -> Subject:
    subject = subject_of(context.scene, context.view_layer)
    if subject is None:
        raise GratingError(f"scene {context.scene.name}", "no object shows its active grating", "assign it first")
    return subject


def _show_lamps(context: bpy.types.Context) -> str:
    subject = _subject(context)
    lamps = [lamp for lamp in lamps_of(subject.scene) if why_dark(lamp, subject)]
    for lamp in lamps:
        show(lamp, subject.layer)
        _switch_on(lamp)
        if why_dark(lamp, subject):  # only its light linking is left
            lamp.light_linking.receiver_collection = None
    context.view_layer.update()
    update_lamps(subject.scene, in_viewport=has_window())
    return f"shown: {_names(lamps) or 'no lamp was dark'}"


def _switch_on(lamp: bpy.types.Object) -> None:
    """Let a lamp light the diffraction, and give it power, a colour, and a size if it lacks them."""
    setattr(lamp, COUNTS, AUTO)
    lamp.visible_glossy = True
    if max(lamp.data.color) <= 0:
        lamp.data.color = (1.0, 1.0, 1.0)
    if not all(lamp.scale):
        lamp.scale = (1.0, 1.0, 1.0)
    if lamp.data.energy == 0:
        lamp.data.energy = 1.0
        lamp.data.energy = WELL_LIT / max(float(irradiances([lamp], ())[0]), 1e-9)


def _brighten(context: bpy.types.Context) -> str:
    subject = _subject(context)
    boxes = boxes_showing(subject.scene)
    lamps = [lamp for lamp in lamps_of(subject.scene) if not why_dark(lamp, subject)]
    wanted = WELL_LIT / 2.0**subject.scene.view_settings.exposure
    for lamp, now in zip(lamps, irradiances(lamps, boxes).tolist(), strict=True):
        if 0 < now < wanted:
            lamp.data.energy *= wanted / now
    return f"brightened: {_names(lamps)}"


def _show_objects(context: bpy.types.Context) -> str:
    subject = _subject(context)
    for thing in subject.things:
        show(thing, subject.layer)
        thing.visible_camera = True
        end_holdout(thing, subject.layer)
    return f"shown: {_names(subject.things)}"


def _aim_camera(context: bpy.types.Context) -> str:
    subject, camera = _subject(context), context.scene.camera
    if camera is None:
        raise GratingError(f"scene {context.scene.name}", "no camera", "add one and make it the scene's camera")
    thing = subject.things[0]
    corners = [thing.matrix_world @ Vector(corner) for corner in thing.bound_box]
    middle = sum(corners, Vector()) / len(corners)
    place = camera.matrix_world.translation.copy()
    turned = (middle - place).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    turned.translation = place
    camera.matrix_world = turned
    return f"{camera.name}: turned to {thing.name}"


def _shading(context: bpy.types.Context) -> Any:
    """The shading of the 3D view that the artist looks at. Raises GratingError without one."""
    views = views_of(context)
    if not views:
        raise GratingError("screen", "no 3D view on it", "open one")
    return views[0].shading


def _rendered(context: bpy.types.Context) -> str:
    _shading(context).type = "RENDERED"
    return "the 3D view shows Rendered shading"


def _render_pass(context: bpy.types.Context) -> str:
    shading = _shading(context)
    shading.render_pass = shading.cycles.render_pass = "COMBINED"
    return "the 3D view shows the pass Combined"


def _scene_lights(context: bpy.types.Context) -> str:
    _shading(context).use_scene_lights_render = True
    return "the 3D view shows the scene's lights"


def _view_layer(context: bpy.types.Context) -> str:
    layer = context.view_layer
    layer.material_override, layer.use_solid = None, True
    return f"view layer {layer.name}: shows the objects' own materials"


def _connect(context: bpy.types.Context) -> str:
    subject = _subject(context)
    for material in subject.materials:
        add_diffraction(material, subject.group)
    return f"connected: {_names(subject.materials)}"


def _give_faces(context: bpy.types.Context) -> str:
    subject = _subject(context)
    for thing in subject.things:
        shows = [slot.material in subject.materials for slot in thing.material_slots]
        thing.data.polygons.foreach_set("material_index", [shows.index(True)] * len(thing.data.polygons))
        thing.data.update()
    return f"{subject.grating.name}: on all faces of {_names(subject.things)}"


def _reset(name: str) -> Callable[[bpy.types.Context], str]:
    """The action that resets an input of the Diffraction nodes, or of their holograms."""

    def reset(context: bpy.types.Context) -> str:
        subject = _subject(context)
        for node in subject.nodes:
            if (socket := set_number(node, name)) is not None:
                socket.default_value = SETTABLE[name].default
        return f"{name}: {SETTABLE[name].default:g} in {_names(subject.materials)}"

    return reset


def _exposure(context: bpy.types.Context) -> str:
    context.scene.view_settings.exposure = 0.0
    context.scene.cycles.film_exposure = 1.0
    return "exposure: reset"


def _view_transform(context: bpy.types.Context) -> str:
    if name := show_pure_colours(context.scene):
        return f"view transform: {name}"
    raise GratingError("view transform", "none is known to keep pure colours", "choose one in Color Management")


def _samples(context: bpy.types.Context) -> str:
    context.scene.cycles.samples = max(context.scene.cycles.samples, _SAMPLES)
    context.scene.eevee.taa_render_samples = max(context.scene.eevee.taa_render_samples, _SAMPLES)
    return f"renders: at least {_SAMPLES} samples"


def _no_shadows(context: bpy.types.Context) -> str:
    subject = _subject(context)
    subject.grating.shadows = False
    set_up(subject.group, shadows=False, lights=subject.grating.lit_by)
    return f"{subject.grating.name}: objects cast no shadows on it"


ACTIONS: dict[str, Callable[[bpy.types.Context], str]] = {
    "SHOW_LAMPS": _show_lamps,
    "BRIGHTEN": _brighten,
    "SHOW_OBJECTS": _show_objects,
    "AIM_CAMERA": _aim_camera,
    "NO_SHADOWS": _no_shadows,
    "RENDERED": _rendered,
    "RENDER_PASS": _render_pass,
    "SCENE_LIGHTS": _scene_lights,
    "VIEW_LAYER": _view_layer,
    "CONNECT": _connect,
    "GIVE_FACES": _give_faces,
    "STRENGTH": _reset("Strength"),
    "BASE_BLEND": _reset("Base Blend"),
    "HEIGHT_SCALE": _reset("Height Scale"),
    "ROUGHNESS": _reset("Roughness"),
    "PERIOD_SCALE": _reset("Period Scale"),
    "EXPOSURE": _exposure,
    "VIEW_TRANSFORM": _view_transform,
    "SAMPLES": _samples,
}


def _names(things) -> str:
    return ", ".join(thing.name for thing in things)

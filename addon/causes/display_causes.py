# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks how the picture is shown: the 3D view's shading, the view layer, exposure, view transform, and samples."""

from collections.abc import Iterator
from typing import Any

import bpy

from ..gratings.lights_choice import ALL
from ..lamps.find import lamps_of
from ..materials.group_users import listed
from .cause import Cause, mend
from .shown_things import held_out, hidden_by
from .subject import Subject

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
    """All objects that show the grating are hidden."""
    reasons = {thing: why for thing in subject.things if (why := _hidden(thing, subject.layer))}
    if len(reasons) == len(subject.things):
        told = "; ".join(f"{thing.name} {why}" for thing, why in list(reasons.items())[:3])
        yield Cause("HIDDEN", f"{told}.", mend("SHOW_OBJECTS", f"Show {listed(subject.things)}"))


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


def greying_transform(scene: bpy.types.Scene) -> Iterator[Cause]:
    """A view transform that turns the saturated colours of diffraction to grey."""
    name = scene.view_settings.view_transform
    if name in _GREYING:
        told = f"The view transform {name} makes spectral colours greyer than they are."
        yield Cause("VIEW_TRANSFORM", told, mend("VIEW_TRANSFORM", "Show Purer Colours"))

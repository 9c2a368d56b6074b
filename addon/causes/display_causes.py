# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks how the picture is shown: the 3D view's shading, exposure, view transform, and samples."""

from collections.abc import Iterator

import bpy

from ..gratings.lights_choice import ALL
from ..lamps.find import lamps_of
from ..materials.group_users import listed
from .cause import Cause, mend
from .shown_things import hidden_by
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


def hidden_objects(subject: Subject) -> Iterator[Cause]:
    """All objects that show the grating are hidden."""
    reasons = {thing: why for thing in subject.things if (why := _hidden(thing, subject.layer))}
    if len(reasons) == len(subject.things):
        told = "; ".join(f"{thing.name} {why}" for thing, why in list(reasons.items())[:3])
        yield Cause("HIDDEN", f"{told}.", mend("SHOW_OBJECTS", f"Show {listed(subject.things)}"))


def _hidden(thing: bpy.types.Object, layer: bpy.types.ViewLayer) -> str:
    return hidden_by(thing, layer) or ("" if thing.visible_camera else "is hidden from the camera (Ray Visibility)")


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

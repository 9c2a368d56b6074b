# SPDX-License-Identifier: GPL-3.0-or-later
"""Finding out why an artist sees no diffraction colours."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, islice
from typing import Any

import bpy

from ..blender.session import has_window
from ..cameras.seen_surfaces import ViewPixels
from ..causes.seen_causes import Seen, badly_lit, few_colours, outside_bake, seen, shaded, unseen
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
    unlinked,
    unshaded_view,
    unsuited_period,
)
from ..causes.subject import HARMLESS, Cause, Subject, subject_of
from ..materials.material import listed


@dataclass(frozen=True)
class Findings:
    """The causes of missing colours, the most decisive first, then warnings; and a sentence about the whole."""

    causes: list[Cause]
    summary: str

    @property
    def is_well(self) -> bool:
        """Whether nothing hides the colours: there are only warnings, or nothing at all."""
        return all(cause.is_warning for cause in self.causes)


def find_causes(context: bpy.types.Context) -> list[Cause]:
    """Why the active grating shows no colours in the context's scene: causes, the most decisive first, then warnings.
    It looks through the 3D view, or through the camera if the view does. Nothing is changed."""
    return findings(context).causes


def findings(context: bpy.types.Context) -> Findings:
    """The causes, and a sentence that names the first, or says that nothing hides the colours."""
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
    causes += [*few_samples(subject), *greying_transform(subject.scene)]
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

# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeping diffraction up to date: handlers that Blender calls after each change, and around undo, files and renders.

Drivers follow the values of a lamp. These handlers notice when lamps come, go, change type, move between collections,
are hidden, or are light-linked. They also apply a grating's settings to its materials. They write only what differs, so
a change that concerns no lamp causes no evaluation and no shader compilation.

With a window, Blender calls the handlers at each step of a drag. Then they check only what has changed. Once nothing
has changed for a moment, a timer checks everything: which of too many lamps are the brightest, and changes that Blender
does not report. Renders and saves check everything too.

These writes are not part of an undo step. If undo finds a data-block unchanged, it keeps it with everything written
since. A pointer in that data-block to one that undo removes would dangle. So the properties are removed before an undo
and made again after it, and new nodes in Diffraction groups point only to what the old ones pointed to."""

import sys
from collections.abc import Callable
from itertools import islice

import bpy
from bpy.app.handlers import persistent

from ..blender import mesa
from ..blender.guard import guarded
from ..blender.session import STILL, has_window, is_rendering, note_change, seconds_until_still
from ..lamps.follow import follow_lamps, followed_lamps, has_lost_lamps, left_out_lamps, stop_following
from ..lamps.lamp_spectrum import FIELD
from ..lamps.rendered_lamps import show_as_rendered
from ..materials.data_pictures import wrong_colours
from ..materials.exporting import show_again
from ..materials.group_properties import is_diffraction
from ..materials.skin import renew_outdated
from .lights.fitting_worlds import (
    drop_stale_sources,
    forget_worlds,
    forget_worlds_of,
    stop_fitting,
    unfitted_world,
    want_fit,
    world_is_known,
)
from .lights.lighting import lit_boxes, update_lamps


@persistent
@guarded
def follow_change(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """After Blender has evaluated a scene. A change of a followed lamp is always reported as a change of the scene
    too."""
    note_change()
    if depsgraph.mode == "RENDER":
        return
    if scene.library is not None or is_rendering():
        forget_worlds()
        return
    if not _has_diffraction():  # most files stop here
        forget_worlds()
        if has_lost_lamps(scene):  # one was deleted after the last Diffraction group
            stop_following(scene)
        return
    changed = {update.id.original for update in islice(depsgraph.updates, _LOOKED_AT)}
    came_or_went = depsgraph.id_type_updated("COLLECTION") and (
        scene.collection in changed or len(changed) == _LOOKED_AT
    )
    if came_or_went or depsgraph.id_type_updated("IMAGE"):
        forget_worlds()
    else:
        forget_worlds_of(changed)
    if has_window() and not bpy.app.timers.is_registered(_follow_when_still):
        bpy.app.timers.register(_follow_when_still, first_interval=STILL)
    if not (depsgraph.id_type_updated("SCENE") or depsgraph.id_type_updated("WORLD")):
        return
    if not (has_window() and world_is_known(scene)):
        _follow_world(scene)
    _follow_settings(scene)
    # In background no timer checks everything. There a lamp's new strength may change which lamps are the brightest.
    brightest_may_be_others = not has_window() and depsgraph.id_type_updated("LIGHT")
    if came_or_went or brightest_may_be_others or _noticed.get(scene.name_full) != _state(scene):
        _update_lamps(scene)


@guarded
def _follow_when_still() -> float | None:
    """Check everything once nothing has changed for a moment. Returns the seconds to wait, or None when done."""
    wait = STILL if is_rendering() else seconds_until_still()
    if wait == 0:
        _follow_all(exactly=False)
    return wait or None


@persistent
@guarded
def follow_file(*_: object) -> None:
    """After a file was opened. Nothing is compiled yet, so surplus lamps are removed from the groups."""
    _follow_all(exactly=True)


@persistent
@guarded
def follow_again(*_: object) -> None:
    """After an import or a save."""
    _follow_all(exactly=False)


@persistent
@guarded
def follow_undo(*_: object) -> None:
    """After an undo or a redo."""
    from ..showcase.show_views import follow_scenes  # Blender's start does not need it

    _follow_all(exactly=False)
    follow_scenes()


@persistent
@guarded
def let_go(*_: object) -> None:
    """Before an undo or a redo, also where the last Diffraction group was just deleted."""
    from ..showcase.show_views import note_scenes

    note_scenes()
    for scene in bpy.data.scenes:
        if scene.library is None:
            stop_following(scene)


@persistent
@guarded
def show_what_renders(scene: bpy.types.Scene, *_: object) -> None:
    """Before a render. Lamps that only the viewport hides become visible."""
    if scene.library is not None or not _has_diffraction():
        return
    if bpy.app.background:
        mesa.filter_as_cards_do()
    if not is_rendering():  # With a window, a render runs in its own thread, where no data may be created.
        show_again()
        drop_stale_sources(scene)
        update_lamps(scene, exactly=False)
        _follow_settings(scene)
    show_as_rendered(scene, followed_lamps(scene))
    if bpy.app.background:  # where no panel shows the warnings
        from ..materials.material import outside_light_groups  # Blender's start does not need it

        _print(wrong_colours(scene) + unfitted_world(scene) + outside_light_groups(scene) + _outside(scene))


@persistent
@guarded
def show_what_is_saved(*_: object) -> None:
    """Before a save: make the file render correctly without this extension."""
    show_again()
    for scene in _scenes():
        follow_lamps(scene, lit=lit_boxes)
        _print(_outside(scene))


# At most this many changed data-blocks are checked; a thousand take a millisecond.
_LOOKED_AT = 256
# State of each scene's followed lamps at the last full check, by the scene's full name.
_noticed: dict[str, tuple[object, ...]] = {}
HANDLERS: dict[str, Callable[..., None]] = {
    "depsgraph_update_post": follow_change,
    "frame_change_post": follow_change,
    "load_post": follow_file,
    "blend_import_post": follow_again,
    "undo_pre": let_go,
    "undo_post": follow_undo,
    "redo_pre": let_go,
    "redo_post": follow_undo,
    "save_pre": show_what_is_saved,
    "save_post": follow_again,
    "save_post_fail": follow_again,
    "render_init": show_what_renders,
    "object_bake_pre": show_what_renders,
}


def register() -> None:
    """Add the handlers to Blender."""
    for event, function in HANDLERS.items():
        getattr(bpy.app.handlers, event).append(function)


def unregister() -> None:
    """Undo register()."""
    stop_fitting()
    if bpy.app.timers.is_registered(_follow_when_still):
        bpy.app.timers.unregister(_follow_when_still)
    for event, function in HANDLERS.items():
        getattr(bpy.app.handlers, event).remove(function)


def _follow_all(*, exactly: bool) -> None:
    forget_worlds()
    _print(renew_outdated())
    for scene in _scenes():
        _follow_world(scene)
        _update_lamps(scene, exactly=exactly)


def _update_lamps(scene: bpy.types.Scene, *, exactly: bool = False) -> None:
    update_lamps(scene, exactly=exactly, in_viewport=has_window())
    _noticed[scene.name_full] = _state(scene)


def _state(scene: bpy.types.Scene) -> tuple[object, ...]:
    """What drivers cannot follow of a scene's followed lamps: type, spectrum, light linking, visibility in each view
    layer."""
    return tuple(_state_of(lamp, scene) for lamp in (*followed_lamps(scene), *left_out_lamps(scene)))


def _state_of(lamp: bpy.types.Object, scene: bpy.types.Scene) -> tuple[object, ...]:
    linked_to = lamp.light_linking.receiver_collection
    shown = [lamp.visible_get(view_layer=layer) for layer in scene.view_layers]
    linked = linked_to and linked_to.name_full
    kind = lamp.data.type, getattr(lamp.data, "shape", ""), lamp.data.use_temperature, getattr(lamp.data, FIELD, "")
    return lamp.name_full, *kind, linked, *shown


def _follow_world(scene: bpy.types.Scene) -> None:
    """Drop the sources of a world that has changed. With a window, schedule a new fit."""
    if has_window():
        want_fit(scene)
    else:
        drop_stale_sources(scene)


def _follow_settings(scene: bpy.types.Scene) -> None:
    from .making_materials import follow_settings  # files without diffraction do not load it

    follow_settings(scene)


def _outside(scene: bpy.types.Scene) -> list[str]:
    """A warning for each object that shows light from outside its bake's region."""
    from ..gratings.bakes import has_regions

    if not has_regions():  # most files stop here
        return []
    from .finding_bakes import notice_outside

    return notice_outside(scene)


def _print(lines: list[str]) -> None:
    for line in lines:
        print(f"Natural Gratings: {line}", file=sys.stderr)


def _scenes() -> list[bpy.types.Scene]:
    """The scenes of the file that are not linked, or none if the file has no diffraction."""
    return [scene for scene in bpy.data.scenes if scene.library is None] if _has_diffraction() else []


def _has_diffraction() -> bool:
    return any(is_diffraction(group) for group in bpy.data.node_groups)

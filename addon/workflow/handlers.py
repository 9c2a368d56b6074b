# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that keep themselves up to date: Blender calls these functions after each change, and around undo, files and
renders.

Drivers follow the values of a lamp by themselves. These functions notice that lamps come and go, become another kind,
move between collections, are hidden or are linked to objects. They write only what differs from what is wanted, so that
a change that concerns no lamp makes Blender evaluate and compile nothing.

With a window, Blender calls them at each step of a lamp that is dragged. Then they look only at what the change
concerns. Once nothing has changed for a moment, a timer looks at all of it: which of too many lamps are the brightest
now, and changes that Blender does not tell of. A render and a save look at all of it, too.

What is set on a grating reaches its materials here too.

Writes after a change are in no step of Blender's undo. Undo keeps a data-block as it is, with what was written since,
where its steps say that it did not change. A pointer in it to a data-block that undo removes would then lead nowhere.
So the properties are given up before an undo and made again after it, and Diffraction groups are only ever given nodes
that point to what they pointed to before.
"""

import sys
from collections.abc import Callable
from itertools import islice

import bpy
from bpy.app.handlers import persistent

from ..blender.changes import STILL, note_change, seconds_until_still
from ..blender.guard import guarded
from ..blender.rendering import is_rendering
from ..blender.window import has_window
from ..lamps.follow import follow_lamps, followed_lamps, stop_following
from ..lamps.rendered_lamps import show_as_rendered
from ..materials.data_pictures import wrong_colours
from ..materials.group_properties import is_diffraction
from ..materials.skin import renew_outdated
from .fitting_worlds import (
    drop_stale_sources,
    forget_worlds,
    forget_worlds_of,
    stop_fitting,
    unfitted_world,
    want_fit,
    world_is_known,
)
from .following_lamps import lit_boxes, update_lamps


@persistent
@guarded
def follow_change(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """After Blender has evaluated a scene anew. Whatever concerns its followed lamps changes the scene too."""
    note_change()
    if depsgraph.mode == "RENDER":
        return
    if scene.library is not None or is_rendering() or not _has_diffraction():  # most files do no more than this
        forget_worlds()
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
    # Without a timer that looks at everything, another strength may have another lamp be among the brightest.
    brightest_may_be_others = not has_window() and depsgraph.id_type_updated("LIGHT")
    if came_or_went or brightest_may_be_others or _noticed.get(scene.name_full) != _state(scene):
        _update_lamps(scene)


@guarded
def _follow_when_still() -> float | None:
    """Once nothing has changed for a moment, look at everything. The seconds to wait if it is not yet so, or None."""
    wait = STILL if is_rendering() else seconds_until_still()
    if wait == 0:
        _follow_all(exactly=False)
    return wait or None


@persistent
@guarded
def follow_file(*_: object) -> None:
    """After a file was opened: nothing is compiled yet, so groups get no more lamps than there are."""
    _follow_all(exactly=True)


@persistent
@guarded
def follow_again(*_: object) -> None:
    """After an undo, a redo, an import or a save."""
    _follow_all(exactly=False)


@persistent
@guarded
def let_go(*_: object) -> None:
    """Before an undo or a redo."""
    for scene in _scenes():
        stop_following(scene)


@persistent
@guarded
def show_what_renders(scene: bpy.types.Scene, *_: object) -> None:
    """Before a render. What only the viewport hides is shown."""
    if scene.library is not None or not _has_diffraction():
        return
    if not is_rendering():  # A render beside the interface runs in its own thread, where nothing may be made.
        drop_stale_sources(scene)
        update_lamps(scene, exactly=False)
        _follow_settings(scene)
    show_as_rendered(scene, followed_lamps(scene))
    if bpy.app.background:  # where no panel tells it
        _print(wrong_colours(scene) + unfitted_world(scene) + _outside(scene))


@persistent
@guarded
def show_what_is_saved(*_: object) -> None:
    """Before a file is saved: it renders as it should without this extension."""
    for scene in _scenes():
        follow_lamps(scene, lit=lit_boxes)
        _print(_outside(scene))


# So many of the data-blocks that changed at once are looked at: a thousand take a millisecond.
_LOOKED_AT = 256
# The state of each scene's followed lamps when all of it was last looked at, by the scenes' full names.
_noticed: dict[str, tuple[object, ...]] = {}
HANDLERS: dict[str, Callable[..., None]] = {
    "depsgraph_update_post": follow_change,
    "frame_change_post": follow_change,
    "load_post": follow_file,
    "blend_import_post": follow_again,
    "undo_pre": let_go,
    "undo_post": follow_again,
    "redo_pre": let_go,
    "redo_post": follow_again,
    "save_pre": show_what_is_saved,
    "save_post": follow_again,
    "save_post_fail": follow_again,
    "render_init": show_what_renders,
    "object_bake_pre": show_what_renders,
}


def register() -> None:
    """Have Blender call the functions."""
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
    """What drivers cannot follow of the lamps that a scene follows: their kinds, the objects that they are linked to,
    and which view layers show them."""
    return tuple(_state_of(lamp, scene) for lamp in followed_lamps(scene))


def _state_of(lamp: bpy.types.Object, scene: bpy.types.Scene) -> tuple[object, ...]:
    linked_to = lamp.light_linking.receiver_collection
    shown = [lamp.visible_get(view_layer=layer) for layer in scene.view_layers]
    return lamp.name_full, lamp.data.type, getattr(lamp.data, "shape", ""), linked_to and linked_to.name_full, *shown


def _follow_world(scene: bpy.types.Scene) -> None:
    """Sources of a world that has changed are given up; with a window, they are fitted anew."""
    if has_window():
        want_fit(scene)
    else:
        drop_stale_sources(scene)


def _follow_settings(scene: bpy.types.Scene) -> None:
    from .following_settings import follow_settings  # files without diffraction do not load it

    follow_settings(scene)


def _outside(scene: bpy.types.Scene) -> list[str]:
    """A line for each object that shows light from outside of its bake's region."""
    from ..gratings.baked_region import has_regions

    if not has_regions():  # most files load no more than this
        return []
    from .noticing_outside import notice_outside

    return notice_outside(scene)


def _print(lines: list[str]) -> None:
    for line in lines:
        print(f"Natural Gratings: {line}", file=sys.stderr)


def _scenes() -> list[bpy.types.Scene]:
    """The scenes that can be changed, where the file has diffraction."""
    return [scene for scene in bpy.data.scenes if scene.library is None] if _has_diffraction() else []


def _has_diffraction() -> bool:
    return any(is_diffraction(group) for group in bpy.data.node_groups)

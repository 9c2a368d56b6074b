# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that keep themselves up to date: Blender calls these functions after each change, and around undo, files and
renders.

Drivers follow the values of a lamp by themselves. These functions notice that lamps come and go, become another kind,
move between collections, are hidden or are linked to objects. They write only what differs from what is wanted, so that
a change that concerns no lamp makes Blender evaluate and compile nothing.

What is set on a grating reaches its materials here too.

Writes after a change are in no step of Blender's undo. Undo keeps a data-block as it is, with what was written since,
where its steps say that it did not change. A pointer in it to a data-block that undo removes would then lead nowhere.
So the properties are given up before an undo and made again after it, and Diffraction groups are only ever given nodes
that point to what they pointed to before.
"""

import sys
from collections.abc import Callable

import bpy
from bpy.app.handlers import persistent

from ..lamps.follow import follow_lamps, followed_lamps, stop_following, update_shown
from ..lamps.shown import show_as_rendered
from ..materials.data_pictures import wrong_colours
from ..materials.skin import is_diffraction, renew_outdated
from ..scene.guard import guarded
from ..scene.rendering import is_rendering
from .fit_world import drop_stale_sources, note_change, stop_fitting, unfitted_world, want_fit
from .lamps import lit_boxes, update_lamps


@persistent
@guarded
def follow_change(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """After Blender has evaluated a scene anew. Whatever concerns its lamps changes the scene too."""
    note_change()
    if depsgraph.mode == "RENDER" or not (depsgraph.id_type_updated("SCENE") or depsgraph.id_type_updated("WORLD")):
        return
    if scene.library is not None or is_rendering() or not _has_diffraction():
        return
    _follow_world(scene)
    _follow_settings(scene)
    if depsgraph.id_type_updated("COLLECTION") or depsgraph.id_type_updated("LIGHT"):
        update_lamps(scene, exactly=False, in_viewport=_has_viewport())
    elif _has_viewport():
        update_shown(scene, followed_lamps(scene), in_viewport=True)


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
    for event, function in HANDLERS.items():
        getattr(bpy.app.handlers, event).remove(function)


def _follow_all(*, exactly: bool) -> None:
    note_change()
    _print(renew_outdated())
    for scene in _scenes():
        _follow_world(scene)
        update_lamps(scene, exactly=exactly, in_viewport=_has_viewport())


def _follow_world(scene: bpy.types.Scene) -> None:
    """Sources of a world that has changed are given up; with a window, they are fitted anew."""
    if _has_viewport():
        want_fit(scene)
    else:
        drop_stale_sources(scene)


def _follow_settings(scene: bpy.types.Scene) -> None:
    from .settings import follow_settings  # files without diffraction do not load it

    follow_settings(scene)


def _outside(scene: bpy.types.Scene) -> list[str]:
    """A line for each object that shows light from outside of its bake's region."""
    from ..scene.region import has_regions

    if not has_regions():  # most files load no more than this
        return []
    from .outside import notice_outside

    return notice_outside(scene)


def _print(lines: list[str]) -> None:
    for line in lines:
        print(f"Natural Gratings: {line}", file=sys.stderr)


def _scenes() -> list[bpy.types.Scene]:
    """The scenes that can be changed, where the file has diffraction."""
    return [scene for scene in bpy.data.scenes if scene.library is None] if _has_diffraction() else []


def _has_diffraction() -> bool:
    return any(is_diffraction(group) for group in bpy.data.node_groups)


def _has_viewport() -> bool:
    return not bpy.app.background

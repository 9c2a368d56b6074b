# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitting light sources to a scene's world, in a second Blender process.

Outdated sources would put light in the wrong place. So the sources are dropped as soon as the world changes, and the
materials sample all its light at random, which is correct but noisier. With a window, a new fit begins when the world
has not changed for a moment. In background, `assign` and the operator wait for the fit.

The sources of one frame are wrong in another. So an animated world has no sources, unless they are fitted for each
frame (fitting_frames.py)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import bpy

from ....precompute.base.failure import GratingError
from ...blender import compat
from ...blender.guard import guarded
from ...blender.working_space import working_space
from ...lamps.sky import (
    SOURCES_MAX,
    fitted_frames,
    fitted_world,
    forget_sources,
    hold_sources,
    is_fitted_frame,
    notes_frames,
)
from ...materials.skin import follows_world, show_lamps

if TYPE_CHECKING:
    from ...worlds.world_probe import Fit, Probe

# Seconds: how long a world must be unchanged before it is fitted, and how often a running fit is polled.
_STILL, _POLL = 0.6, 0.2


@dataclass
class _Running:
    """A fit that is wanted or running."""

    scene: str
    fingerprint: str
    probe: Probe | None = None


_running: _Running | None = None
# Why the last fit of a scene's world failed, by the scene's full name.
_failed: dict[str, GratingError] = {}


class _Known(NamedTuple):
    """Cached facts about a scene's world: its address (0 for none), the file's working space at that time, the
    fingerprint (empty if there is nothing to fit), and the addresses of the data-blocks that these depend on."""

    world: int
    space: str
    fingerprint: str
    blocks: frozenset[int]


# Facts about scenes' worlds since their last change, by the scenes' full names.
_known: dict[str, _Known] = {}


def forget_worlds() -> None:
    """Discard all cached facts about worlds."""
    _known.clear()


def forget_worlds_of(changed: set[bpy.types.ID]) -> None:
    """Discard the facts about worlds that depend on one of these data-blocks."""
    addresses = set(map(_address, changed))
    for name in [name for name, known in _known.items() if known.blocks & addresses]:
        del _known[name]


def world_is_known(scene: bpy.types.Scene) -> bool:
    """Whether the facts about the scene's world are up to date, as far as Blender reports changes."""
    known = _known.get(scene.name_full)
    return known is not None and (known.world, known.space) == (_address(scene.world), working_space())


def world_is_fitted(scene: bpy.types.Scene) -> bool:
    """Whether the scene's sources fit its world as of the last change that Blender reported. A uniform or animated
    world has no sources, and counts as fitted without them."""
    return fitted_world(scene) == _known_world(scene).fingerprint


def drop_stale_sources(scene: bpy.types.Scene) -> str:
    """Drop the sources of a world that has changed. Returns the world's fingerprint if a fit is wanted, else ""."""
    now = _fingerprint(scene)
    if _frames_fit(scene) if notes_frames(scene) else fitted_world(scene) == now:
        return ""
    forget_sources(scene)
    return now if follows_world() else ""


def forget_unread_sources() -> None:
    """Drop the sources of all scenes if nothing in the file reads them any more, and stop a fit for them."""
    if follows_world():
        return
    stop_fitting()
    for scene in bpy.data.scenes:
        if scene.library is None:
            forget_sources(scene)


def _frames_fit(scene: bpy.types.Scene) -> bool:
    """Whether the scene's world is animated as when its frames were fitted, as far as the present frame shows."""
    from ...worlds.world_changes import fingerprint

    if not (fitted_frames(scene) and world_is_animated(scene)):
        return False
    return is_fitted_frame(scene, fingerprint(scene.world))


def unfitted_world(scene: bpy.types.Scene) -> list[str]:
    """A warning if the scene's world has no sources because it is animated or not fitted."""
    if not follows_world():
        return []
    if world_is_animated(scene):
        frames = fitted_frames(scene)
        if scene.frame_current in frames:
            return []
        if frames:
            span = f"{min(frames)} to {max(frames)}"
            return [f"world {scene.world.name}: not fitted in this frame (only {span}), so its bright parts are noisy"]
        return [f"world {scene.world.name}: it is animated, so its bright parts are noisy; press Fit Frames"]
    if world_is_fitted(scene):
        return []
    name = scene.world.name
    return [f"world {name}: its bright parts are noisy, because they are not fitted; press Fit World, or assign"]


def world_is_animated(scene: bpy.types.Scene) -> bool:
    """Whether the scene's world has bright parts that may change from frame to frame."""
    from ...worlds.second_blender import is_even
    from ...worlds.world_changes import is_animated

    return scene.world is not None and not is_even(scene.world) and is_animated(scene.world)


def last_failure(scene: bpy.types.Scene) -> GratingError | None:
    """Why the last fit of the scene's world failed; None if it did not."""
    return _failed.get(scene.name_full)


def fit_world(scene: bpy.types.Scene, *, anew: bool = False) -> None:
    """Fit sources to the scene's world and wait for them. With `anew`, also if they seem to fit. Raises GratingError as
    world_probe.fit_of does."""
    from ...worlds.world_probe import fit_of

    if anew:
        forget_sources(scene)
    if now := drop_stale_sources(scene):
        _take(scene, fit_of(scene.world, scene, SOURCES_MAX), now)


def want_fit(scene: bpy.types.Scene, *, anew: bool = False) -> None:
    """Drop outdated sources, with `anew` also others, and schedule a fit for when the world is unchanged for a moment.
    In background, fit and wait."""
    global _running
    if anew:
        forget_sources(scene)
    if bpy.app.background:
        fit_world(scene)
    elif (now := drop_stale_sources(scene)) and not _is_fitting(scene, now):
        stop_fitting()
        _failed.pop(scene.name_full, None)
        _running = _Running(scene.name, now)
        bpy.app.timers.register(_go_on, first_interval=_STILL)


def is_fitting() -> bool:
    """Whether a fit is wanted or running."""
    return _running is not None


def _is_fitting(scene: bpy.types.Scene, fingerprint: str) -> bool:
    """Whether a fit of the scene's present world is wanted or running."""
    return _running is not None and (_running.scene, _running.fingerprint) == (scene.name, fingerprint)


def stop_fitting() -> None:
    """Cancel the fit that is wanted or running, if any."""
    global _running
    running, _running = _running, None
    if running is not None and running.probe is not None:
        running.probe.cancel()
    if bpy.app.timers.is_registered(_go_on):
        bpy.app.timers.unregister(_go_on)


@guarded
def _go_on() -> float | None:
    """Advance the fit. Returns the seconds until the next call, or None at the end."""
    from ...worlds.world_probe import Probe

    global _running
    running = _running
    scene = bpy.data.scenes.get(running.scene) if running is not None else None
    if scene is None or _fingerprint(scene) != running.fingerprint:
        _running = None
        if running is not None and running.probe is not None:
            running.probe.cancel()
        if scene is not None:
            want_fit(scene)
        return None
    try:
        if running.probe is None:
            running.probe = Probe(scene.world, scene, SOURCES_MAX)
        if running.probe.running:
            return _POLL
        _running = None
        _take(scene, running.probe.result(), running.fingerprint)
    except GratingError as error:  # no caller waits for the fit; the panel shows this
        _running = None
        _failed[scene.name_full] = error
        print(f"Natural Gratings: {error}")
    _fit_another()
    return None


def _fit_another() -> None:
    """Start the fit of another scene's world, if one needs it."""
    for scene in bpy.data.scenes:
        if _running is None and scene.library is None and not last_failure(scene):
            want_fit(scene)


def _take(scene: bpy.types.Scene, fit: Fit, fingerprint: str) -> None:
    _failed.pop(scene.name_full, None)
    from ....precompute.world_sources.sources import light_of_rest

    rest = light_of_rest(fit.panorama, fit.sources[:SOURCES_MAX]).tolist()
    hold_sources(scene, fit.sources, fingerprint=fingerprint, missed=fit.missed, rest=rest)
    show_lamps(exactly=False)


def _fingerprint(scene: bpy.types.Scene) -> str:
    """The fingerprint of the scene's present world; empty if there is nothing to fit."""
    return _found_world(scene).fingerprint


def _known_world(scene: bpy.types.Scene) -> _Known:
    """The cached facts about the scene's world, found anew if outdated."""
    return _known[scene.name_full] if world_is_known(scene) else _found_world(scene)


def _found_world(scene: bpy.types.Scene) -> _Known:
    """Find the facts about the scene's world, and cache them."""
    from ...worlds.second_blender import is_even
    from ...worlds.world_changes import fingerprint, is_animated

    world, text = scene.world, ""
    followed: set[bpy.types.ID] = set()
    read: set[bpy.types.ID] = (
        set() if world is None else {each for each in (world, compat.world_nodes(world)) if each is not None}
    )
    if not (world is None or is_even(world) or is_animated(world, followed)):
        read = set()
        text = fingerprint(world, read)
    blocks = frozenset(map(_address, followed | read))
    found = _Known(_address(world), working_space(), text, blocks)
    _known[scene.name_full] = found
    return found


def _address(block: bpy.types.ID | None) -> int:
    return 0 if block is None else block.as_pointer()

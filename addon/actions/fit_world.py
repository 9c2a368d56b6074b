# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitting the sources of a scene's world, by a second Blender beside this one.

A fit that is stale would count light at the wrong place. So the sources of a world that has changed are given up at
once, and all its light is then taken by the closures, which is right and noisier. With a window, a new fit begins when
the world has been still for a moment; in background, `assign` and the operator wait for it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy

from ...precompute.base.failure import GratingError
from ..lamps.sky import SOURCES_MAX, fitted_world, forget_sources, hold_sources
from ..materials.skin import follows_world, show_lamps

if TYPE_CHECKING:
    from ..worlds.probe import Fit, Probe

# In seconds: how long a world must be still before it is fitted, and how often the fit is asked whether it has ended.
_STILL, _POLL = 0.6, 0.2


@dataclass
class _Running:
    """A fit beside the interface."""

    scene: str
    fingerprint: str
    probe: Probe | None = None


_running: _Running | None = None


def world_is_fitted(scene: bpy.types.Scene) -> bool:
    """Whether the scene's sources are those of its world as it is now. A world of one colour needs none."""
    return fitted_world(scene) == _fingerprint(scene)


def drop_stale_sources(scene: bpy.types.Scene) -> bool:
    """Give up the sources of a world that has changed; whether a fit is wanted."""
    if world_is_fitted(scene):
        return False
    forget_sources(scene)
    return bool(_fingerprint(scene)) and follows_world()


def unfitted_world(scene: bpy.types.Scene) -> list[str]:
    """A line if the scene's world has no sources because it was not fitted as it is now."""
    if not follows_world() or world_is_fitted(scene):
        return []
    name = scene.world.name
    return [f"world {name}: its bright parts are not fitted, so that they light with noise; press Fit World, or assign"]


def fit_world(scene: bpy.types.Scene) -> None:
    """Fit the sources of the scene's world and wait for them. Raises GratingError as Probe does."""
    from ..worlds.probe import fit_of

    if drop_stale_sources(scene):
        now = _fingerprint(scene)
        _take(scene, fit_of(scene.world, scene, SOURCES_MAX), now)


def want_fit(scene: bpy.types.Scene) -> None:
    """Give up stale sources, and have the world fitted when it has been still for a moment. Without a window, wait."""
    global _running
    if bpy.app.background:
        fit_world(scene)
    elif drop_stale_sources(scene):
        stop_fitting()
        _running = _Running(scene.name, _fingerprint(scene))
        bpy.app.timers.register(_go_on, first_interval=_STILL)


def is_fitting() -> bool:
    """Whether a fit is wanted or running."""
    return _running is not None


def stop_fitting() -> None:
    """Cancel the running fit, if there is one."""
    global _running
    running, _running = _running, None
    if running is not None and running.probe is not None:
        running.probe.cancel()
    if bpy.app.timers.is_registered(_go_on):
        bpy.app.timers.unregister(_go_on)


def _go_on() -> float | None:
    """A step of the running fit; the seconds until the next, or None at its end."""
    from ..worlds.probe import Probe

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
    except GratingError as error:  # nobody waits for it; the panel says that the world is not fitted
        _running = None
        print(f"Natural Gratings: {error}")
    return None


def _take(scene: bpy.types.Scene, fit: Fit, fingerprint: str) -> None:
    hold_sources(scene, fit.sources, fingerprint=fingerprint, missed=fit.missed)
    show_lamps(exactly=False)


def _fingerprint(scene: bpy.types.Scene) -> str:
    """Of the scene's world; empty where there is nothing to fit."""
    from ..worlds.fingerprint import fingerprint
    from ..worlds.stand_alone import is_even

    world = scene.world
    return "" if world is None or is_even(world) else fingerprint(world)

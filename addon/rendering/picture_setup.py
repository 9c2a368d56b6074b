# SPDX-License-Identifier: GPL-3.0-or-later
"""Sets the open scene up for a picture of a plan: frame, camera, zoom, lamps, engine."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, radians, sin
from typing import Any

import bpy
from mathutils import Matrix, Vector

from ...precompute.base.failure import GratingError
from ..blender import compat


@dataclass(frozen=True)
class Base:
    """What the open scene had before a picture changed it."""

    camera: bpy.types.Object | None
    frame: int
    lenses: Mapping[str, tuple[float, float]]
    lamps: Mapping[str, tuple[Matrix, float]]
    render: tuple[str, int, int, int]
    samples: tuple[int, int, int]
    denoise: bool

    @classmethod
    def now(cls) -> "Base":
        """The state of the open scene."""
        scene, render = bpy.context.scene, bpy.context.scene.render
        return cls(
            scene.camera,
            scene.frame_current,
            {one.name: (one.lens, one.ortho_scale) for one in bpy.data.cameras},
            {one.name: (one.matrix_world.copy(), one.data.energy) for one in scene.objects if one.type == "LIGHT"},
            (render.engine, render.resolution_x, render.resolution_y, render.resolution_percentage),
            (scene.cycles.samples, scene.eevee.taa_render_samples, scene.cycles.seed),
            scene.cycles.use_denoising,
        )


def set_up(picture: Mapping[str, Any], base: Base) -> None:
    """Set the open scene to a picture. Raises GratingError if the scene lacks a camera, a lamp or an object of it."""
    scene, render = bpy.context.scene, bpy.context.scene.render
    for name, (lens, scale) in base.lenses.items():
        bpy.data.cameras[name].lens, bpy.data.cameras[name].ortho_scale = lens, scale
    scene.frame_set(base.frame if picture["frame"] is None else picture["frame"])
    # After the frame, because a marker in the timeline may choose the camera.
    if picture["camera"] is not None:
        scene.camera = _object(picture["camera"], "CAMERA")
    elif base.camera is not None and not any(marker.camera for marker in scene.timeline_markers):
        scene.camera = base.camera
    if scene.camera is None:
        raise GratingError(f"scene {scene.name}", "no camera", "add one, or name it under `cameras`")
    if picture["zoom"] is not None and scene.camera.type == "CAMERA":
        _refuse_moved(scene.camera.data, "its lens")
        scene.camera.data.lens *= picture["zoom"]
        scene.camera.data.ortho_scale /= picture["zoom"]
    for state in picture["lamps"]:
        _set_lamp(state, base)
    engine, width, height, percentage = base.render
    render.engine = _engine(picture["engine"]) if picture["engine"] else engine
    render.resolution_x, render.resolution_y = picture["width"] or width, picture["height"] or height
    render.resolution_percentage = 100 if picture["width"] or picture["height"] else percentage
    cycles, eevee, seed = base.samples
    scene.cycles.samples = picture["samples"] or cycles
    scene.eevee.taa_render_samples = picture["samples"] or eevee
    scene.cycles.use_denoising = base.denoise if picture["denoise"] is None else picture["denoise"]
    scene.cycles.seed = seed if picture["seed"] is None else picture["seed"]
    bpy.context.view_layer.update()


def _engine(name: str) -> str:
    return "CYCLES" if name == "cycles" else compat.eevee_engine()


def _object(name: str, kind: str | None = None) -> bpy.types.Object:
    """An object of the open scene. Raises GratingError if there is none of this name, or it is of another kind."""
    found = bpy.context.scene.objects.get(name)
    if found is None or (kind is not None and found.type != kind):
        there = ", ".join(one.name for one in bpy.context.scene.objects if kind in (None, one.type)) or "none"
        noun = {"CAMERA": "camera", "LIGHT": "lamp"}.get(kind or "", "object")
        raise GratingError(name, f"no such {noun} in the scene", f"there are {there}")
    return found


def _set_lamp(state: Mapping[str, Any], base: Base) -> None:
    """Turn a lamp, or move it round an object at its distance, and set its strength. Raises GratingError as _object
    does."""
    lamp = _object(state["lamp"], "LIGHT")
    matrix, energy = base.lamps[lamp.name]
    _refuse_moved(lamp, "it")
    _refuse_moved(lamp.data, "its strength")
    lamp.data.energy = energy * (1.0 if state["strength"] is None else state["strength"])
    if state["azimuth_deg"] is None:
        lamp.matrix_world = matrix
        return
    azimuth, elevation = radians(state["azimuth_deg"]), radians(state["elevation_deg"])
    towards = Vector((cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation)))
    place, _, scale = matrix.decompose()
    if state["around"] is not None:
        centre = _middle(_object(state["around"]))
        place = centre + (place - centre).length * towards
    elif lamp.data.type != "SUN":
        raise GratingError(lamp.name, "`around` is missing", "name the object that this lamp goes round")
    # A lamp shines along its -Z axis.
    lamp.matrix_world = Matrix.LocRotScale(place, towards.to_track_quat("Z", "Y"), scale)


def _refuse_moved(block: bpy.types.Object | bpy.types.Camera | bpy.types.Light, what: str) -> None:
    """Raise GratingError if keyframes, drivers or constraints move what a picture would set."""
    held = block.animation_data
    if getattr(block, "constraints", None) or (held is not None and (held.action or held.drivers or held.nla_tracks)):
        fault = f"{what} is animated or constrained"
        raise GratingError(block.name, fault, "remove that, or leave it out of the job")


def _middle(thing: bpy.types.Object) -> Vector:
    """The middle of an object's bounding box in the world."""
    corners = [Vector(corner) for corner in thing.bound_box]
    return thing.matrix_world @ (sum(corners, Vector()) / len(corners))

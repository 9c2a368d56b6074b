# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the scenes of a render job: .blend files that hold their bakes, so that a worker renders them without the
extension, each beside the plan of its pictures."""

import json
import sys
import tomllib
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import bpy

from ...precompute.bake.needs import EVERYTHING, Needs, needs_of
from ...precompute.base.failure import GratingError, printable
from ...precompute.base.files import told_of
from ...precompute.base.progress import Progress
from ...precompute.base.strict import read_json
from ...precompute.render_job.job_file import Job, Surface, as_record
from ...precompute.render_job.pictures import pictures_of
from ...precompute.render_job.plan import NEEDS, SCENES, Picture, hash_of, plan_of, recipe_of_plan, write_record
from ..blender.written import save_copy
from ..gratings.grating import Grating, active_grating
from ..materials.skin import SETTABLE
from ..rendering import worker
from ..rendering.picture_setup import Base, set_up
from ..workflow.assigning import add_to_meshes, assign_to_meshes
from ..workflow.baking import bake_and_wait, measure_needs
from ..workflow.importing import add_averaged
from ..workflow.making_materials import refresh_group
from ..workflow.presets import add_preset, show_preset
from .shared_options import chosen_objects, set_inputs, setting

_MANIFEST = Path(__file__).resolve().parents[2] / "blender_manifest.toml"


def extension_version() -> str:
    """The extension's version, from its manifest."""
    return str(tomllib.loads(_MANIFEST.read_text(encoding="utf-8"))["version"])


def plan_path(job: Job, name: str) -> Path:
    """The path of the plan of one of a job's scenes."""
    return job.output / SCENES / f"{name}.json"


def make_scene(job: Job, name: str, progress: Progress) -> Path:
    """Make one of a job's scenes and its plan, unless they are there and what they depend on is the same. Returns the
    plan's path. Raises GratingError if the scene cannot be made, or if a picture asks for what it lacks."""
    path = plan_path(job, name)
    surface = next((each for each in job.surfaces if each.name == name), None)
    pictures = pictures_of(job, name)
    recipe = hash_of(_recipe(job, surface, pictures))
    if recipe_of_plan(path) != recipe:
        with told_of(path):
            path.parent.mkdir(parents=True, exist_ok=True)
        needs = needs_of_scene(job, name, progress) if job.needs else EVERYTHING
        _open(job, surface)
        if surface is not None:
            _put(job, surface, needs, progress)
        path.unlink(missing_ok=True)  # a plan beside another scene would be believed
        save_copy(path.with_name(f"{name}.blend"), relative_remap=True, compress=True)
        _check(pictures)  # last, because it changes the open scene
    request = None if surface is None else surface.request.as_dict()
    made_by = {"natural_gratings": extension_version(), "request": request}
    write_record(path, plan_of(f"{name}.blend", recipe, pictures, made_by=made_by))
    return path


def needs_of_scene(job: Job, name: str, progress: Progress) -> Needs:
    """What the pictures of one of a job's scenes need of its bake. They are measured and written into the folder
    `needs`, unless they are there and what they depend on is the same. Raises GratingError as make_scene."""
    surface = next(each for each in job.surfaces if each.name == name)
    path, pictures = job.output / NEEDS / f"{name}.json", pictures_of(job, name)
    recipe = hash_of(_recipe(job, surface, pictures))
    needs = _needs_kept(path, recipe)
    if needs is None:
        _open(job, surface)
        needs = _needs_of_pictures(pictures, _put(job, surface, EVERYTHING, progress), progress)
        with told_of(path):
            path.parent.mkdir(parents=True, exist_ok=True)
        write_record(path, {"recipe": recipe, "needs": needs.as_dict()})
    return needs


def _needs_kept(path: Path, recipe: str) -> Needs | None:
    """The needs of an earlier run under the same recipe, or None."""
    try:
        record = read_json(path, "run the job again")
        return needs_of(record["needs"], str(path)) if record["recipe"] == recipe else None
    except (GratingError, KeyError, TypeError):
        return None


def _recipe(job: Job, surface: Surface | None, pictures: Sequence[Picture]) -> list[Any]:
    """Everything that a scene depends on. Linked libraries and textures outside the file are not in it."""
    files = [] if job.scene is None else [job.scene]
    record: Any = None
    if surface is not None:
        record = json.loads(json.dumps(as_record(surface), default=list))
        files += surface.files
    views = [asdict(replace(picture, name="")) for picture in pictures] if job.needs else []
    return [extension_version(), record, [_sha256(path) for path in files], views]


def _sha256(path: Path) -> str:
    try:
        return worker.sha256_of(path)
    except OSError as error:
        fault = f"cannot be read ({error.strerror or error})"
        raise GratingError(path, fault, "correct its path in the job") from error


def _open(job: Job, surface: Surface | None) -> None:
    """Open the job's scene, or make the one in which Show Me shows the surface's preset."""
    if job.scene is not None:
        worker.open_scene(job.scene)
        return
    if surface is None or surface.preset is None:
        raise GratingError(job.path, "it names neither a scene nor a preset", 'add scene = "FILE.blend"')
    if surface.objects:
        remedy = "leave it out, or add a scene"
        raise GratingError(job.path, f"{surface.name}: objects: Show Me puts a preset on its own thing", remedy)
    bpy.ops.wm.read_homefile(use_empty=True)
    others = list(bpy.data.scenes)
    shown = show_preset(surface.preset)
    for scene in others:
        bpy.data.scenes.remove(scene)
    bpy.context.window.scene = shown


def _put(job: Job, surface: Surface, needs: Needs, progress: Progress) -> Grating:
    """Bake a surface for some needs and put it on its meshes. Returns its grating."""
    scene = bpy.context.scene
    if job.scene is None:
        grating = active_grating(scene)
    elif surface.preset is not None:
        grating = add_preset(scene, surface.preset)
    else:
        grating = add_averaged(scene, [asdict(scan) for scan in surface.request.scans])
    grating.take_request(replace(surface.request, needs=needs))
    if surface.lights is not None:
        grating.lights = surface.lights.upper()
    bake_and_wait(grating, progress=progress)
    refresh_group(grating)
    if job.scene is not None:
        chosen = chosen_objects(list(surface.objects))
        for line in (add_to_meshes if surface.over else assign_to_meshes)(scene, chosen):
            print(printable(line), file=sys.stderr)
    values = dict(setting(f"{name}={value}", SETTABLE) for name, value in surface.inputs)
    carriers = [thing for thing in scene.objects if thing.type == "MESH"]
    set_inputs(carriers, grating.group, values)
    return grating


def _needs_of_pictures(pictures: Sequence[Picture], grating: Grating, progress: Progress) -> Needs:
    """What all pictures need of a grating's bake."""
    base = Base.now()
    records = {json.dumps(asdict(replace(one, name="", engine=None, seed=None))): one for one in pictures}
    views = [partial(set_up, asdict(picture), base) for picture in records.values()]
    views[0]()
    return measure_needs(bpy.context.scene, grating, views=views, progress=progress).needs


def _check(pictures: Sequence[Picture]) -> None:
    """Set the scene up for each distinct view once, so that a lamp or camera that is missing is told before anything is
    rendered. Raises GratingError."""
    base = Base.now()
    seen = {(one.camera, one.zoom, one.lamps): one for one in pictures}
    for picture in seen.values():
        set_up(asdict(picture), base)

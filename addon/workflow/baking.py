# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking a grating in a separate process and recording the bake: as its settings say, for the lamps of a scene, or only
the part that a scene's cameras need. A preset's grating may take the draft that the extension ships."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import bpy

from ...precompute.bake.needs import EVERYTHING, Needs
from ...precompute.bake.plan import expected_table_bytes
from ...precompute.bake.request import BakeRequest, request_from
from ...precompute.bake.shown_directions import MARGIN, SHARE, held_share, joined, needs_of
from ...precompute.base.failure import GratingError
from ...precompute.base.files import told_of, write_together
from ...precompute.base.progress import Progress, silent
from ...precompute.colour.channels import light_for
from ...precompute.colour.spaces import lamp_line
from ...precompute.measure.errors import stated_errors
from ...precompute.presets.presets import Preset, draft_request, shipped_draft
from ...precompute.surface.height_map import is_synthetic
from ...precompute.surface.steps.pipeline import WARNING
from ...precompute.table.atlas import Layout, read_header
from ...precompute.table.blur_levels import BYTES_PER_TEXEL
from ..blender.guard import own_path
from ..blender.working_space import working_space
from ..cameras.camera_look import Look, answers_to_everything, frames_between, is_animated, look, moves, unknown_inputs
from ..gratings.bakes import asked, note_bake
from ..gratings.cache_folder import bakes_folder
from ..gratings.grating import Grating, request_record
from ..jobs.child import Deadline, Job
from ..lamps.follow import counted_lamps, followed_lamps
from ..lamps.lamp_spectrum import further_spectra, seen_spectrum
from ..materials.group_properties import is_diffraction
from ..materials.material import diffraction_nodes
from ..materials.response import response_in, responses_in
from .finding_bakes import bake_of
from .making_materials import refresh_group

# Time limit in hours for each scan of a bake. On two cores, 8192 x 8192 pixels are baked and checked in 142 s.
# The largest scan that a reader accepts, 90 million pixels, takes 190 s, and twice that if the
# bake is refined. A day is 200 times as long, for deep reliefs, slow computers and waiting for other bakes.
_LONGEST_HOURS = 24
# The dE00 of the colours that a working space lacks, and their share of the light, from which on the panel tells them.
_TOLD_DELTA_E, _TOLD_SHARE = 5.0, 0.1


def start_bake(
    grating: Grating, directory: str = "", *, use_cache: bool = True, request: BakeRequest | None = None
) -> Job:
    """Start a grating's bake into a folder, by default beside the cache's entries. There each request has its own
    folder, so a bake never overwrites another grating's bake or an earlier one that undo may return to. By default the
    request is the grating's own. Raises GratingError if the bake's settings are not possible."""
    request = request or grating.bake_request()
    for scan in request.scans:
        if not is_synthetic(scan.source):
            own_path(scan.source)  # before the bake looks for it in a folder of its own
    folder = own_path(directory) if directory else bakes_folder(asked(request))
    options = () if use_cache else ("--no-cache",)
    record = json.dumps(request_record(request))

    def words(private: Path) -> list[str]:
        path = private / "request.json"
        path.write_text(record, encoding="utf-8")
        return [*options, "--request", str(path)]

    return Job("bake", words, folder, deadline=deadline_of([scan.source for scan in request.scans], "baked"))


def deadline_of(sources: Sequence[str], done: str) -> Deadline:
    """The deadline of work on the scans in some files. `done` is the participle for its message: "baked"."""
    hours = _LONGEST_HOURS * max(1, len(sources))
    named = ", ".join(dict.fromkeys(Path(source).name for source in sources))
    remedy = "copy the scan to a disk of this computer, or crop it"
    return Deadline(3600.0 * hours, GratingError(named, f"not {done} within {hours} h", remedy))


def finished_bake(
    grating: Grating, directory: str = "", *, use_cache: bool = True, request: BakeRequest | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:  # fmt: skip
    """Start a grating's bake, wait for it, and return the facts of the run. Raises GratingError if it fails."""
    job = start_bake(grating, directory, use_cache=use_cache, request=request)
    job.wait(progress)
    return job.result()


def bake_and_wait(
    grating: Grating, directory: str = "", *, use_cache: bool = True, request: BakeRequest | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:  # fmt: skip
    """Bake a grating, record the bake and, if given, its request. Returns the facts. Raises GratingError if it
    fails."""
    asked_for = request or grating.bake_request()
    facts = finished_bake(grating, directory, use_cache=use_cache, request=asked_for, progress=progress)
    record_bake(grating, facts, asked_for, taken_over=request is not None)
    return facts


def warnings_of(facts: dict[str, Any]) -> list[str]:
    """The warnings of the levelling steps."""
    return [line.removeprefix(WARNING) for line in facts.get("levelling", ()) if line.startswith(WARNING)]


def shown_lines(spaces: dict[str, dict[str, float]], space: str) -> list[str]:
    """What a file's working space does to a bake's colours, and the space that would show them better."""
    found = spaces.get(space)
    if found is None or found["p50"] < _TOLD_DELTA_E or found["outside"] < _TOLD_SHARE:
        return []
    lines = ["some of these colours are too pure for the screen; they are shown a little greyer"]
    better = min(spaces, key=lambda space: spaces[space]["p50"] * spaces[space]["outside"])
    if better != space and spaces[better]["p50"] < _TOLD_DELTA_E:
        lines.append(f"the working space {better} holds them better")
    return lines


def record_bake(grating: Grating, facts: dict[str, Any], request: BakeRequest, *, taken_over: bool = False) -> None:
    """Record a finished bake in its grating. All materials that show the grating switch to it. `taken_over`: the
    request was not the grating's own, and the grating adopts it."""
    if taken_over:
        if grating.source:
            grating.take_needs(request.needs)
        else:
            grating.take_request(request)
    grating.for_scene = not request.needs.everything
    summary = [
        *stated_errors(facts["delta_e"]),
        f"coherence {facts['coherence_um']:.0f} um",
        *filter(None, [lamp_line(working_space(), request.illuminant)]),
        *shown_lines(facts.get("shown", {}), working_space()),
        f"{facts['tiles']} look-ups",
        f"{facts['blender_bytes'] / 2**20:.0f} MiB",
        *(["for this scene only"] if grating.for_scene else []),
    ]
    note_bake(grating, facts["files"][0], "\n".join(summary), request=request)
    refresh_group(grating)


def light_of_scene(scene: bpy.types.Scene) -> str:
    """The canonical text of the light that serves the scene's lamps and the sources of its world: `smooth` if all are
    white, because a world's light seldom is. Raises GratingError as light_for does."""
    lamps = {seen_spectrum(lamp.data) for lamp in counted_lamps(scene)} - {""}
    known = further_spectra()
    light = light_for(lamp for lamp in lamps if ":" not in lamp or lamp in known)
    return light_for(["D5500"]) if light == light_for(()) else light


def take_draft(grating: Grating, preset: Preset) -> bool:
    """Set a grating to draft quality, and give it the preset's shipped draft. The files are copied into the cache, as
    another version of the extension may not have them. Returns whether there is a draft. Raises GratingError if the
    cache cannot be written."""
    draft = draft_request(preset.request)
    grating.take_request(draft)
    request = grating.bake_request()
    facts = shipped_draft(preset.name, draft)
    if facts is None:
        return False
    folder = bakes_folder(asked(request))
    with told_of(folder):
        folder.mkdir(parents=True, exist_ok=True)
    copies = {folder / Path(file).name: partial(shutil.copyfile, file) for file in facts["files"]}
    if not all(copy.is_file() for copy in copies):
        write_together(copies)
    record_bake(grating, facts | {"files": [str(copy) for copy in copies]}, request)
    return True


# Frames sampled from a range, not counting camera cuts; rays for one frame; minimum rays for each of several frames.
FRAMES_MAX, _RAYS, _RAYS_LEAST = 16, 12000, 2000
_MEASURING = "measuring the scene"


# Smallest saving, as a share of the whole bake's memory, that is worth a bake for the scene and the loss of all other
# directions. A bake for the scene tests its resolution at other places than the whole bake did, so it may be larger
# than estimated: by 2 % (samples CD and Elaphe), 1 % (Xenopeltis) and 7 % (Blazed) for regions that hold 0.9 to 0.99 of
# all (u, v).
SAVING_MIN = 0.1


@dataclass(frozen=True)
class Measured:
    """The needs of a scene, the facts about their measurement for a needs file, and lines to report. `why_pointless`
    says why a bake for this scene would gain nothing; empty if it would."""

    needs: Needs
    facts: dict[str, Any]
    lines: list[str]
    why_pointless: str = ""

    def as_dict(self) -> dict[str, Any]:
        """The contents of a needs file."""
        return self.needs.as_dict() | {"measured": self.facts}


def measure_needs(
    scene: bpy.types.Scene,
    grating: Grating,
    frames: tuple[int, int] | None = None,
    *,
    views: Sequence[Callable[[], object]] = (),
    progress: Progress = silent,
) -> Measured:
    """Measure what a scene needs of a grating, over a range of frames. The default is the scene's own range if the
    camera, a lamp, or a mesh or material with the grating may change, else the present frame. Afterwards the scene is
    at its present frame again. Or measure it in several views: each sets the scene up, its frame too.

    Raises GratingError if there is no camera, or if the camera sees nothing of the grating that is lit."""
    if scene.camera is None or scene.camera.type != "CAMERA":
        raise GratingError(f"scene {scene.name}", "no camera", "add one and make it the scene's camera")
    carriers = list(_carriers(scene, grating))
    if not carriers:
        raise GratingError(grating.name, "no mesh of the scene shows it", "press Assign to Selected")
    chosen = [] if views else _frames(scene, carriers, frames)
    rays = max(_RAYS_LEAST, _RAYS // len(views or chosen))
    response = response_in(grating.group)
    parts, nodes, places, cast = [], {}, 0, 0
    looks = _looks_of(views, rays, progress) if views else _looks(scene, chosen, rays, progress=progress)
    for seen in looks:
        cast += seen.count
        for each in seen.places:
            if response in responses_in(each.node.node_tree):
                places += int((each.rays < seen.count).sum())
                nodes[each.node] = each.thing
                parts.append(seen.shown(response, each))
    shown = joined(parts)
    if not places:
        raise GratingError(grating.name, "the camera sees nothing of it", f"turn the camera to {carriers[0].name}")
    if shown.is_dark:
        raise GratingError(grating.name, "no lamp lights what the camera sees of it", "add a sun, or move a lamp")
    needs, reasons = needs_of(shown), []
    for node, thing in nodes.items():
        if unknown := unknown_inputs(node):
            needs = replace(EVERYTHING, light_radius=needs.light_radius)
            reasons.append(f"{thing.name}: nodes set its {', '.join(unknown)}, so every direction is kept")
    facts = {
        "grating": grating.name, "light_share": round(held_share(shown, needs), 6), "asked_light_share": SHARE,
        "margin": MARGIN, "frames": chosen, "rays": cast, "places": places,
        "lights": "everywhere" if any(answers_to_everything(node.node_tree) for node in nodes) else "lamps",
        "objects": sorted({thing.name for thing in nodes.values()}),
    }  # fmt: skip
    lines = [_told(grating, needs, facts), *reasons, *_unseen(scene, carriers, nodes)]
    return Measured(needs, facts, lines, why_pointless(grating, needs))


def why_pointless(grating: Grating, needs: Needs) -> str:
    """A line if a bake of the needs would save too little memory compared with the present bake. Empty if it is worth
    its time, or if the present bake is already partial."""
    layout = _whole_layout(grating)
    if layout is None:
        return ""
    part, whole = expected_table_bytes(layout, needs)
    if part <= (1 - SAVING_MIN) * whole:
        return ""
    return (
        f"{grating.name}: nothing to gain: the scene shows {needs.region.share_of_disc:.0%} of all directions. A bake "
        f"for it would take about {part / 2**20:.0f} MiB instead of {whole / 2**20:.0f} MiB; the present bake stays"
    )


def no_smaller(grating: Grating, facts: dict[str, Any]) -> GratingError | None:
    """An error if a bake for the scene (its `facts`) takes no less memory than the present whole bake, else None."""
    layout = _whole_layout(grating)
    whole = 0 if layout is None else layout.width * layout.height * BYTES_PER_TEXEL
    if layout is None or facts["blender_bytes"] < whole:
        return None
    fault = f"the bake for this scene takes {facts['blender_bytes'] / 2**20:.0f} MiB instead of {whole / 2**20:.0f} MiB"
    return GratingError(grating.name, f"nothing gained: {fault}", "the present bake stays")


def _whole_layout(grating: Grating) -> Layout | None:
    """The layout of the grating's present bake, or None if there is no bake or it is partial."""
    try:
        layout, _ = read_header(grating.baked_file())
    except GratingError:
        return None
    return layout if layout.whole else None


def request_with(grating: Grating, needs: Needs) -> BakeRequest:
    """The request for a grating's bake with these needs. A grating without a scan of its own takes everything else from
    its bake's header. Raises GratingError as Grating.bake_request does, or if the header names scans other than
    synthetic surfaces, whose location it does not hold."""
    if grating.source:
        return replace(grating.bake_request(), needs=needs)
    path = bake_of(grating)
    _, record = read_header(path)
    request = request_from(record.get("request", {}), str(path))
    if not request.scans or not all(is_synthetic(scan.source) for scan in request.scans):
        grating.source_file()  # which says what is missing
    return replace(request, needs=needs)


def _carriers(scene: bpy.types.Scene, grating: Grating) -> Iterator[bpy.types.Object]:
    """A scene's meshes that show a grating, alone or varied with others."""
    if grating.group is None or not is_diffraction(grating.group):
        return
    response = response_in(grating.group)
    for thing in scene.objects:
        nodes = [node for slot in thing.material_slots for node in diffraction_nodes(slot.material)]
        if thing.type == "MESH" and any(response in responses_in(node.node_tree) for node in nodes):
            yield thing


def _frames(scene: bpy.types.Scene, carriers: list[bpy.types.Object], asked: tuple[int, int] | None) -> list[int]:
    """Sampled frames of a range, plus each frame in which a marker switches the camera."""
    cuts = [marker.frame for marker in scene.timeline_markers if marker.camera is not None]
    trees = {slot.material.node_tree for thing in carriers for slot in thing.material_slots if slot.material}
    if asked is None:
        things = [scene.camera, *carriers, *followed_lamps(scene)]
        if not (cuts or moves(things) or any(map(is_animated, filter(None, trees)))):
            return [scene.frame_current]
        asked = scene.frame_start, scene.frame_end
    first, last = asked
    return sorted({*frames_between(first, last, FRAMES_MAX), *(frame for frame in cuts if first <= frame <= last)})


def _looks(scene: bpy.types.Scene, frames: list[int], rays: int, *, progress: Progress) -> Iterator[Look]:
    """A look through the camera in each frame. Afterwards the present frame is restored."""
    now, subframe = scene.frame_current, scene.frame_subframe
    try:
        for number, frame in enumerate(frames):
            progress(_MEASURING, number / len(frames))
            if len(frames) > 1 or frame != now:
                scene.frame_set(frame)
            if (seen := look(scene, bpy.context.evaluated_depsgraph_get(), rays=rays, footprints=True)) is not None:
                yield seen
        progress(_MEASURING, 1.0)
    finally:
        if (scene.frame_current, scene.frame_subframe) != (now, subframe):
            scene.frame_set(now, subframe=subframe)


def _looks_of(views: Sequence[Callable[[], object]], rays: int, progress: Progress) -> Iterator[Look]:
    """A look through the camera in each view."""
    for number, set_up in enumerate(views, 1):
        set_up()
        scene = bpy.context.scene
        if (seen := look(scene, bpy.context.evaluated_depsgraph_get(), rays=rays, footprints=True)) is not None:
            yield seen
        progress(_MEASURING, number / len(views))


def _told(grating: Grating, needs: Needs, facts: dict[str, Any]) -> str:
    ranges = ", ".join(
        f"{name} {low:.2f} to {high:.2f}" for name, (low, high) in zip("uvw", (*needs.region, needs.w), strict=True)
    )
    frames = facts["frames"]
    if not frames:
        when = "all its views"
    else:
        when = f"{len(frames)} frames from {frames[0]} to {frames[-1]}" if frames[1:] else f"frame {frames[0]}"
    return (
        f"{grating.name}: the scene needs {ranges}: {facts['light_share']:.2%} of its light at {facts['places']} "
        f"places, in {when}"
    )


def _unseen(
    scene: bpy.types.Scene, carriers: list[bpy.types.Object], nodes: Mapping[Any, bpy.types.Object]
) -> list[str]:
    """A line for each mesh with the grating that renders but was skipped, because it is hidden in the viewport."""
    seen = set(nodes.values())
    left = [o for o in carriers if o not in seen and not o.hide_render and not o.visible_get()]
    return [f"{o.name}: hidden in the viewport, so it was not measured; show it and measure again" for o in left]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Facts about a scene and its active grating for the panel: the steps of the work, and what to do next.

Blender draws a panel many times a second, so nothing is computed during a draw. Facts are found at the first draw, and
again by a timer once nothing has changed for a moment; until then the panel shows the former ones. Blender does not
report all changes. So while the panel is drawn, old facts are found again: after at least a second, and seldom enough
to take at most a fiftieth of the time."""

import time
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import bpy

from ...precompute.base.failure import GratingError
from ..blender import compat
from ..blender.guard import guarded
from ..blender.session import STILL, change_count, has_window, redraw_views, seconds_until_still
from ..direction.uv_maps import has_uv_map
from ..gratings.bakes import is_asked_by_other_version, is_asked_otherwise
from ..gratings.direction_source import AXIS
from ..gratings.grating import ALL, LAMPS_ONLY, NO_SAMPLE_SET, Grating, Variation
from ..gratings.wording import counted, marked, translated
from ..lamps.brightest_lamps import brightest, instanced_lamps, lamps_of, unfollowed_features
from ..lamps.follow import followed_lamps, is_on
from ..lamps.rendered_lamps import rendered
from ..lamps.sky import fitted_frames, missed_share, sky_with_disc, source_count
from ..materials.data_pictures import wrong_colours
from ..materials.group_properties import is_diffraction, variation_of
from ..materials.skin import answers_to_world, crowded, follows_world, linked_with_fewer_lamps
from ..operators.assign import AssignToSelected, MendMaterials
from ..operators.bake import BakeGrating
from ..operators.direction import ChooseDirection
from ..operators.light import AddLightRig
from ..operators.shared import selected_meshes
from ..operators.why_black import MendCause
from ..workflow.lights.fitting_worlds import world_is_animated, world_is_fitted

# Smallest share of bright light without a source that the panel reports.
_MISSED_MIN = 0.01
# Facts count as old after this many seconds, and this many times the time that finding them took.
_OLD_SECONDS, _OLD_TIMES = 1.0, 50
NOT_FITTED = marked("not fitted")
ANIMATED = marked("animated, so its bright parts are noisy")


class LampFact(NamedTuple):
    """A lamp of the scene."""

    name: str
    kind: str
    hidden: bool


class SceneFacts(NamedTuple):
    """Facts about a scene.

    strays    names of the diffraction materials that belong to no grating in the list and can be adopted
    linked    a line for each such material that is linked from another file
    lamps     the lamps that light the diffraction
    others    the lamps that are left out of it
    world     how the world lights it; empty if there is nothing to report
    has_frames   whether the frames of an animated world are fitted
    dark_disc    whether the engine draws the world's sky without its sun disc
    features  a line for each feature of lamps that diffraction does not follow
    instanced names of lamps that only instances show
    wrong     a line for each cause of wrong colours"""

    strays: tuple[str, ...] = ()
    linked: tuple[str, ...] = ()
    lamps: tuple[LampFact, ...] = ()
    others: tuple[LampFact, ...] = ()
    world: str = ""
    has_frames: bool = False
    dark_disc: bool = False
    features: tuple[str, ...] = ()
    instanced: tuple[str, ...] = ()
    wrong: tuple[str, ...] = ()

    @property
    def can_be_mended(self) -> bool:
        """Whether Mend Materials helps."""
        return any(MendMaterials.bl_label in line for line in self.wrong)


class GratingFacts(NamedTuple):
    """Facts about the active grating.

    scans      file names of the scans if it averages several; empty for one
    fault      why they cannot be told; else None
    outdated   why it should be baked again; empty if its settings are those of its bake
    objects    a line with the objects that show it; empty without a material
    shown_on   how many objects show it
    variation  how it varies over the surface
    hologram   the patterns of holograms in its materials
    crowded    a line if EEVEE has no room for all lamps or sources
    far_lamps  a line for each lamp whose spectrum its bake answers badly
    dull       a line if it has little to reflect
    no_set     a line if it is set to respond to more than lamps but cannot"""

    scans: tuple[str, ...] = ()
    fault: GratingError | None = None
    outdated: str = ""
    objects: str = ""
    shown_on: int = 0
    variation: str = ""
    hologram: str = "None"
    crowded: tuple[str, ...] = ()
    far_lamps: tuple[str, ...] = ()
    dull: tuple[str, ...] = ()
    no_set: str = ""


class Facts(NamedTuple):
    """Facts about a scene, and about its active grating if there is one."""

    scene: SceneFacts
    grating: GratingFacts


class _Found(NamedTuple):
    """Cached facts: what the panel showed (`of`), the view layer's name, the number of changes so far, the time when
    they were found, and the seconds that it took."""

    facts: Facts
    of: tuple[object, ...]
    layer: str
    changes: int
    at: float
    seconds: float

    @property
    def is_former(self) -> bool:
        """Whether they may be outdated."""
        old = max(_OLD_SECONDS, _OLD_TIMES * self.seconds)
        return self.changes != change_count() or time.monotonic() - self.at > old


# By the scenes' full names, because each window may show another scene.
_found: dict[str, _Found] = {}


def facts_of(context: bpy.types.Context) -> Facts:
    """The facts for the panel of the context's scene. In background, without a timer, they are found at each call."""
    scene = context.scene
    found = _found.get(scene.name_full)
    if found is None or found.of != _shown(scene) or not has_window():
        found = _find(scene, context.view_layer.name, context.evaluated_depsgraph_get())
    elif found.is_former and not bpy.app.timers.is_registered(_find_again):
        bpy.app.timers.register(_find_again, first_interval=STILL)
    return found.facts


def stop() -> None:
    """Cancel the timer and discard everything, when the extension is disabled."""
    if bpy.app.timers.is_registered(_find_again):
        bpy.app.timers.unregister(_find_again)
    _found.clear()


@guarded
def _find_again() -> float | None:
    """Update the cached facts and redraw the panel if they differ. Returns the seconds to wait, or None when done."""
    if wait := seconds_until_still():
        return wait
    for name, former in list(_found.items()):
        scene = next((scene for scene in bpy.data.scenes if scene.name_full == name), None)
        layer = None if scene is None else scene.view_layers.get(former.layer)
        if layer is None or layer.depsgraph is None:
            del _found[name]
        elif _find(scene, layer.name, layer.depsgraph).facts != former.facts:
            redraw_views()
    return None


def _shown(scene: bpy.types.Scene) -> tuple[object, ...]:
    gratings = scene.natural_gratings
    grating = gratings.active()
    named = () if grating is None else (grating.name, grating.source, grating.bake_path, grating.lights)
    return gratings.active_index, *named


def _find(scene: bpy.types.Scene, layer: str, depsgraph: bpy.types.Depsgraph) -> _Found:
    changes, start = change_count(), time.monotonic()
    grating = scene.natural_gratings.active()
    facts = Facts(_of_scene(scene, depsgraph), GratingFacts() if grating is None else _of_grating(grating, scene))
    now = time.monotonic()
    found = _found[scene.name_full] = _Found(facts, _shown(scene), layer, changes, now, now - start)
    return found


def _of_scene(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> SceneFacts:
    strays: tuple[str, ...] = ()
    linked: tuple[str, ...] = ()
    ungrouped: list[str] = []
    if any(map(is_diffraction, bpy.data.node_groups)):  # most files need no more than this
        from ..materials.material import linked_strays, outside_light_groups
        from ..materials.material import strays as strays_of

        found = strays_of(scene)
        strays = tuple(group.name for group in found if group.library is None)
        linked = tuple(map(str, linked_strays(scene, found)))
        ungrouped = outside_light_groups(scene)
    followed = followed_lamps(scene)
    lamps = followed or brightest(scene)
    others = sorted((lamp for lamp in lamps_of(scene) if lamp not in lamps), key=lambda lamp: lamp.name)
    return SceneFacts(
        strays=strays,
        linked=linked,
        lamps=tuple(
            LampFact(lamp.name, lamp.data.type, bool(followed) and not is_on(scene, index))
            for index, lamp in enumerate(lamps)
        ),
        others=tuple(
            LampFact(lamp.name, lamp.data.type, not shown)
            for lamp, shown in zip(others, rendered(scene, others), strict=True)
        ),
        world=_world(scene),
        has_frames=bool(fitted_frames(scene)),
        dark_disc=_is_disc_dark(scene),
        features=(*unfollowed_features(scene, lamps), *linked_with_fewer_lamps(scene), *ungrouped),
        instanced=tuple(instanced_lamps(depsgraph)),
        wrong=tuple(wrong_colours(scene)),
    )


def _is_disc_dark(scene: bpy.types.Scene) -> bool:
    """Whether the scene's engine draws its sky without the sun disc."""
    in_eevee = scene.render.engine == compat.eevee_engine() and not compat.EEVEE_DRAWS_SUN_DISC
    return in_eevee and sky_with_disc(scene.world) is not None


def _world(scene: bpy.types.Scene) -> str:
    """How the scene's world lights the diffraction."""
    if scene.world is None or not follows_world():
        return ""
    if world_is_animated(scene):
        return _frames(scene) or ANIMATED
    if not world_is_fitted(scene):
        return NOT_FITTED
    count = source_count(scene)
    one = "{count} bright spot without noise, the rest with noise"
    text = (
        counted(one, "{count} bright spots without noise, the rest with noise", count) if count else translated("noisy")
    )
    if missed_share(scene) < _MISSED_MIN:
        return text
    share = f"{missed_share(scene):.0%}"
    return translated("{text}, {share} of bright light not fitted, so noisy", text=text, share=share)


def _frames(scene: bpy.types.Scene) -> str:
    """The fitted frames of an animated world; empty if there are none."""
    frames = fitted_frames(scene)
    if not frames:
        return ""
    text = marked("fitted in {count} frames, {first} to {last}; its bright spots are without noise there")
    return translated(text, count=len(frames), first=min(frames), last=max(frames))


def _of_grating(grating: Grating, scene: bpy.types.Scene) -> GratingFacts:
    scans: tuple[str, ...] = ()
    fault = None
    try:
        if grating.further_scans():
            scans = tuple(Path(scan.source).name for scan in grating.bake_request().scans)
    except GratingError as error:
        fault = error
    group = grating.group
    if group is None:
        return GratingFacts(scans, fault, _outdated(grating), variation=Variation().summary)
    from ..materials.lamp_errors import far_lamps
    from ..materials.material import on_objects, shown_by
    from ..workflow.lights.reflections import dull
    from ..workflow.varying_inputs import hologram_summary

    objects = shown_by(group)
    lacks_set = grating.lit_by != LAMPS_ONLY and not answers_to_world(group)
    return GratingFacts(
        scans=scans,
        fault=fault,
        outdated=_outdated(grating),
        objects=on_objects(objects),
        shown_on=len(objects),
        variation=variation_of(group).summary,
        hologram=hologram_summary(group),
        crowded=tuple(crowded(group)),
        far_lamps=tuple(far_lamps(group, scene)),
        dull=tuple(dull(scene, grating)),
        no_set=f"{grating.name}: {translated(NO_SAMPLE_SET)}" if lacks_set else "",
    )


def _outdated(grating: Grating) -> str:
    from ..workflow.finding_bakes import is_lost

    if is_lost(grating):
        return marked("The file of its bake is gone")
    if not is_asked_otherwise(grating):
        return ""
    if is_asked_by_other_version(grating):
        return marked("Baked by another version of the extension")
    return marked("Settings changed since this bake")


SURFACE, LOOK, LIGHT, QUALITY = marked("Surface"), marked("Look"), marked("Light"), marked("Quality")
# The states of a step.
DONE, NOW, LATER = "done", "now", "later"


class Next(NamedTuple):
    """What to do next: the step that it belongs to, and a button, or a sentence if no button does it."""

    step: str
    sentence: str = ""
    operator: str = ""
    text: str = ""
    icon: str = "NONE"
    properties: Mapping[str, Any] = MappingProxyType({})


def next_step(context: bpy.types.Context, grating: Grating, facts: Facts) -> Next | None:
    """What to do next with the active grating; None if it is baked, on an object, lit and shown."""
    if not grating.bake_path:
        return Next(SURFACE, operator=BakeGrating.bl_idname, text="Bake", icon="RENDER_STILL")
    if facts.grating.outdated and not grating.source:
        return Next(SURFACE, f"{facts.grating.outdated}. Load it again, or import the height map")
    if facts.grating.outdated:
        step = QUALITY if facts.grating.shown_on else SURFACE  # what is shown stays done
        return Next(step, facts.grating.outdated, BakeGrating.bl_idname, text="Bake Again", icon="RENDER_STILL")
    if not facts.grating.shown_on:
        chosen = selected_meshes(context)
        if not chosen:
            return Next(LOOK, "Select a mesh in the 3D view. It will show the grating")
        source = grating.frame_source()
        bare = [thing.name for thing in chosen if not has_uv_map(thing.data, source)]
        if bare:
            sentence = translated("{names}: no UV map that gives a direction", names=", ".join(bare))
            return Next(
                LOOK, sentence, ChooseDirection.bl_idname,
                text="Use the Object's Z Axis", icon="ORIENTATION_LOCAL", properties={"kind": AXIS, "axis": "Z"},
            )  # fmt: skip
        text = counted("Assign to {name}", "Assign to {count} Meshes", len(chosen), name=chosen[0].name)
        return Next(LOOK, operator=AssignToSelected.bl_idname, text=text, icon="BRUSH_DATA")
    if not is_lit(grating, facts):
        return Next(
            LIGHT, "Nothing lights the grating", AddLightRig.bl_idname, text="Add a Light Rig", icon="LIGHT_SUN"
        )
    view = context.space_data
    if isinstance(view, bpy.types.SpaceView3D) and view.shading.type != "RENDERED":
        return Next(
            LIGHT, operator=MendCause.bl_idname, text="Switch to Rendered", icon="SHADING_RENDERED",
            properties={"action": "RENDERED"},
        )  # fmt: skip
    return None


def is_lit(grating: Grating, facts: Facts) -> bool:
    """Whether a lamp, or the world where it counts, lights the grating."""
    lamps = (*facts.scene.lamps, *(facts.scene.others if grating.lit_by == ALL else ()))
    return any(not lamp.hidden for lamp in lamps) or (grating.lit_by != LAMPS_ONLY and bool(facts.scene.world))


def state_of(step: str, following: Next | None) -> str:
    """The state of a step, given what to do next. Quality has no end, so it is never done."""
    order = (SURFACE, LOOK, LIGHT, QUALITY)
    if step == QUALITY:
        return LATER
    if following is None or order.index(step) < order.index(following.step):
        return DONE
    return NOW if step == following.step else LATER

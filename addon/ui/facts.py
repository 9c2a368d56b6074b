# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panel tells of a scene and its active grating, found by walking through the file.

Blender draws a panel many times a second, so nothing is walked through while it draws. The facts are found when they
are first asked for, and again by a timer once nothing has changed for a moment; the panel shows the former facts until
then. Of some changes Blender does not tell. So facts that are old are found again, too, if the panel is drawn: after
at least a second, and after so long that all this takes a fiftieth of the time."""

import time
from dataclasses import dataclass
from pathlib import Path

import bpy

from ...precompute.base.failure import GratingError
from ..blender.changes import STILL, change_count, seconds_until_still
from ..blender.guard import guarded
from ..blender.window import has_window, redraw_views
from ..gratings.bakes import is_asked_otherwise
from ..gratings.grating import Grating
from ..gratings.lights_choice import LAMPS_ONLY, NO_SAMPLE_SET
from ..gratings.variation import Variation
from ..lamps.find import brightest, instanced_lamps, unfollowed_features
from ..lamps.follow import followed_lamps, is_on
from ..lamps.sky import missed_share, source_count
from ..materials.data_pictures import wrong_colours
from ..materials.group_properties import is_diffraction, variation_of
from ..materials.skin import answers_to_world, crowded, follows_world, linked_with_fewer_lamps
from ..operators.mend import MendMaterials
from ..workflow.fitting_worlds import world_is_animated, world_is_fitted

# The least share of bright light in no source that is worth a word.
_MISSED_MIN = 0.01
# Facts are found again after so many seconds, and after so many times as long as finding them took.
_OLD_SECONDS, _OLD_TIMES = 1.0, 50
NOT_FITTED = "not fitted"


@dataclass(frozen=True)
class LampFact:
    """A lamp that lights the diffraction."""

    name: str
    kind: str
    hidden: bool


@dataclass(frozen=True)
class SceneFacts:
    """What the panel tells of a scene.

    strays    names of the diffraction materials that no grating in the list has, and that can be adopted
    linked    a line for each that another file has
    lamps     those that light the diffraction
    world     what lights it of the world; empty if there is nothing to say
    features  a line for each thing about lamps that diffraction does not follow
    instanced names of lamps that only instances show
    wrong     a line for each thing for which colours are wrong"""

    strays: tuple[str, ...] = ()
    linked: tuple[str, ...] = ()
    lamps: tuple[LampFact, ...] = ()
    world: str = ""
    features: tuple[str, ...] = ()
    instanced: tuple[str, ...] = ()
    wrong: tuple[str, ...] = ()

    @property
    def can_be_mended(self) -> bool:
        """Whether Mend Materials helps."""
        return any(MendMaterials.bl_label in line for line in self.wrong)


@dataclass(frozen=True)
class GratingFacts:
    """What the panel tells of the active grating.

    scans      file names of the scans if it averages several; empty for one
    fault      why they cannot be told; else None
    outdated   whether its settings are no longer those of its bake
    objects    a line that names the objects that show it; empty without a material
    variation  how it varies over the surface
    crowded    a line if EEVEE has no room for all lamps or sources
    no_set     a line if it cannot answer to light that comes from no lamp"""

    scans: tuple[str, ...] = ()
    fault: GratingError | None = None
    outdated: bool = False
    objects: str = ""
    variation: str = ""
    crowded: tuple[str, ...] = ()
    no_set: str = ""


@dataclass(frozen=True)
class Facts:
    """What the panel tells of a scene, and of the active grating if there is one."""

    scene: SceneFacts
    grating: GratingFacts


@dataclass(frozen=True)
class _Found:
    """Facts that were found.

    of       what the panel showed: the active grating, by what an artist may exchange of it
    layer    the view layer's name
    changes  how many changes there were before
    at       when they were found, and `seconds` how long that took"""

    facts: Facts
    of: tuple[object, ...]
    layer: str
    changes: int
    at: float
    seconds: float

    @property
    def is_former(self) -> bool:
        """Whether they may be otherwise now."""
        old = max(_OLD_SECONDS, _OLD_TIMES * self.seconds)
        return self.changes != change_count() or time.monotonic() - self.at > old


# By the scenes' full names: each window may show another scene.
_found: dict[str, _Found] = {}


def facts_of(context: bpy.types.Context) -> Facts:
    """The facts of the context's scene, for its panel. Without a window, where no timer runs, they are found at
    each call."""
    scene = context.scene
    found = _found.get(scene.name_full)
    if found is None or found.of != _shown(scene) or not has_window():
        found = _find(scene, context.view_layer.name, context.evaluated_depsgraph_get())
    elif found.is_former and not bpy.app.timers.is_registered(_find_again):
        bpy.app.timers.register(_find_again, first_interval=STILL)
    return found.facts


def stop() -> None:
    """Find nothing any more: the extension is being disabled."""
    if bpy.app.timers.is_registered(_find_again):
        bpy.app.timers.unregister(_find_again)
    _found.clear()


@guarded
def _find_again() -> float | None:
    """Find the facts that are shown again, and draw the panel if they differ. The seconds to wait if something has just
    changed, else None."""
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
    facts = Facts(_of_scene(scene, depsgraph), GratingFacts() if grating is None else _of_grating(grating))
    now = time.monotonic()
    found = _found[scene.name_full] = _Found(facts, _shown(scene), layer, changes, now, now - start)
    return found


def _of_scene(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> SceneFacts:
    strays: tuple[str, ...] = ()
    linked: tuple[str, ...] = ()
    if any(map(is_diffraction, bpy.data.node_groups)):  # most files load no more than this
        from ..materials.group_users import linked_strays
        from ..materials.group_users import strays as strays_of

        found = strays_of(scene)
        strays = tuple(group.name for group in found if group.library is None)
        linked = tuple(map(str, linked_strays(found)))
    followed = followed_lamps(scene)
    lamps = followed or brightest(scene)
    return SceneFacts(
        strays=strays,
        linked=linked,
        lamps=tuple(
            LampFact(lamp.name, lamp.data.type, bool(followed) and not is_on(scene, index))
            for index, lamp in enumerate(lamps)
        ),
        world=_world(scene),
        features=tuple(unfollowed_features(scene, lamps) + linked_with_fewer_lamps(scene)),
        instanced=tuple(instanced_lamps(depsgraph)),
        wrong=tuple(wrong_colours(scene)),
    )


def _world(scene: bpy.types.Scene) -> str:
    """What lights the diffraction of the scene's world."""
    if scene.world is None or not follows_world():
        return ""
    if world_is_animated(scene):
        return "animated, so its bright parts light with noise"
    if not world_is_fitted(scene):
        return NOT_FITTED
    count = source_count(scene)
    text = f"{count} source{'s' * (count != 1)} and the rest"
    if missed_share(scene) >= _MISSED_MIN:
        text += f", {missed_share(scene):.0%} of bright light in none"
    return text


def _of_grating(grating: Grating) -> GratingFacts:
    scans: tuple[str, ...] = ()
    fault = None
    try:
        if grating.further_scans():
            scans = tuple(Path(scan.source).name for scan in grating.bake_request().scans)
    except GratingError as error:
        fault = error
    group = grating.group
    if group is None:
        return GratingFacts(scans, fault, is_asked_otherwise(grating), variation=Variation().summary)
    from ..materials.group_users import on_objects, shown_by

    lacks_set = grating.lit_by != LAMPS_ONLY and not answers_to_world(group)
    return GratingFacts(
        scans=scans,
        fault=fault,
        outdated=is_asked_otherwise(grating),
        objects=on_objects(shown_by(group)),
        variation=variation_of(group).summary,
        crowded=tuple(crowded(group)),
        no_set=f"{grating.name}: {NO_SAMPLE_SET}" if lacks_set else "",
    )

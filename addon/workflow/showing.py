# SPDX-License-Identifier: GPL-3.0-or-later
"""Show Me: a new scene with a preset on a thing, lit and ready to render."""

import bpy

from ...precompute.presets.presets import SNAKES, read_preset
from ..showcase.stage import STAGES, set_stage
from ..showcase.things import add_thing
from .adding_presets import add_preset
from .assigning import add_to_meshes, assign_to_meshes
from .baking import bake_and_wait
from .taking_drafts import take_draft

# Names the scenes of Show Me, by a custom property.
_MARK = "ng_show"


def show_preset(name: str) -> bpy.types.Scene:
    """Make a scene that shows a preset at draft quality. All other scenes stay as they are. Returns the scene. Raises
    GratingError, with no scene left, for an unknown preset or if its draft has to be baked and cannot be."""
    preset = read_preset(name)
    scene = bpy.data.scenes.new(f"Show Me: {preset.title}")
    try:
        grating = add_preset(scene, name)
        if not take_draft(grating, preset):
            bake_and_wait(grating)
        set_stage(scene, STAGES[preset.shape])
        thing = add_thing(scene, preset.shape, preset.title)
        # A snake keeps its own skin below the grating.
        (add_to_meshes if preset.shape in SNAKES else assign_to_meshes)(scene, [thing])
    except BaseException:
        bpy.data.scenes.remove(scene)
        raise
    scene[_MARK] = True
    # Active but not selected: an outline would hide the colours of its rim.
    scene.view_layers[0].objects.active = thing
    return scene


def is_show(scene: bpy.types.Scene) -> bool:
    """Whether Show Me made the scene."""
    return bool(scene.get(_MARK))

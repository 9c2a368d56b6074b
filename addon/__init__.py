# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender add-on: lamps, node groups, materials, operators, panels and the command line. The physics is in
precompute/.

Enabling the extension loads only what registration needs. Operators and command-line verbs load the rest when run."""

import bpy

from .gratings import bakes, grating, levelling_steps, material_look, replaced_material
from .lamps import brightest_lamps, lamp_spectrum, light_rig
from .materials import exporting
from .operators import (
    add_grating,
    add_node,
    add_preset,
    add_things,
    assign,
    bake,
    direction,
    import_files,
    level_steps,
    light,
    make_assets,
    osl_reference,
    shared,
    show_picture,
    vary,
    why_black,
)
from .ui import (
    direction_panel,
    facts,
    folds,
    installation,
    light_part,
    object_menu,
    panel,
    preset_pictures,
    steps_panel,
)
from .workflow import handlers, levelling

# Registration order: a property group comes before the property groups that hold it.
CLASSES = (
    levelling_steps.LevellingStep,
    material_look.MaterialLook,
    grating.Grating,
    grating.SceneGratings,
    replaced_material.ReplacedMaterial,
    shared.CancelJob,
    import_files.ImportHeightMap,
    import_files.DropHeightMap,
    import_files.LoadBake,
    import_files.DropBake,
    add_grating.AddGrating,
    add_preset.AddPreset,
    add_preset.LoadPreset,
    add_preset.DropPreset,
    add_node.AddGratingNode,
    add_node.AddPresetNode,
    add_node.AddPatternNode,
    add_preset.ShowMe,
    add_preset.BackFromShow,
    make_assets.MakeAssets,
    make_assets.RemoveAssets,
    add_grating.RemoveGrating,
    level_steps.AddLevellingStep,
    level_steps.RemoveLevellingStep,
    level_steps.MoveLevellingStep,
    level_steps.LevellingAsText,
    bake.BakeGrating,
    bake.BakeNeeds,
    assign.NewDiffractionMaterial,
    assign.AssignToSelected,
    assign.AddDiffraction,
    assign.RemoveDiffraction,
    assign.MendMaterials,
    assign.AdoptMaterials,
    light.AddSun,
    light.AddSkySun,
    light.AddDiffractionLamp,
    light.AddLightRig,
    add_things.AddSnake,
    add_things.AddShedSkin,
    add_things.AddSticker,
    light.ChooseLights,
    light.CountLamp,
    bake.ChooseQuality,
    direction.CombGrating,
    direction.ChooseDirection,
    vary.VaryGrating,
    vary.AddHologram,
    vary.PaintInput,
    vary.UnpaintInput,
    light.FitFrames,
    light.FitWorld,
    osl_reference.NewOslReference,
    direction.ShowDirection,
    show_picture.ShowPicture,
    direction.Unwrap,
    direction.BakeDirectionMap,
    why_black.WhyBlack,
    why_black.MendCause,
    installation.OpenManual,
    installation.Preferences,
    folds.Folds,
    panel.PresetMenu,
    panel.SampleMenu,
    object_menu.ObjectMenu,
    add_node.NodeMenu,
    panel.GratingList,
    steps_panel.StepList,
    panel.GratingPanel,
    panel.MaterialPanel,
    panel.ShaderPanel,
    direction_panel.DirectionPanel,
    light_part.LampSpectrumPanel,
    panel.ReferencePanel,
)

_command = None


def register() -> None:
    """Register all classes, the scene's gratings, the menu entries and `blender --command grating`."""
    global _command
    for cls in CLASSES:
        if issubclass(cls, bpy.types.Operator) and cls.__doc__:
            # As one line. Blender would break a tooltip where the source does, and not find its translation.
            cls.bl_description = " ".join(cls.__doc__.split())  # type: ignore[union-attr]  # the stubs lack it
        bpy.utils.register_class(cls)
    bpy.types.Scene.natural_gratings = bpy.props.PointerProperty(type=grating.SceneGratings)  # type: ignore[func-returns-value]  # the stubs say it returns None
    setattr(bpy.types.Object, replaced_material.REPLACED, replaced_material.replaced_field())
    setattr(bpy.types.Object, brightest_lamps.COUNTS, brightest_lamps.counts_field())
    for kind in (bpy.types.Object, bpy.types.Collection):
        setattr(kind, light_rig.RIG, light_rig.rig_field())
    setattr(bpy.types.Light, lamp_spectrum.FIELD, lamp_spectrum.spectrum_field())
    setattr(bpy.types.Light, lamp_spectrum.SHOWN, lamp_spectrum.shown_field())
    setattr(bpy.types.WindowManager, preset_pictures.CHOSEN, preset_pictures.chosen_preset())
    setattr(bpy.types.WindowManager, folds.FOLDS, bpy.props.PointerProperty(type=folds.Folds))  # type: ignore[func-returns-value]  # as above
    bpy.types.TOPBAR_MT_file_import.append(import_files.menu_entries)
    bpy.types.VIEW3D_MT_light_add.append(light.menu_entry)
    bpy.types.VIEW3D_MT_mesh_add.append(add_things.menu_entry)
    bpy.types.VIEW3D_MT_object.append(object_menu.menu_entry)
    bpy.types.NODE_MT_shader_node_add_all.append(add_node.menu_entry)
    for after in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        after.append(bakes.recall_bakes)
    handlers.register()
    exporting.register()
    _command = bpy.utils.register_cli_command("grating", _run_command)  # type: ignore[func-returns-value]  # the stubs say it returns None
    installation.print_missing()


def unregister() -> None:
    """Undo register() in reverse order. Gratings and materials stay in open files."""
    bpy.utils.unregister_cli_command(_command)
    for follower in shared.followers():
        follower.stop()
    levelling.stop()
    facts.stop()
    direction.set_shown(False)
    exporting.unregister()
    handlers.unregister()
    for after in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        after.remove(bakes.recall_bakes)
    bpy.types.VIEW3D_MT_object.remove(object_menu.menu_entry)
    bpy.types.NODE_MT_shader_node_add_all.remove(add_node.menu_entry)
    bpy.types.VIEW3D_MT_mesh_add.remove(add_things.menu_entry)
    bpy.types.VIEW3D_MT_light_add.remove(light.menu_entry)
    bpy.types.TOPBAR_MT_file_import.remove(import_files.menu_entries)
    delattr(bpy.types.Light, lamp_spectrum.SHOWN)
    delattr(bpy.types.Light, lamp_spectrum.FIELD)
    for kind in (bpy.types.Object, bpy.types.Collection):
        delattr(kind, light_rig.RIG)
    delattr(bpy.types.Object, brightest_lamps.COUNTS)
    delattr(bpy.types.Object, replaced_material.REPLACED)
    delattr(bpy.types.WindowManager, folds.FOLDS)
    delattr(bpy.types.WindowManager, preset_pictures.CHOSEN)
    preset_pictures.forget_pictures()
    folds.forget_folds()
    del bpy.types.Scene.natural_gratings
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)


def _run_command(argv: list[str]) -> int:
    from .batch import commands

    return commands.execute(argv)

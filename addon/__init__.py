# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender add-on: lamps, node groups, materials, operators, panels and the command line. The physics is in
precompute/.

Enabling the extension loads only what registration needs. Operators and command-line verbs load the rest when run."""

import bpy

from .gratings import grating, levelling_steps, material_look, remembered_bakes, replaced_material
from .lamps import lamp_spectrum
from .operators import (
    add_diffraction,
    add_diffraction_lamp,
    add_grating,
    add_hologram,
    add_light_rig,
    add_node,
    add_preset,
    add_sky_sun,
    add_snake,
    add_sticker,
    add_sun,
    adopt,
    assign,
    bake_direction_map,
    bake_grating,
    bake_needs,
    choose_direction,
    choose_lights,
    choose_quality,
    comb_grating,
    count_lamp,
    fit_frames,
    fit_world,
    follows_job,
    import_height_map,
    level_steps,
    load_bake,
    make_assets,
    mend,
    new_material,
    osl_reference,
    paint_input,
    remove_grating,
    show_direction,
    show_me,
    show_picture,
    unwrap_meshes,
    vary_grating,
    why_black,
)
from .ui import (
    direction_panel,
    facts,
    folds,
    lamp_panel,
    missing_packages,
    object_menu,
    panel,
    preset_pictures,
    steps_panel,
)
from .workflow import handlers, previewing_levelling

# Registration order: a property group comes before the property groups that hold it.
CLASSES = (
    levelling_steps.LevellingStep,
    material_look.MaterialLook,
    grating.Grating,
    grating.SceneGratings,
    replaced_material.ReplacedMaterial,
    follows_job.CancelJob,
    import_height_map.ImportHeightMap,
    import_height_map.DropHeightMap,
    load_bake.LoadBake,
    load_bake.DropBake,
    add_grating.AddGrating,
    add_preset.AddPreset,
    add_preset.LoadPreset,
    add_preset.DropPreset,
    add_node.AddGratingNode,
    add_node.AddPresetNode,
    add_node.AddPatternNode,
    show_me.ShowMe,
    show_me.BackFromShow,
    make_assets.MakeAssets,
    make_assets.RemoveAssets,
    remove_grating.RemoveGrating,
    level_steps.AddLevellingStep,
    level_steps.RemoveLevellingStep,
    level_steps.MoveLevellingStep,
    level_steps.LevellingAsText,
    bake_grating.BakeGrating,
    bake_needs.BakeNeeds,
    new_material.NewDiffractionMaterial,
    assign.AssignToSelected,
    add_diffraction.AddDiffraction,
    add_diffraction.RemoveDiffraction,
    mend.MendMaterials,
    adopt.AdoptMaterials,
    add_sun.AddSun,
    add_sky_sun.AddSkySun,
    add_diffraction_lamp.AddDiffractionLamp,
    add_light_rig.AddLightRig,
    add_snake.AddSnake,
    add_snake.AddShedSkin,
    add_sticker.AddSticker,
    choose_lights.ChooseLights,
    count_lamp.CountLamp,
    choose_quality.ChooseQuality,
    comb_grating.CombGrating,
    choose_direction.ChooseDirection,
    vary_grating.VaryGrating,
    add_hologram.AddHologram,
    paint_input.PaintInput,
    paint_input.UnpaintInput,
    fit_frames.FitFrames,
    fit_world.FitWorld,
    osl_reference.NewOslReference,
    show_direction.ShowDirection,
    show_picture.ShowPicture,
    unwrap_meshes.Unwrap,
    bake_direction_map.BakeDirectionMap,
    why_black.WhyBlack,
    why_black.MendCause,
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
    lamp_panel.LampSpectrumPanel,
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
    setattr(bpy.types.Light, lamp_spectrum.FIELD, lamp_spectrum.spectrum_field())
    setattr(bpy.types.Light, lamp_spectrum.SHOWN, lamp_spectrum.shown_field())
    setattr(bpy.types.WindowManager, preset_pictures.CHOSEN, preset_pictures.chosen_preset())
    setattr(bpy.types.WindowManager, folds.FOLDS, bpy.props.PointerProperty(type=folds.Folds))  # type: ignore[func-returns-value]  # as above
    bpy.types.TOPBAR_MT_file_import.append(import_height_map.menu_entry)
    bpy.types.TOPBAR_MT_file_import.append(load_bake.menu_entry)
    bpy.types.VIEW3D_MT_light_add.append(add_diffraction_lamp.menu_entry)
    bpy.types.VIEW3D_MT_mesh_add.append(add_snake.menu_entry)
    bpy.types.VIEW3D_MT_object.append(object_menu.menu_entry)
    bpy.types.NODE_MT_shader_node_add_all.append(add_node.menu_entry)
    for after in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        after.append(remembered_bakes.recall_bakes)
    handlers.register()
    _command = bpy.utils.register_cli_command("grating", _run_command)  # type: ignore[func-returns-value]  # the stubs say it returns None
    missing_packages.print_missing()


def unregister() -> None:
    """Undo register() in reverse order. Gratings and materials stay in open files."""
    bpy.utils.unregister_cli_command(_command)
    for follower in follows_job.followers():
        follower.stop()
    previewing_levelling.stop()
    facts.stop()
    show_direction.set_shown(False)
    handlers.unregister()
    for after in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        after.remove(remembered_bakes.recall_bakes)
    bpy.types.VIEW3D_MT_object.remove(object_menu.menu_entry)
    bpy.types.NODE_MT_shader_node_add_all.remove(add_node.menu_entry)
    bpy.types.VIEW3D_MT_mesh_add.remove(add_snake.menu_entry)
    bpy.types.VIEW3D_MT_light_add.remove(add_diffraction_lamp.menu_entry)
    bpy.types.TOPBAR_MT_file_import.remove(load_bake.menu_entry)
    bpy.types.TOPBAR_MT_file_import.remove(import_height_map.menu_entry)
    delattr(bpy.types.Light, lamp_spectrum.SHOWN)
    delattr(bpy.types.Light, lamp_spectrum.FIELD)
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

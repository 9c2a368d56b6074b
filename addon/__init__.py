# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender add-on: lamps, node groups, materials, operators, panels and the command line. The physics is in
precompute/.

Enabling the extension loads only what registration needs. Operators and command-line verbs load the rest when run."""

import bpy

from .gratings import bakes, grating, levelling_steps, material_look, replaced_material
from .lamps import find, lamp_spectrum, light_rig
from .operators import (
    add_diffraction,
    add_grating,
    add_hologram,
    add_node,
    add_preset,
    add_snake,
    add_sticker,
    adopt,
    assign,
    bake,
    direction,
    import_height_map,
    level_steps,
    light,
    load_bake,
    make_assets,
    mend,
    new_material,
    paint_input,
    remove_grating,
    shared,
    show_me,
    show_picture,
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
from .workflow import exporting, handlers, previewing_levelling

# Registration order: a property group comes before the property groups that hold it.
CLASSES = (
    levelling_steps.LevellingStep,
    material_look.MaterialLook,
    grating.Grating,
    grating.SceneGratings,
    replaced_material.ReplacedMaterial,
    shared.CancelJob,
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
    bake.BakeGrating,
    bake.BakeNeeds,
    new_material.NewDiffractionMaterial,
    assign.AssignToSelected,
    add_diffraction.AddDiffraction,
    add_diffraction.RemoveDiffraction,
    mend.MendMaterials,
    adopt.AdoptMaterials,
    light.AddSun,
    light.AddSkySun,
    light.AddDiffractionLamp,
    light.AddLightRig,
    add_snake.AddSnake,
    add_snake.AddShedSkin,
    add_sticker.AddSticker,
    light.ChooseLights,
    light.CountLamp,
    bake.ChooseQuality,
    direction.CombGrating,
    direction.ChooseDirection,
    vary_grating.VaryGrating,
    add_hologram.AddHologram,
    paint_input.PaintInput,
    paint_input.UnpaintInput,
    light.FitFrames,
    light.FitWorld,
    bake.NewOslReference,
    direction.ShowDirection,
    show_picture.ShowPicture,
    direction.Unwrap,
    direction.BakeDirectionMap,
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
    setattr(bpy.types.Object, find.COUNTS, find.counts_field())
    for kind in (bpy.types.Object, bpy.types.Collection):
        setattr(kind, light_rig.RIG, light_rig.rig_field())
    setattr(bpy.types.Light, lamp_spectrum.FIELD, lamp_spectrum.spectrum_field())
    setattr(bpy.types.Light, lamp_spectrum.SHOWN, lamp_spectrum.shown_field())
    setattr(bpy.types.WindowManager, preset_pictures.CHOSEN, preset_pictures.chosen_preset())
    setattr(bpy.types.WindowManager, folds.FOLDS, bpy.props.PointerProperty(type=folds.Folds))  # type: ignore[func-returns-value]  # as above
    bpy.types.TOPBAR_MT_file_import.append(import_height_map.menu_entry)
    bpy.types.TOPBAR_MT_file_import.append(load_bake.menu_entry)
    bpy.types.VIEW3D_MT_light_add.append(light.menu_entry)
    bpy.types.VIEW3D_MT_mesh_add.append(add_snake.menu_entry)
    bpy.types.VIEW3D_MT_object.append(object_menu.menu_entry)
    bpy.types.NODE_MT_shader_node_add_all.append(add_node.menu_entry)
    for after in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        after.append(bakes.recall_bakes)
    handlers.register()
    exporting.register()
    _command = bpy.utils.register_cli_command("grating", _run_command)  # type: ignore[func-returns-value]  # the stubs say it returns None
    missing_packages.print_missing()


def unregister() -> None:
    """Undo register() in reverse order. Gratings and materials stay in open files."""
    bpy.utils.unregister_cli_command(_command)
    for follower in shared.followers():
        follower.stop()
    previewing_levelling.stop()
    facts.stop()
    direction.set_shown(False)
    exporting.unregister()
    handlers.unregister()
    for after in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        after.remove(bakes.recall_bakes)
    bpy.types.VIEW3D_MT_object.remove(object_menu.menu_entry)
    bpy.types.NODE_MT_shader_node_add_all.remove(add_node.menu_entry)
    bpy.types.VIEW3D_MT_mesh_add.remove(add_snake.menu_entry)
    bpy.types.VIEW3D_MT_light_add.remove(light.menu_entry)
    bpy.types.TOPBAR_MT_file_import.remove(load_bake.menu_entry)
    bpy.types.TOPBAR_MT_file_import.remove(import_height_map.menu_entry)
    delattr(bpy.types.Light, lamp_spectrum.SHOWN)
    delattr(bpy.types.Light, lamp_spectrum.FIELD)
    for kind in (bpy.types.Object, bpy.types.Collection):
        delattr(kind, light_rig.RIG)
    delattr(bpy.types.Object, find.COUNTS)
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

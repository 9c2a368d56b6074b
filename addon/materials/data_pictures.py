# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings with which Blender shows wrong colours or too little light for Diffraction groups.

Most of them resample the groups' pictures. A picture holds data in adjacent tiles, and resampling mixes the tiles. A
picture cannot be protected from this, so the add-on only warns."""

import bpy

from ..blender import compat, mesa
from ..blender.session import has_window
from ..blender.working_space import unknown_space
from ..direction.tangent_frame import frame_maps_in
from ..gratings.grating import LAMPS_ONLY
from .group_properties import areas_in, diffraction_groups, lights_of
from .pictures import pictures_of
from .response import in_other_spaces


def wrong_colours(scene: bpy.types.Scene) -> list[str]:
    """One warning line for each reason why the file's gratings show wrong colours, with the remedy."""
    groups = diffraction_groups()
    if not groups:  # most files need no further imports
        return []
    from .lost_parts import lost

    return resampled_pictures(scene) + _dimmed(scene, groups) + unknown_space() + in_other_spaces(groups) + lost(groups)


def _dimmed(scene: bpy.types.Scene, groups: list[bpy.types.NodeTree]) -> list[str]:
    """A warning line if EEVEE weighs bright samples less. It does so by the square of the exposure in stops, and a
    narrow order under an area lamp is bright in few samples: a third of a gold foil's orders is left at -1.5 stops."""
    exposed = scene.render.engine == compat.eevee_engine() and scene.view_settings.exposure != 0
    if not exposed or not any(areas_in(group) and lights_of(group) != LAMPS_ONLY for group in groups):
        return []
    remedy = "set Color Management > Exposure to 0, and scale the lamps"
    return [f"EEVEE dims gratings under area lamps at an exposure other than 0; {remedy}"]


def resampled_pictures(scene: bpy.types.Scene) -> list[str]:
    """One warning line for each setting that makes the scene's renderer resample a table, with the remedy."""
    pictures = _pictures()
    if not pictures:
        return []
    largest = max(max(picture.size) for picture in pictures)
    lines = []
    if scene.render.engine == compat.eevee_engine() and has_window() and mesa.sharpens_textures():
        lines.append(
            "EEVEE draws on the processor here, and sharpens the diffraction's table; use Cycles, or see Direct in the "
            "documentation for the variable to start Blender with"
        )
    if scene.render.engine == "CYCLES":
        if scene.render.use_simplify and min(_limits(scene)) < largest:
            lines.append("Simplify > Texture Limit resamples the diffraction's table; set it to No Limit")
        if scene.render.use_simplify and compat.texture_scale(scene) < 1:
            lines.append("Simplify > Texture Resolution resamples the diffraction's table; set it to 1")
        lines += [
            f"{picture.name}: Cycles resamples a picture that is not packed; pack it (File > External Data)"
            for picture in pictures
            if compat.has_texture_cache(scene) and not picture.packed_files
        ]
    elif _size(bpy.context.preferences.system.gl_texture_limit) < largest:
        lines.append("Preferences > Viewport > Limit Size resamples the diffraction's table; set it to No Limit")
    return lines


def _pictures() -> list[bpy.types.Image]:
    """The pictures that the file's Diffraction groups read, without duplicates."""
    groups = diffraction_groups()
    trees = [node.node_tree for group in groups for node in group.nodes if node.type == "GROUP" and node.node_tree]
    tables = [image for tree in dict.fromkeys(trees) for image in pictures_of(tree) if image is not None]
    return list(dict.fromkeys(tables + [image for group in groups for image in frame_maps_in(group)]))


def _limits(scene: bpy.types.Scene) -> tuple[float, float]:
    """The largest picture side that Cycles leaves unchanged, in the viewport and in renders."""
    return _size(scene.cycles.texture_limit), _size(scene.cycles.texture_limit_render)


def _size(limit: str) -> float:
    """The number in an enumeration item's name, such as 1024 in CLAMP_1024; infinite if there is none, as in OFF."""
    digits = limit.rpartition("_")[2]
    return float(digits) if digits.isdigit() else float("inf")

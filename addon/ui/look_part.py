# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's step Look: what the surface is made of, the material's values, its direction, variation and pattern."""

from ..blender import stored
from ..gratings.direction_source import FRAMES, KINDS, STORED
from ..gratings.grating import LAYERS
from ..gratings.wording import translated
from ..operators.add_things import AddSticker
from ..operators.assign import AddDiffraction, AssignToSelected, NewDiffractionMaterial, RemoveDiffraction
from ..operators.direction import ChooseDirection, CombGrating
from ..operators.shared import draw_progress
from ..operators.vary import INPUTS, AddHologram, PaintInput, UnpaintInput, VaryGrating
from .facts import GratingFacts
from .notes import draw_note, side_by_side

# Inputs of the Diffraction node, with an artist's word for each. They answer at once, without a bake.
_DIALS = (
    ("Strength", "Strength"),
    ("Roughness", "Softness"),
    ("Period Scale", "Hue by Period"),
    ("Rotation", "Rotation"),
    ("IOR", "IOR"),
)

_PAINTED = {name for name, _, _ in INPUTS}
# The share of a row that a label takes beside a button, so that a narrow sidebar does not cut the text of the button.
_LABEL = 0.4


def draw_look(layout, context, grating, *, facts: GratingFacts) -> None:
    """Draw what a grating is made of, and how its material looks."""
    _draw_matter(layout, grating)
    node = _shown_node(context, grating)
    if node is not None:
        _draw_dials(layout, node, is_dielectric=grating.matter == "DIELECTRIC")
    _draw_choices(layout, grating, facts)
    _draw_comb(layout)
    column = layout.column(align=True)
    row = side_by_side(column, context, "Assign", "Add", "Remove")
    row.operator(AssignToSelected.bl_idname, icon="BRUSH_DATA", text="Assign")
    row.operator(AddDiffraction.bl_idname, icon="ADD", text="Add")
    row.operator(RemoveDiffraction.bl_idname, icon="REMOVE", text="Remove")
    column.operator(NewDiffractionMaterial.bl_idname, text="New Material", icon="MATERIAL")
    draw_stickers(column, context)
    if facts.objects:
        draw_note(layout, context, facts.objects, icon="OBJECT_DATA")


def draw_stickers(layout, context):
    """Draw the button for a sticker with the pattern of its surface, and the one that asks for a picture. Returns their
    properties."""
    row = side_by_side(layout, context, "Sticker", "Picture Sticker...")
    plain = row.operator(AddSticker.bl_idname, text="Sticker", icon="MESH_PLANE")
    from_picture = row.operator(AddSticker.bl_idname, text="Picture Sticker...", icon="IMAGE_DATA")
    from_picture.from_picture = True
    return plain, from_picture


def _draw_matter(layout, grating) -> None:
    column = layout.column(align=True)
    column.prop(grating, "matter", text="")
    if grating.matter != "DIELECTRIC":
        column.prop(grating, "plate_ior", text="Plate")
    if grating.matter == LAYERS:
        column.prop(grating, "layers", text="")


def _shown_node(context, grating):
    """The Diffraction node that the dials set: of the active object if it shows the grating, else of the grating's own
    material. None without either."""
    from ..materials.material import diffraction_nodes  # a file without a grating never needs it

    group = grating.group
    active = getattr(context, "active_object", None)
    slots = [] if active is None else [slot.material for slot in active.material_slots]
    for material in (*slots, grating.material):
        for node in diffraction_nodes(material):
            if group is not None and node.node_tree == group:
                return node
    return None


def _draw_dials(layout, node, *, is_dielectric: bool) -> None:
    from ..materials.group_properties import paint_of
    from ..materials.holograms.hologram_nodes import input_set_by_artist

    column = layout.column(align=True)
    for name, word in _DIALS:
        if name not in node.inputs or (name == "IOR" and not is_dielectric):  # a baked matter ignores the node's IOR
            continue
        socket = input_set_by_artist(node, name)
        row = column.row(align=True)
        painted = paint_of(socket) is not None
        if socket.is_linked:
            text = "{input}: painted" if painted else "{input}: by nodes"
            row.label(text=translated(text, input=translated(word)), icon="NODETREE")
        else:
            row.prop(socket, "default_value", text=word)
        if name in _PAINTED and (painted or not socket.is_linked):
            row.operator(PaintInput.bl_idname, text="", icon="BRUSH_DATA").input = name
        if painted:
            row.operator(UnpaintInput.bl_idname, text="", icon="X").input = name


def _draw_choices(layout, grating, facts: GratingFacts) -> None:
    column = layout.column(align=True)
    chosen = {name: label for name, label, _ in KINDS}[stored.choice(grating.frame_kind, FRAMES, STORED)]
    row = column.split(factor=_LABEL)
    row.label(text="Direction")
    row.operator(ChooseDirection.bl_idname, text=translated(chosen), icon="ORIENTATION_LOCAL")
    row = column.split(factor=_LABEL)
    row.label(text="Variation")
    row.operator(VaryGrating.bl_idname, text=facts.variation, icon="MOD_NOISE")
    row = column.split(factor=_LABEL)
    row.label(text="Pattern")
    row.operator_menu_enum(AddHologram.bl_idname, "pattern", text=translated(facts.hologram), icon="MESH_GRID")


def _draw_comb(layout) -> None:
    if CombGrating.job is not None:
        draw_progress(layout, CombGrating)
    else:
        layout.operator_menu_enum(CombGrating.bl_idname, "source", text=CombGrating.bl_label, icon="FORCE_WIND")

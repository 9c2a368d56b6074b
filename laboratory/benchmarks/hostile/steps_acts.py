# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist does to a scene besides pressing the extension's buttons, for random sessions (steps_session.py).

Each act draws what it needs, and does nothing if the scene lacks it."""

from collections.abc import Callable
from pathlib import Path
from random import Random

Act = Callable[[Random], None]


def _data():
    import bpy

    return bpy.data


def _context():
    import bpy

    return bpy.context


def _some(random: Random, things) -> object | None:
    """A random one of some things, or None if there are none."""
    held = list(things)
    return random.choice(held) if held else None


def _object(random: Random) -> object | None:
    return _some(random, _context().view_layer.objects)


def _in_object_mode() -> bool:
    return _context().mode == "OBJECT"


def _grating(random: Random) -> object | None:
    return _some(random, _context().scene.natural_gratings.items)


def add_mesh(random: Random) -> None:
    """Add a mesh, which is then selected."""
    import bpy

    if _in_object_mode():
        random.choice((bpy.ops.mesh.primitive_plane_add, bpy.ops.mesh.primitive_uv_sphere_add))()


def add_lamp(random: Random) -> None:
    """Add a lamp of a random type."""
    import bpy

    if _in_object_mode():
        bpy.ops.object.light_add(type=random.choice(("SUN", "POINT", "SPOT", "AREA")), location=(0, 1, 3))


def add_curve(random: Random) -> None:
    """Add a curve, for a snake or a comb to follow."""
    import bpy

    if _in_object_mode():
        bpy.ops.curve.primitive_bezier_curve_add()


def select(random: Random) -> None:
    """Select random objects; one of them, or another, becomes active."""
    if not _in_object_mode():
        return
    layer = _context().view_layer
    for each in layer.objects:
        each.select_set(random.random() < 0.4)
    layer.objects.active = _object(random)


def select_mesh(random: Random) -> None:
    """Select a single mesh and make it active."""
    meshes = [each for each in _context().view_layer.objects if each.type == "MESH"]
    if not (_in_object_mode() and meshes):
        return
    for each in _context().view_layer.objects:
        each.select_set(False)
    chosen = random.choice(meshes)
    chosen.select_set(True)
    _context().view_layer.objects.active = chosen


def delete_selected(random: Random) -> None:
    """Delete the selected objects, as the X key does."""
    import bpy

    if _in_object_mode() and _context().selected_objects:
        bpy.ops.object.delete()


def delete_object(random: Random) -> None:
    """Delete an object from the file."""
    if _in_object_mode() and (thing := _object(random)):
        _data().objects.remove(thing)


def duplicate(random: Random) -> None:
    """Duplicate the selected objects, with their data or linked to it."""
    import bpy

    if _in_object_mode() and _context().selected_objects:
        bpy.ops.object.duplicate(linked=random.random() < 0.5)


def hide(random: Random) -> None:
    """Hide an object in one of three ways, or show it again."""
    if thing := _object(random):
        name = random.choice(("hide_viewport", "hide_render"))
        setattr(thing, name, not getattr(thing, name))
        thing.hide_set(random.random() < 0.3)


def rename(random: Random) -> None:
    """Rename an object, a material, a node group, a picture, a scene or a grating."""
    kinds = (_data().objects, _data().materials, _data().node_groups, _data().images, _data().scenes)
    things = _context().scene.natural_gratings.items if random.random() < 0.4 else random.choice(kinds)
    if thing := _some(random, things):
        thing.name = random.choice(("Renamed", "Diffraction", "", "x" * 80, "\u00fcml\u00e4ut"))


def change_socket(random: Random) -> None:
    """Change an input of a group node of a material."""
    nodes = [
        node for each in _data().materials if each.node_tree for node in each.node_tree.nodes if node.type == "GROUP"
    ]
    sockets = [socket for node in nodes for socket in node.inputs if socket.type == "VALUE"]
    if socket := _some(random, sockets):
        socket.default_value = random.choice((0.0, 0.5, 1.0, 3.0))


def delete_node(random: Random) -> None:
    """Delete a node of a material."""
    trees = [each.node_tree for each in _data().materials if each.node_tree]
    if node := _some(random, (node for tree in trees for node in tree.nodes)):
        node.id_data.nodes.remove(node)


def _deletes(collection: str) -> Act:
    """An act that deletes a data-block from the file."""

    def delete(random: Random) -> None:
        held = getattr(_data(), collection)
        if thing := _some(random, held):
            held.remove(thing)

    return delete


def copy_material(random: Random) -> None:
    """Make a slot's material a single-user copy."""
    slots = [slot for each in _data().objects for slot in each.material_slots if slot.material]
    if slot := _some(random, slots):
        slot.material = slot.material.copy()


def choose_grating(random: Random) -> None:
    """Make another grating active."""
    gratings = _context().scene.natural_gratings
    gratings.active_index = random.randrange(max(1, len(gratings.items)))


def change_grating(random: Random) -> None:
    """Change a field of a grating in the panel."""
    if grating := _grating(random):
        name, values = random.choice((
            ("delta_e", (0.5, 3.0, 20.0)), ("coherence_um", (0.0, 10.0)),
            ("spread_deg", (0.0, 3.0)), ("matter", ("GOLD", "DIELECTRIC", "LAYERS")),
            ("shadows", (True, False)), ("footprint", (True, False)),
            ("every_lamp", (True, False)), ("lights", ("LAMPS", "REST", "ALL")),
            ("size_um", (0.0, 4.0)), ("source", ("", "sample:blazed")), ("bake_path", ("", "//nowhere.exr")),
        ))  # fmt: skip
        items = grating.bl_rna.properties[name]
        known = [item.identifier for item in items.enum_items] if items.type == "ENUM" else values
        setattr(grating, name, random.choice(known))


def change_frame(random: Random) -> None:
    """Go to another frame."""
    _context().scene.frame_set(random.randrange(1, 250))


def animate(random: Random) -> None:
    """Insert a key on an object's place."""
    if thing := _object(random):
        thing.keyframe_insert("location", frame=random.randrange(1, 50))


def switch_scene(random: Random) -> None:
    """Show another scene."""
    if _in_object_mode():
        _context().window.scene = random.choice(list(_data().scenes))


def new_scene(random: Random) -> None:
    """Make a scene: a new one, or a copy of this one."""
    import bpy

    if _in_object_mode() and len(_data().scenes) < 5:
        bpy.ops.scene.new(type=random.choice(("NEW", "EMPTY", "LINK_COPY", "FULL_COPY")))


def delete_scene(random: Random) -> None:
    """Delete the present scene, if there is another."""
    import bpy

    if _in_object_mode() and len(_data().scenes) > 1:
        bpy.ops.scene.delete()


def join(random: Random) -> None:
    """Join the selected meshes."""
    import bpy

    if _in_object_mode() and bpy.ops.object.join.poll():
        bpy.ops.object.join()


def toggle_edit(random: Random) -> None:
    """Enter or leave Edit Mode."""
    import bpy

    if bpy.ops.object.mode_set.poll() and _can_edit(_context().active_object):
        bpy.ops.object.mode_set(mode="EDIT" if _in_object_mode() else "OBJECT")


def _can_edit(thing) -> bool:
    return thing.visible_get() and thing.type in ("MESH", "CURVE", "ARMATURE")


def choose_engine(random: Random) -> None:
    """Choose another render engine, or Open Shading Language."""
    scene = _context().scene
    scene.render.engine = random.choice([item.identifier for item in _engines(scene)])
    scene.cycles.shading_system = random.random() < 0.5


def _engines(scene):
    import bpy

    names = {"CYCLES", "BLENDER_EEVEE" if bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT"}
    return [item for item in scene.render.bl_rna.properties["engine"].enum_items if item.identifier in names]


def change_world(random: Random) -> None:
    """Change the world's strength, or remove the world."""
    scene = _context().scene
    if scene.world is None:
        scene.world = _some(random, _data().worlds) or _data().worlds.new("World")
    elif random.random() < 0.2:
        scene.world = None
    elif node := scene.world.node_tree and scene.world.node_tree.nodes.get("Background"):
        node.inputs["Strength"].default_value = random.choice((0.0, 1.0, 2.0))


def save_copy(random: Random) -> None:
    """Save a copy of the file."""
    import bpy

    bpy.ops.wm.save_as_mainfile(filepath=str(Path(bpy.app.tempdir) / "saved.blend"), copy=True)


# The acts, and how often each is done.
ACTS: dict[str, tuple[int, Act]] = {
    "add mesh": (4, add_mesh),
    "add lamp": (2, add_lamp),
    "add curve": (1, add_curve),
    "select": (5, select),
    "select a mesh": (9, select_mesh),
    "delete selected": (1, delete_selected),
    "delete an object": (2, delete_object),
    "duplicate": (2, duplicate),
    "hide": (2, hide),
    "rename": (4, rename),
    "change a socket": (3, change_socket),
    "delete a node": (1, delete_node),
    "delete a picture": (2, _deletes("images")),
    "delete a node group": (2, _deletes("node_groups")),
    "delete a material": (1, _deletes("materials")),
    "delete a lamp's data": (1, _deletes("lights")),
    "delete a mesh's data": (1, _deletes("meshes")),
    "copy a material": (2, copy_material),
    "choose a grating": (4, choose_grating),
    "change a grating": (3, change_grating),
    "change frame": (2, change_frame),
    "animate": (1, animate),
    "switch scene": (3, switch_scene),
    "new scene": (1, new_scene),
    "delete scene": (1, delete_scene),
    "join": (1, join),
    "toggle Edit Mode": (3, toggle_edit),
    "choose an engine": (3, choose_engine),
    "change the world": (2, change_world),
    "save a copy": (1, save_copy),
}

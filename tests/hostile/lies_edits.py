# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of the extension's nodes, drivers, pictures, meshes and pointers: deleted, renamed, swapped, retyped."""

from collections.abc import Callable
from functools import partial

from .lying_scene import Skin

Lie = Callable[[Skin], None]


def _scene_drivers(it: Skin):
    return [curve.driver for curve in it.scene.animation_data.drivers]


def _no_variables(it: Skin) -> None:
    for driver in _scene_drivers(it):
        while driver.variables:
            driver.variables.remove(driver.variables[0])


def _targets(find: Callable[[Skin], object], it: Skin, kind: str = "OBJECT") -> None:
    for driver in _scene_drivers(it):
        for variable in driver.variables:
            if variable.type == "SINGLE_PROP":
                variable.targets[0].id_type = kind
                variable.targets[0].id = find(it)


def _drivers(name: str, value: object, it: Skin) -> None:
    for driver in _scene_drivers(it):
        setattr(driver, name, value)


def _variables(name: str, value: object, it: Skin) -> None:
    for driver in _scene_drivers(it):
        for variable in driver.variables:
            setattr(variable, name, value)


def _some_drivers_removed(it: Skin) -> None:
    for curve in list(it.scene.animation_data.drivers)[::3]:
        it.scene.animation_data.drivers.remove(curve)


def _keyed(it: Skin) -> None:
    for curve in it.scene.animation_data.drivers:
        curve.keyframe_points.add(2)


def _drivers_of_nodes(it: Skin) -> None:
    for curve in it.group.animation_data.drivers:
        while curve.driver.variables:
            curve.driver.variables.remove(curve.driver.variables[0])


_TREES: dict[str, Callable[[Skin], object]] = {
    "the Diffraction group": lambda it: it.group,
    "the second's group": lambda it: it.second.group,
    "the response": lambda it: it.response.group,
    "the response to the world": lambda it: it.response.world,
    "the Lamp group": lambda it: it.addon.lamp_group.lamp_group(),
}


def _cleared(tree) -> None:
    tree.nodes.clear()


def _unlinked(tree) -> None:
    tree.links.clear()


def _without_ends(tree) -> None:
    for node in [node for node in tree.nodes if node.type in ("GROUP_INPUT", "GROUP_OUTPUT")]:
        tree.nodes.remove(node)


def _without_groups(tree) -> None:
    for node in [node for node in tree.nodes if node.type in ("GROUP", "TEX_IMAGE")]:
        tree.nodes.remove(node)


def _every_third_node(tree) -> None:
    for node in list(tree.nodes)[::3]:
        tree.nodes.remove(node)


def _relabelled(tree) -> None:
    for node in tree.nodes:
        node.label = "Response 2" if node.label == "Response" else "nonsense"


def _sockets(tree):
    return [item for item in tree.interface.items_tree if item.item_type == "SOCKET"]


def _no_sockets(tree) -> None:
    tree.interface.clear()


def _first_socket_removed(tree) -> None:
    tree.interface.remove(_sockets(tree)[0])


def _last_socket_removed(tree) -> None:
    tree.interface.remove(_sockets(tree)[-1])


def _renamed_sockets(tree) -> None:
    for number, socket in enumerate(_sockets(tree)):
        socket.name = f"nonsense {number}"


def _one_name(tree) -> None:
    for socket in _sockets(tree):
        socket.name = "Normal"


def _retyped_sockets(tree) -> None:
    for socket in _sockets(tree):
        socket.socket_type = "NodeSocketColor"


def _more_sockets(tree) -> None:
    tree.interface.new_panel("Panel")
    for in_out in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("More", in_out=in_out, socket_type="NodeSocketShader")


def _reversed_sockets(tree) -> None:
    for item in _sockets(tree):
        tree.interface.move(item, 0)


def _no_properties(tree) -> None:
    for name in [name for name in tree.keys() if name.startswith("ng_")]:  # noqa: SIM118  (not a dictionary)
        del tree[name]


# The number of node trees to edit.
TREES = len(_TREES)
_TREE_EDITS = {
    "has no nodes": _cleared,
    "has no links": _unlinked,
    "has no ends": _without_ends,
    "lost its groups and pictures": _without_groups,
    "lost every third node": _every_third_node,
    "is labelled otherwise": _relabelled,
    "has no sockets": _no_sockets,
    "lost its first socket": _first_socket_removed,
    "lost its last socket": _last_socket_removed,
    "has renamed sockets": _renamed_sockets,
    "has one name for all sockets": _one_name,
    "has colours for sockets": _retyped_sockets,
    "has more sockets": _more_sockets,
    "has its sockets reversed": _reversed_sockets,
    "lost its properties": _no_properties,
}


def _of_tree(find, edit, it: Skin) -> None:
    edit(find(it))


def _inner(find: Callable[[Skin], object], it: Skin) -> None:
    """Point the Response node to another group."""
    for node in it.group.nodes:
        if node.label == "Response":
            node.node_tree = find(it)


def _remapped(find: Callable[[Skin], object], it: Skin) -> None:
    it.group.user_remap(find(it))


def _new_tree(kind: str, _: Skin):
    import bpy

    return bpy.data.node_groups.new("Other", kind)


def _other_material(it: Skin) -> None:
    import bpy

    it.first.material = bpy.data.materials.new("Other")


def _stroke_material(it: Skin) -> None:
    import bpy

    made = bpy.data.materials.new("Stroke")
    bpy.data.materials.create_gpencil_data(made)
    it.material.user_remap(made)


def _material_nodes(it: Skin) -> None:
    it.material.node_tree.nodes.clear()


def _material_outputs(it: Skin) -> None:
    for node in [node for node in it.material.node_tree.nodes if node.type == "OUTPUT_MATERIAL"]:
        it.material.node_tree.nodes.remove(node)


def _material_shows(find: Callable[[Skin], object], it: Skin) -> None:
    for node in it.material.node_tree.nodes:
        if node.type == "GROUP":
            node.node_tree = find(it)


def _gone_library(what: str, it: Skin) -> None:
    """Replace a part by a link to a file that no longer exists."""
    import os

    import bpy

    block = {"groups": it.group, "materials": it.material, "objects": it.plane}[what]
    kind = "node_groups" if what == "groups" else what
    path = bpy.path.abspath("//library.blend")
    bpy.data.libraries.write(path, {block})
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        setattr(wanted, kind, [block.name])
    linked = next(each for each in getattr(bpy.data, kind) if each.library is not None)
    if what == "objects":
        it.scene.collection.objects.link(linked)
    else:
        block.user_remap(linked)
    os.unlink(path)


def _attribute(name: str, kind: str, domain: str, it: Skin) -> None:
    present = it.plane.data.attributes.get(name)
    if present is not None:
        it.plane.data.attributes.remove(present)
    it.plane.data.attributes.new(name, kind, domain)


def _picture(edit: Callable[[object], None], it: Skin) -> None:
    edit(it.picture)
    edit(it.frame_map)


def _sockets_are_wild(it: Skin) -> None:
    for node in it.addon.material.diffraction_nodes(it.material):
        for socket in node.inputs:
            if socket.type == "VALUE":
                socket.default_value = float("nan")


def _many_gratings(it: Skin) -> None:
    for _ in range(500):
        it.scene.natural_gratings.items.add().name = "waves"


def _index(value: int, it: Skin) -> None:
    it.scene.natural_gratings.active_index = value


def _lamp(name: str, value: object, it: Skin) -> None:
    setattr(it.sun.data, name, value)


def _removed(kind: str, name: str, _: Skin) -> None:
    import bpy

    blocks = getattr(bpy.data, kind)
    blocks.remove(blocks[name])


def _set(path: str, value: object, it: Skin) -> None:
    owner, _, name = path.rpartition(".")
    for part in owner.split("."):
        it = getattr(it, part)
    setattr(it, name, value)


def of_trees() -> dict[str, Lie]:
    """Edits of the node groups by name: the first edit of each group, then the second edit of each group, and so on."""
    return {
        f"{tree} {name}": partial(_of_tree, find, edit)
        for name, edit in _TREE_EDITS.items()
        for tree, find in _TREES.items()
    }


def of_parts() -> dict[str, Lie]:
    """Edits of drivers, materials, gratings, pictures and meshes, by name."""
    found: dict[str, Lie] = {
        "drivers have no variables": _no_variables,
        "drivers read nothing": partial(_targets, lambda it: None),
        "drivers read a mesh's object": partial(_targets, lambda it: it.plane),
        "drivers read a material": partial(_targets, lambda it: it.material, kind="MATERIAL"),
        "drivers are sums": partial(_drivers, "type", "SUM"),
        "drivers have another expression": partial(_drivers, "expression", "nonsense("),
        "drivers' variables are of another type": partial(_variables, "type", "LOC_DIFF"),
        "drivers' variables have another name": partial(_variables, "name", "other"),
        "every third driver is removed": _some_drivers_removed,
        "drivers have keys": _keyed,
        "the scene's animation is removed": lambda it: it.scene.animation_data_clear(),
        "the nodes' drivers have no variables": _drivers_of_nodes,
        "the nodes' animation is removed": lambda it: it.group.animation_data_clear(),
        "the material has no nodes": _material_nodes,
        "the material has no output": _material_outputs,
        "the material shows the response": partial(_material_shows, lambda it: it.response.group),
        "the material's sockets are no numbers": _sockets_are_wild,
        "the grating's material is another": _other_material,
        "the grating's material draws strokes": _stroke_material,
        "the grating's group is the Lamp group": partial(_remapped, lambda it: it.addon.lamp_group.lamp_group()),
        "the grating's group is its response": partial(_remapped, lambda it: it.response.group),
        "the grating's group is the second's": partial(_remapped, lambda it: it.second.group),
        "the grating's group is empty": partial(_remapped, partial(_new_tree, "ShaderNodeTree")),
        "the grating's group is geometry nodes": partial(_remapped, partial(_new_tree, "GeometryNodeTree")),
        "the inner group is none": partial(_inner, lambda it: None),
        "the inner group is the Lamp group": partial(_inner, lambda it: it.addon.lamp_group.lamp_group()),
        "the inner group is empty": partial(_inner, partial(_new_tree, "ShaderNodeTree")),
        "the inner group is the second's skin": partial(_inner, lambda it: it.second.group),
        "the picture is a movie": partial(_picture, lambda image: setattr(image, "source", "MOVIE")),
        "the picture is generated": partial(_picture, lambda image: setattr(image, "source", "GENERATED")),
        "the picture has tiles": partial(_picture, lambda image: setattr(image, "source", "TILED")),
        "the picture is small": partial(_picture, lambda image: image.scale(1, 1)),
        "the picture is sRGB": partial(_picture, lambda image: setattr(image.colorspace_settings, "name", "sRGB")),
        "the picture is the direction map": lambda it: it.picture.user_remap(it.frame_map),
        "the comb is of faces": partial(_attribute, "grating_comb", "FLOAT", "FACE"),
        "the comb is of points": partial(_attribute, "grating_comb", "INT", "POINT"),
        "the singular faces are colours": partial(_attribute, "grating_singular", "FLOAT_COLOR", "POINT"),
        "the rest position is of faces": partial(_attribute, "rest_position", "BOOLEAN", "FACE"),
        "the mesh has no faces": lambda it: it.plane.data.clear_geometry(),
        "the lamp's strength is infinite": partial(_lamp, "energy", float("inf")),
        "the lamp is a spot": partial(_lamp, "type", "SPOT"),
        "the world has no nodes": lambda it: it.scene.world.node_tree.nodes.clear(),
        "the world is removed": partial(_set, "scene.world", None),
        "the camera is the plane": lambda it: setattr(it.scene, "camera", it.plane),
        "the camera is removed": partial(_removed, "objects", "Camera"),
        "the Diffraction Lamp has no nodes": lambda it: it.diffraction_lamp.data.node_tree.nodes.clear(),
        "the Diffraction Lamp is a point": lambda it: setattr(it.diffraction_lamp.data, "type", "POINT"),
        "the collection of a lamp is removed": partial(_removed, "collections", "Held"),
        "there are 500 gratings of one name": _many_gratings,
    }
    for value in (10**6, -5):
        found[f"the active grating is {value}"] = partial(_index, value)
    for what in ("groups", "materials", "objects"):
        found[f"{what} are linked from a file that is gone"] = partial(_gone_library, what)
    return found

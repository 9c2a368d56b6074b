# SPDX-License-Identifier: GPL-3.0-or-later
"""The Diffraction node group and the materials that hold it.

| socket            | symbol | default | meaning |
|-------------------|--------|---------|---------|
| Base              |        | black   | the shader under the relief: what the material was without diffraction |
| Base Blend        | wd     | 0       | 0 is a physical coat; the thesis's texture blending (Algorithm 4) takes 0.1 |
| Normal, Tangent   | N, T   | surface's, UV map's U | frame of the scan; only for links |
| Strength          |        | 1       | scales the diffraction; 1 is physical |
| Rotation          |        | 0       | radians; turns the scan about the normal, from T towards B |
| Roughness, IOR, Period Scale, Height Scale, Energy Conserving | | | see direct.py |
| Shader (out)      |        |         | the material |
| Diffraction (out) |        |         | its diffracted radiance alone, also an AOV of that name |

    Shader = (1 - F + wd) Base + (1 - wd) Strength sum over lamps of Lo,   F = Fresnel reflectance towards the viewer

One sub-group tells what a lamp sends (key_light.py), one what the surface answers (direct.py, osl.py,
osl_direct.py).
"""

import bpy

from ..frames.frame import frame_nodes
from ..lamps.follow import lamp_count
from ..lamps.group import lamp_group
from ..lamps.link import UNLINKED
from ..lamps.pack import property_name
from ..nodes.arrange import arrange
from ..nodes.builder import Tree, Value
from ..nodes.interface import Socket, add_interface
from .response import CONSERVING, HEIGHT_SCALE, IOR, PERIOD_SCALE, ROUGHNESS
from .shadow import hit

AOV_NAME = "Diffraction"


# On a Diffraction group: for each lamp whether it is linked to some objects only; whether lamps cast shadow rays.
_KEYS, _SHADOWS = "ng_keys", "ng_shadows"


_RESPONSE = "Response"


_INPUTS = (
    Socket("Base", "Shader", "The material under the relief"),
    Socket("Base Blend", "Float", "0: a physical coat. 0.1: the thesis's texture blending", 0.0, 0.0, 1.0, "FACTOR"),
    Socket("Strength", "Float", "Scales the diffraction; 1 is physical", 1.0, 0.0, 1000.0),
    ROUGHNESS,
    IOR,
    Socket("Rotation", "Float", "Turns the scan about the normal", 0.0, -1e3, 1e3, "ANGLE"),
    PERIOD_SCALE,
    HEIGHT_SCALE,
    CONSERVING,
    Socket("Normal", "Vector", "Shading normal; the surface's own if nothing is linked"),
    Socket("Tangent", "Vector", "Direction of the scan's columns; the UV map's U if nothing is linked"),
)


_OUTPUTS = (
    Socket("Shader", "Shader", "The whole material"),
    Socket("Diffraction", "Color", "The diffracted radiance alone"),
)


def group_around(name: str, response: bpy.types.NodeTree, shadows: bool = True) -> bpy.types.NodeTree:
    """The Diffraction group of what a surface answers to one lamp."""
    group = bpy.data.node_groups.new(f"Diffraction {name}", "ShaderNodeTree")
    add_interface(group, _INPUTS, _OUTPUTS)
    group[_SHADOWS] = shadows
    fill_group(group, response)
    return group


def fill_group(group: bpy.types.NodeTree, response: bpy.types.NodeTree) -> None:
    """Make a Diffraction group's nodes anew; its sockets, and so what is linked to them, stay."""
    group.nodes.clear()
    lamps = group[_KEYS] = _lamps_of_file()
    tree = Tree(group)
    node = tree.node("NodeGroupInput")
    inputs = {socket.name: tree.value(socket) for socket in node.outputs if socket.name}
    n, t = frame_nodes(tree, inputs)
    geometry = tree.node("ShaderNodeNewGeometry")
    wr = tree.value(geometry.outputs["Incoming"])
    cos_r = tree.dot(wr, n)
    # Found by diffuse bounces at random, the glow would be fireflies on the floor: those see none.
    bounced = tree.value(tree.node("ShaderNodeLightPath").outputs["Is Diffuse Ray"])
    strength = inputs["Strength"] * (1.0 - inputs["Base Blend"])
    settings = {
        socket.name.replace(" ", "_"): inputs[socket.name]
        for socket in (ROUGHNESS, IOR, PERIOD_SCALE, HEIGHT_SCALE, CONSERVING)
    }
    start = _above_surface(tree, geometry) if group[_SHADOWS] else None
    shader = colour = None
    for index, linked in enumerate(lamps):
        key = tree.group(lamp_group(index, linked), label=f"Lamp {index}")
        wi, irradiance = key["To Light"], key["Irradiance"]
        # All are positive, and no cosine is over 1, which is what a diffuse ray has.
        least = tree.minimum(tree.minimum(cos_r, tree.dot(wi, n)), tree.dot(irradiance, (1.0, 1.0, 1.0)))
        lit = tree.math("GREATER_THAN", least, bounced)
        answer = tree.group(
            response, label=_RESPONSE, Normal=n, Tangent=t, To_Light=wi, Irradiance=irradiance,
            Variance=key["Variance"], **settings,
        )  # fmt: skip
        glow = tree.emission(answer["Finer"], strength)
        radiance = answer["Finer"]
        if "Coarser" in answer:
            glow = tree.mix_shader(answer["Coarser Share"], glow, tree.emission(answer["Coarser"], strength))
            share = tree.maximum(tree.minimum(answer["Coarser Share"], 1.0), 0.0)
            radiance = tree.mix(share, radiance, answer["Coarser"])
        if start is not None:
            visible = 1.0 - key["Shadow"] * hit(tree, start, wi, key["Distance"])
            glow = tree.mix_shader(visible, None, glow)
            radiance = radiance * visible
        # What is dark is not evaluated (Cycles).
        glow = tree.mix_shader(lit, None, glow)
        radiance = radiance * lit
        shader = tree.add_shader(shader, glow)
        colour = radiance if colour is None else colour + radiance

    shader = tree.add_shader(shader, tree.mix_shader(tree.fresnel(inputs["IOR"], n), inputs["Base"], None))
    shader = tree.add_shader(shader, tree.mix_shader(inputs["Base Blend"], None, inputs["Base"]))
    colour = colour * strength
    aov = tree.node("ShaderNodeOutputAOV", colour)
    aov.aov_name = AOV_NAME
    output = tree.node("NodeGroupOutput")
    for socket, value in zip(output.inputs, (shader, colour), strict=False):
        tree.feed(socket, value)
    arrange(group)


def _above_surface(tree: Tree, geometry: bpy.types.Node) -> Value:
    """Where shadow rays start: a tenth of a pixel above the surface, else they hit the neighbour of a triangle on
    whose edge they start."""
    position, normal = (tree.value(geometry.outputs[name]) for name in ("Position", "True Normal"))
    away = tree.value(tree.node("ShaderNodeCameraData").outputs["View Distance"])
    return normal.times_plus(away * 1e-4, position)


def is_diffraction(group: bpy.types.NodeTree | None) -> bool:
    return group is not None and _KEYS in group


def linked_with_fewer_lamps(scene: bpy.types.Scene) -> list[str]:
    """Linked Diffraction groups, which cannot grow, that know fewer lamps than the scene follows; a line for each."""
    count = lamp_count(scene)
    groups = [g for g in bpy.data.node_groups if is_diffraction(g) and g.library is not None and len(g[_KEYS]) < count]
    return [f"{g.name}: linked, it knows {len(g[_KEYS])} of {count} lamps; make it local" for g in groups]


def show_lamps() -> None:
    """Give the file's Diffraction groups as many lamps as a scene of it follows, and light linking where they have it.

    What a group has already is left alone: Blender would compile it again."""
    for group in bpy.data.node_groups:
        if is_diffraction(group) and group.library is None:
            wanted = _lamps_of_file()
            if list(group[_KEYS]) != wanted:
                fill_group(group, next(n.node_tree for n in group.nodes if n.label == _RESPONSE))


def _lamps_of_file() -> list[bool]:
    """For each lamp that some scene of the file follows, whether light linking keeps it from some object; one at
    least."""
    count = max(1, *(lamp_count(scene) for scene in bpy.data.scenes))
    return [any(property_name(index, UNLINKED) in o for o in bpy.data.objects) for index in range(count)]

# SPDX-License-Identifier: GPL-3.0-or-later
"""The node builder: a call that does not fit its node raises an error that names the node and its sockets."""

import bpy
import pytest


@pytest.fixture
def tree(addon, scene):
    """A builder in a new group with two inputs and two outputs."""
    group = bpy.data.node_groups.new("Built", "ShaderNodeTree")
    socket = addon.interface.Socket
    inputs, outputs = (
        tuple(socket(name, "Float", "", 0.0) for name in names) for names in (("Half Angle", "IOR"), ("Sum", "Product"))
    )
    addon.interface.add_interface(group, inputs, outputs)
    return addon.builder.Tree(group)


def test_group_inputs_and_outputs_by_name(tree):
    inputs = tree.inputs()
    assert list(inputs) == ["Half Angle", "IOR"]
    tree.output(inputs["Half Angle"] + inputs["IOR"], inputs["Half Angle"] * 2.0)
    outer = type(tree)(bpy.data.node_groups.new("Outer", "ShaderNodeTree"))
    outputs = outer.group(tree.tree, {"Half Angle": 0.5, "IOR": 1.5}, label="Inner")
    assert list(outputs) == ["Sum", "Product"]
    (node,) = outer.tree.nodes
    assert (node.label, node.inputs["Half Angle"].default_value, node.inputs["IOR"].default_value) == (
        "Inner",
        0.5,
        1.5,
    )


def test_an_input_that_the_group_does_not_have(tree):
    outer = type(tree)(bpy.data.node_groups.new("Outer", "ShaderNodeTree"))
    with pytest.raises(TypeError, match="ShaderNodeGroup of 'Built': no input 'Half_Angle' among .* Half Angle, IOR"):
        outer.group(tree.tree, {"Half_Angle": 0.5})


def test_an_output_that_the_group_does_not_have(tree):
    outer = type(tree)(bpy.data.node_groups.new("Outer", "ShaderNodeTree"))
    with pytest.raises(KeyError, match="Summ"):
        outer.group(tree.tree)["Summ"]


@pytest.mark.parametrize("count", [1, 3])
def test_outputs_of_another_number(tree, count):
    with pytest.raises(TypeError, match=f"NodeGroupOutput: {count} values for the sockets Sum, Product"):
        tree.output(*[1.0] * count)


def test_too_many_inputs(tree):
    with pytest.raises(TypeError, match="ShaderNodeMixShader: 4 inputs for the sockets Fac, Shader, Shader|Factor"):
        tree.node("ShaderNodeMixShader", 0.5, 0.5, 0.5, 0.5)


def test_more_inputs_than_an_operation_takes(tree):
    """Blender keeps the third socket of a Math node and disables it."""
    with pytest.raises(TypeError, match="ShaderNodeMath: 2 inputs for the sockets Value"):
        tree.math("SQRT", 2.0, 3.0)
    with pytest.raises(TypeError, match="ShaderNodeMath: 3 inputs for the sockets Value, Value"):
        tree.math("ADD", 1.0, 2.0, 3.0)


def test_a_setting_that_the_node_does_not_know(tree):
    with pytest.raises(TypeError, match="ShaderNodeMath: it has no setting 'opperation'"):
        tree.node("ShaderNodeMath", 1.0, 2.0, opperation="ADD")


def test_a_response_is_asked_only_for_what_it_has(addon, tree):
    """The question has more sockets than this response, which ignores the others by name."""
    response = addon.response
    group = bpy.data.node_groups.new("Answer", "ShaderNodeTree")
    addon.interface.add_interface(group, (response.IOR,), response.ONE_RADIANCE)
    made = response.Response(group)
    assert made.inputs == (response.IOR,)
    radiance = made.to_lamp(tree, dict.fromkeys(response.QUESTION, 1.25))
    (node,) = tree.tree.nodes
    assert radiance.socket == node.outputs["Finer"]
    assert node.inputs["IOR"].default_value == 1.25
    assert response.response_in(tree.tree).group == group


@pytest.mark.parametrize("count", [1, 3])
def test_a_loop_has_the_nodes_of_its_body_once(addon, tree, count):
    """What is the same in all items is no choice. Renders with several lamps test the values."""
    if not addon.compat.HAS_LOOPS:
        pytest.skip("materials of this Blender have no loops")
    bodies = []

    def body(item, state):
        bodies.append(item)
        return [tree.arithmetic("ADD", state[0], item[0]), tree.arithmetic("MULTIPLY", item[1], state[1])]

    items = [(float(turn), (0.0, float(turn), 0.0), 7.0) for turn in range(3)]
    total, product = tree.for_each(items, [0.5, (1.0, 1.0, 1.0)], body)
    assert len(bodies) == 1 and bodies[0][2] == 7.0
    assert not total.is_vector and product.is_vector
    (start,) = (node for node in tree.tree.nodes if node.bl_idname == addon.interface.LOOP)
    assert start.inputs["Iterations"].default_value == 3


def test_an_emission_is_black_where_blender_does_not_know_what_feeds_it(tree):
    """Blender 4.5 shows the socket's own colour in place of a loop. It was white."""
    emission = tree.emission(tree.vector(1.0, 2.0, 3.0), 1.0).socket.node
    assert emission.inputs["Color"].is_linked
    assert tuple(emission.inputs["Color"].default_value[:3]) == (0.0, 0.0, 0.0)

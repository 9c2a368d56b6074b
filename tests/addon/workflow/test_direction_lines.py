# SPDX-License-Identifier: GPL-3.0-or-later
"""The lines that show a direction in the 3D view, as numbers. tests/package/test_direction.py tests their drawing."""

import bpy
import numpy as np
import pytest

from tests.addon.direction.test_seams import grid, turn_uv


def lines_of(addon, thing, source=None):
    source = source or addon.direction_source.DirectionSource()
    return addon.directing.direction_lines(thing, bpy.context.evaluated_depsgraph_get(), source)


def unit(lines) -> np.ndarray:
    along = lines[:, 1] - lines[:, 0]
    return along / np.linalg.norm(along, axis=1, keepdims=True)


def test_arrows_lie_along_t_and_scale_with_the_mesh(scene, addon):
    """On a plane 2 m wide, turned by 0.3 radians: a shaft in the middle of both triangles, with two barbs each."""
    plane = bpy.context.object
    plane.rotation_euler = (0, 0, 0.3)
    bpy.context.view_layer.update()
    lines = lines_of(addon, plane)
    assert lines.arrows.shape == (6, 2, 3) and lines.seams.shape == (0, 2, 3)
    np.testing.assert_allclose(unit(lines.arrows[:2]), [(np.cos(0.3), np.sin(0.3), 0)] * 2, atol=1e-6)
    # 4 m2 for two arrows: they are sqrt(2) m apart, and 0.7 of that long.
    np.testing.assert_allclose(np.linalg.norm(lines.arrows[:2, 1] - lines.arrows[:2, 0], axis=1), 0.7 * np.sqrt(2))
    np.testing.assert_allclose(lines.arrows[2:, 0], np.tile(lines.arrows[:2, 1], (2, 1)))
    assert (unit(lines.arrows[2:]) @ (np.cos(0.3), np.sin(0.3), 0) < 0).all(), "the barbs point forwards"
    assert (lines.arrows[..., 2] > 0).all(), "the surface hides them"


def test_rotation_and_the_object_s_angle_turn_the_arrows(scene, grating, addon):
    bpy.ops.grating.assign()
    plane = bpy.context.object
    bpy.ops.grating.direction(kind="AXIS", axis="X", angle="grating_angle")
    plane["grating_angle"] = 0.2
    (node,) = addon.material.diffraction_nodes(plane.active_material)
    node.inputs["Rotation"].default_value = 0.5
    np.testing.assert_allclose(unit(lines_of(addon, plane).arrows[:2])[0], (np.cos(0.7), np.sin(0.7), 0), atol=1e-6)


def test_seams_are_the_edges_where_u_turns(scene, addon):
    square = grid(8)
    turn_uv(square.data, np.array([polygon.center.x for polygon in square.data.polygons]) < 0, 1)
    seams = lines_of(addon, square).seams
    assert seams.shape == (8, 2, 3)
    np.testing.assert_allclose(seams[..., 0], 0, atol=1e-6)
    assert len(lines_of(addon, square, addon.direction_source.DirectionSource("AXIS")).seams) == 0


def test_there_are_no_more_arrows_than_a_view_can_show(scene, addon):
    assert len(lines_of(addon, grid(100)).arrows) == 3 * 5000


def empty(mesh):
    mesh.data.clear_geometry()


def no_map(mesh):
    mesh.data.uv_layers.remove(mesh.data.uv_layers[0])


def no_area(mesh):
    for corner in mesh.data.uv_layers[0].uv:
        corner.vector = (0, 0)


@pytest.mark.parametrize("spoil", [empty, no_map, no_area])
def test_a_mesh_without_a_direction_has_no_lines(scene, addon, spoil):
    spoil(bpy.context.object)
    bpy.context.object.data.update()
    bpy.context.view_layer.update()
    lines = lines_of(addon, bpy.context.object)
    assert len(lines.arrows) == len(lines.seams) == len(lines.singular) == 0
    assert addon.directing.parts_of(lines) == []


def test_a_mesh_without_seams_shows_its_arrows(scene, addon):
    """Blender cannot make a batch of an empty array."""
    (part,) = addon.directing.parts_of(lines_of(addon, grid(8)))
    assert part.ends.shape == (3 * 2 * 128, 3)


def test_a_ring_lies_around_each_face_where_a_comb_is_singular(scene, addon):
    """On a grid of 64 faces, each 1 m wide: two rings of twelve lines, their radius 0.6 of the arrows' distance."""
    square = grid(8)
    addon.combed_mesh.note_singular(square.data, np.array([6, 7, 40]))
    rings = lines_of(addon, square).singular
    assert rings.shape == (24, 2, 3)
    for number, face in enumerate((3, 20)):
        ring = rings[number::2]
        away = ring - np.array(square.data.polygons[face].center)
        step = np.sqrt(64 / 128)
        np.testing.assert_allclose(np.hypot(away[..., 0], away[..., 1]), 0.6 * step, rtol=1e-5)  # single precision
        np.testing.assert_allclose(away[..., 2], 0.3 * step, rtol=1e-5)
    assert len(lines_of(addon, square, addon.direction_source.DirectionSource("AXIS")).singular) == 0
    addon.combed_mesh.note_singular(square.data, np.empty(0, int))
    assert len(lines_of(addon, square).singular) == 0


def test_a_fault_while_drawing_switches_the_overlay_off_once(scene, addon, capfd, monkeypatch):
    """The error is that of a Blender without a graphics context. This one has one as soon as EEVEE has rendered."""

    def refuse() -> None:
        raise SystemError("GPU functions for drawing are not available in background mode")

    monkeypatch.setattr(addon.directing, "_draw_lines", refuse)
    told = []
    addon.directing.show(True, told.append)
    try:
        for _ in range(2):
            addon.directing._draw()
        assert bpy.app.timers.is_registered(addon.directing._switch_off)
        addon.directing._switch_off()
        assert not addon.directing.is_shown()
        assert len(told) == 1 and "Show Direction was switched off: drawing failed (SystemError" in told[0]
        assert capfd.readouterr().err.count("Show Direction") == 1
    finally:
        addon.directing.show(False)
        bpy.app.timers.unregister(addon.directing._switch_off)


def test_nothing_is_drawn_in_background(scene, addon):
    assert not bpy.ops.grating.show_direction.poll()
    addon.package.direction.set_shown(False)
    assert not addon.package.direction.ShowDirection.on

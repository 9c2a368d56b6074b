# SPDX-License-Identifier: GPL-3.0-or-later
"""Unwrapping in Blender: a new map, the old ones and the grating's direction kept, and one-line errors."""

import importlib
import os
import signal
import time
from pathlib import Path

import bpy
import numpy as np
import pytest

from devtools import EXTENSION
from tests.addon.batch.test_commands import fault
from tests.addon.conftest import reports, select

METHODS = ["XATLAS", "MINIMUM_STRETCH"]


def map_of(mesh, name) -> np.ndarray:
    """The positions (n, 2) of a mesh's corners on a map."""
    uv = np.empty((len(mesh.data.loops), 2), np.float32)
    mesh.data.uv_layers[name].uv.foreach_get("vector", uv.ravel())
    return uv


@pytest.fixture
def monkey(scene):
    """Suzanne, active: she has triangles and quads."""
    bpy.ops.mesh.primitive_monkey_add()
    return bpy.context.object


@pytest.fixture
def carrier(monkey, grating):
    """Suzanne with the grating."""
    assert bpy.ops.grating.assign() == {"FINISHED"}
    return monkey


def areas(mesh, name) -> np.ndarray:
    """The signed areas of a mesh's triangles on a map."""
    mesh.data.calc_loop_triangles()
    a, b, c = (map_of(mesh, name)[[t.loops[k] for t in mesh.data.loop_triangles]] for k in range(3))
    return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


@pytest.mark.night("test_the_seams_of_the_mesh_are_followed")
@pytest.mark.parametrize("method", METHODS)
def test_a_new_map_and_all_else_as_before(monkey, method, capfd):
    before, objects, meshes = map_of(monkey, "UVMap"), len(bpy.data.objects), len(bpy.data.meshes)
    told = reports(lambda: bpy.ops.grating.unwrap(method=method), capfd)
    assert "Suzanne: unwrapped into Unwrapped: " in told
    new = map_of(monkey, "Unwrapped")
    # Within the square to single precision, and with one orientation.
    assert new.min() > -1e-6 and new.max() < 1 + 1e-6
    found = areas(monkey, "Unwrapped")
    assert 0.2 < found.sum() <= 1 and (found > 0).mean() > 0.99
    np.testing.assert_array_equal(map_of(monkey, "UVMap"), before)
    layers = monkey.data.uv_layers
    assert layers.active.name == "Unwrapped" and layers["UVMap"].active_render
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == (objects, meshes)
    assert bpy.context.active_object == monkey and monkey.select_get() and monkey.mode == "OBJECT"
    assert not any(edge.use_seam for edge in monkey.data.edges)


@pytest.mark.night("test_a_mesh_without_a_map_is_told_that_the_new_one_turns")
def test_the_grating_keeps_its_direction(carrier, grating, addon, capfd):
    told = reports(bpy.ops.grating.unwrap, capfd)
    assert "Suzanne: its grating keeps the direction of UVMap" in told
    source = addon.group_properties.frame_of(grating.group)
    assert (source.kind, source.uv_map) == ("UV_MAP", "UVMap")


@pytest.mark.night("test_a_mesh_without_a_map_is_told_that_the_new_one_turns")
def test_a_source_that_the_artist_chose_stays(carrier, grating, addon):
    bpy.ops.grating.direction(kind="AXIS")
    bpy.ops.grating.unwrap()
    assert grating.frame_kind == "AXIS"


@pytest.mark.night("test_another_mesh_without_that_map_keeps_the_default")
def test_a_comb_is_left_alone(carrier, grating, addon, capfd):
    bpy.ops.grating.comb(source="X")
    assert "keeps the direction" not in reports(bpy.ops.grating.unwrap, capfd)
    assert grating.frame_kind == "STORED"


def test_another_mesh_without_that_map_keeps_the_default(carrier, grating, capfd):
    """The map that renders is still the old one on both."""
    bpy.ops.mesh.primitive_plane_add()
    other = bpy.context.object
    other.data.uv_layers[0].name = "Other"
    bpy.ops.grating.assign()
    select(carrier)
    assert "keeps the direction of UVMap" in reports(bpy.ops.grating.unwrap, capfd)
    assert grating.frame_kind == "STORED" and carrier.data.uv_layers["UVMap"].active_render


def test_a_mesh_without_a_map_is_told_that_the_new_one_turns(monkey, capfd):
    monkey.data.uv_layers.remove(monkey.data.uv_layers[0])
    assert "the islands of the new map are rotated, and the colours with them" in reports(bpy.ops.grating.unwrap, capfd)


def test_the_seams_of_the_mesh_are_followed(scene, addon):
    """A tube cut along one line and its rims has three islands: its wall and two lids."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=16)
    tube = bpy.context.object
    for edge in tube.data.edges:
        ends = [tube.data.vertices[index].co for index in edge.vertices]
        edge.use_seam = ends[0].z == ends[1].z or all(end.x < 1e-6 and end.y > 0.99 for end in ends)
    bpy.ops.grating.unwrap(method="MINIMUM_STRETCH")
    assert addon.seams.Seams(tube.data, "Unwrapped").island_count() == 3


def empty(scene):
    mesh = bpy.data.objects.new("Empty Mesh", bpy.data.meshes.new("none"))
    scene.collection.objects.link(mesh)
    return mesh


def flat(scene):
    plane = bpy.data.objects["Plane"]
    for vertex in plane.data.vertices:
        vertex.co = (0, 0, 0)
    return plane


def full(scene):
    plane = bpy.data.objects["Plane"]
    while len(plane.data.uv_layers) < 8:
        plane.data.uv_layers.new()
    return plane


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("make", "told"), [
    (empty, "Empty Mesh: no faces to unwrap; choose a mesh with faces"),
    (flat, "Plane: no face has an area; scale it up, or dissolve degenerate faces"),
    (full, "Plane: it has 8 UV maps, as many as a mesh can have; remove one"),
])  # fmt: skip
def test_what_cannot_be_unwrapped_is_told_and_unchanged(scene, make, told, method):
    mesh = make(scene)
    select(mesh)
    before = [layer.name for layer in mesh.data.uv_layers]
    with pytest.raises(RuntimeError, match=told) as found:
        bpy.ops.grating.unwrap(method=method)
    assert len(str(found.value).strip().splitlines()) == 1
    assert [layer.name for layer in mesh.data.uv_layers] == before


def test_a_linked_mesh_is_told(scene, addon, tmp_path):
    path = tmp_path / "library.blend"
    bpy.data.libraries.write(str(path), {bpy.data.meshes["Plane"]})
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.meshes = ["Plane"]
    linked = bpy.data.objects.new("Linked", wanted.meshes[0])
    scene.collection.objects.link(linked)
    select(linked)
    with pytest.raises(RuntimeError, match="Linked: its mesh is linked from .*library.blend; use Object > Relations"):
        bpy.ops.grating.unwrap()
    bpy.data.libraries.remove(bpy.data.libraries["library.blend"])


def children(process):
    """The numbers of a process's children; waits until there are some."""
    deadline = time.monotonic() + 60
    while not (found := Path(f"/proc/{process}/task/{process}/children").read_text().split()):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return found


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks Linux for the processes")
def test_a_crash_of_xatlas_is_one_line_and_nothing_changes(scene, addon, tmp_path):
    """The process is killed while it works."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=120, ring_count=60)
    mesh = bpy.context.object
    unwrapping = addon.unwrapping.Unwrapping(mesh, addon.unwrapping.Packing())
    (verb,) = children(unwrapping.job._process.pid)
    (keeper,) = children(verb)
    (worker,) = children(keeper)
    os.kill(int(worker), signal.SIGSEGV)
    unwrapping.job.wait()
    with pytest.raises(addon.child.GratingError, match=r"^xatlas: crashed on this mesh \(status 139\); choose Blender"):
        unwrapping.finish()
    assert [layer.name for layer in mesh.data.uv_layers] == ["UVMap"]


def test_cancelling_leaves_nothing(monkey, addon):
    unwrapping = addon.unwrapping.Unwrapping(monkey, addon.unwrapping.Packing())
    folder = unwrapping.job._private.name
    addon.direction.Unwrap.job = unwrapping.job
    assert not bpy.ops.grating.unwrap.poll()
    assert bpy.ops.grating.cancel(follower="grating.unwrap") == {"FINISHED"}
    assert not unwrapping.job.running and not os.path.exists(folder)
    assert len(monkey.data.uv_layers) == 1 and bpy.ops.grating.unwrap.poll()


def test_a_mesh_that_was_edited_meanwhile_is_left_alone(monkey, addon):
    unwrapping = addon.unwrapping.Unwrapping(monkey, addon.unwrapping.Packing())
    monkey.data.polygons[0].flip()
    unwrapping.job.wait()
    with pytest.raises(addon.child.GratingError, match="Suzanne: its faces changed while it was unwrapped"):
        unwrapping.finish()
    assert len(monkey.data.uv_layers) == 1


@pytest.mark.night("test_the_command_line_unwraps_and_saves")
@pytest.mark.parametrize("method", METHODS)
def test_undo_takes_the_map_away(carrier, method):
    bpy.ops.ed.undo_push(message="Before")
    bpy.ops.grating.unwrap(method=method)
    bpy.ops.ed.undo_push(message="Unwrapped")
    bpy.ops.ed.undo()
    mesh = bpy.data.objects["Suzanne"]
    assert [layer.name for layer in mesh.data.uv_layers] == ["UVMap"]
    assert bpy.context.scene.natural_gratings.active().frame_kind == "STORED"


def test_the_command_line_unwraps_and_saves(addon, carrier, tmp_path, capfd):
    blend = tmp_path / "suzanne.blend"
    for method in ("xatlas", "minimum-stretch"):
        line = ["unwrap", "--object", "Suzanne", "--method", method, "--size", "256", "--save", str(blend)]
        assert addon.commands.execute(line) == 0
    assert [layer.name for layer in carrier.data.uv_layers] == ["UVMap", "Unwrapped", "Unwrapped.001"]
    assert blend.is_file()
    assert "no such object" in fault(capfd, addon, "unwrap", "--object", "Nobody")
    assert "no mesh is selected" in fault(capfd, addon, "unwrap", "--object", "Sun")
    assert "--size" in fault(capfd, addon, "unwrap", "--size", "3")


def test_the_time_is_shown_in_words(extension):
    words = importlib.import_module(f"{EXTENSION}.addon.ui.direction_panel").in_words
    assert [words(each) for each in (0.2, 42, 65, 4000, 9000)] == ["1 s", "42 s", "1 min", "1 h", "2 h"]

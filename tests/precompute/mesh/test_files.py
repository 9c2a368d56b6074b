# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh files, and the verb `comb`."""

import io
import json
import os
import struct
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.cli.parser import main
from precompute.mesh import unwrap
from precompute.mesh.comb import comb
from precompute.mesh.mesh_files import read_combed, read_mesh, write_combed, write_mesh

from .shapes import polygons_of, sphere, torus

ALONG_X = {"guide": np.array("axis"), "axis": np.array([1.0, 0, 0])}


def test_a_mesh_and_a_combed_one_come_back(tmp_path):
    polygons = polygons_of(*sphere(2))
    write_mesh(tmp_path / "a.npz", polygons, ALONG_X)
    read, request = read_mesh(tmp_path / "a.npz")
    np.testing.assert_array_equal(read.points, polygons.points)
    np.testing.assert_array_equal(read.corners, polygons.corners)
    assert str(request["guide"]) == "axis" and request["axis"][0] == 1
    combed = comb("a", read, request)
    write_combed(tmp_path / "b.npz", combed)
    np.testing.assert_array_equal(read_combed(tmp_path / "b.npz")["turn"], combed.turn)


@pytest.mark.parametrize(("changes", "fault"), [
    ({"guide": np.array("wish")}, "does not name a guide"), ({"guide": np.array("uv")}, "does not name a guide"),
    ({"point": np.arange(3) + 10**6}, "inconsistent"), ({"corners": np.full((1, 3), -1)}, "inconsistent"),
    ({"normals": np.zeros((1, 3))}, "inconsistent"), ({"face": np.array([1e300])}, "face is of kind float64"),
    ({"guide": np.array("copy"), "uv": np.zeros((2, 2))}, "inconsistent"),
    ({"axis": np.zeros(2)}, r"axis is of kind float64 and shape \(2,\)"),
])  # fmt: skip
def test_a_mesh_that_contradicts_itself_is_refused(tmp_path, changes, fault):
    polygons = polygons_of(np.eye(3), np.array([[0, 1, 2]]))
    arrays = {name: getattr(polygons, name) for name in ("points", "point", "normals", "corners", "face")}
    np.savez(tmp_path / "bad.npz", **(arrays | ALONG_X | changes))
    with pytest.raises(GratingError, match=rf"bad\.npz: .*{fault}"):
        read_mesh(tmp_path / "bad.npz")


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"no archive", None])
def test_what_is_no_mesh_is_refused(tmp_path, content):
    path = tmp_path / "bad.npz"
    if content is not None:
        path.write_bytes(content)
    for read in (read_mesh, read_combed):
        with pytest.raises(GratingError, match=r"bad\.npz: "):
            read(path)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such files")
@pytest.mark.parametrize("make", [os.mkfifo, lambda path: path.symlink_to("/dev/zero"), Path.mkdir])
def test_what_never_ends_is_not_waited_for(tmp_path, make):
    make(tmp_path / "bad.npz")
    for read in (read_mesh, read_combed, unwrap.read_mesh):
        with pytest.raises(GratingError, match=r"bad\.npz: .*\(it is not a file\); "):
            read(tmp_path / "bad.npz")


BOMB = {"points": np.zeros((2, 3)), "triangles": np.zeros((1, 3), int), "polygons": np.zeros(1, int)}


def test_a_shape_of_many_sides_is_not_printed_whole(tmp_path):
    head = b"{'descr': '<f8', 'fortran_order': False, 'shape': (" + 400 * b"9, " + b"9), }\n"
    with zipfile.ZipFile(tmp_path / "bad.npz", "w") as archive:
        archive.writestr("points.npy", b"\x93NUMPY\1\0" + struct.pack("<H", len(head)) + head)
    with pytest.raises(GratingError, match=r"points is of kind float64 and shape \(9, ") as caught:
        read_mesh(tmp_path / "bad.npz")
    assert len(str(caught.value)) < len(str(tmp_path)) + 200


@pytest.mark.parametrize(("old", "new", "told"), [
    (b"(2, 3)", b"(9999999999, 3)", "points is not as long as its header says"),
    (b"'<f8'", b"'|O'", "points is not an array of numbers"),
    (b"'<f8'", b"'<c16'", "points is not an array of numbers"),
    (b"{'descr'", b"{1:'descr'", "points is not an array of numbers"), (b"NUMPY", b"MUNPY", "points is not an array"),
])  # fmt: skip
def test_what_an_array_declares_is_not_believed(tmp_path, old, new, told):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, array in BOMB.items():
            member = io.BytesIO()
            np.save(member, array)
            data = member.getvalue()
            if name == "points":  # the header's padding makes up for a longer text
                longer = len(new) - len(old)
                data = data.replace(old, new, 1).replace(b" " * longer + b"\n", b"\n", 1)
            archive.writestr(f"{name}.npy", data)
    (tmp_path / "bad.npz").write_bytes(out.getvalue())
    with pytest.raises(GratingError, match=rf"bad\.npz: no mesh to unwrap \({told}"):
        unwrap.read_mesh(tmp_path / "bad.npz")


def test_a_file_of_something_else_is_refused(tmp_path):
    np.savez(tmp_path / "bad.npz", guide=np.array("smoothest"))
    for read, fault in ((read_mesh, "holds no mesh"), (read_combed, "not a combed mesh")):
        with pytest.raises(GratingError, match=fault):
            read(tmp_path / "bad.npz")


def test_the_verb_combs_several(tmp_path, capsys):
    for name, mesh in (("ball", sphere(3)), ("ring", torus())):
        write_mesh(tmp_path / f"{name}.npz", polygons_of(*mesh), ALONG_X)
    files = [str(tmp_path / f"{name}.npz") for name in ("ball", "ring")]
    assert main(["comb", *files, "-o", str(tmp_path / "out"), "--json", "-", "--progress", "json"]) == 0
    told = capsys.readouterr()
    meshes = json.loads(told.out)["meshes"]
    assert [mesh["index"] for mesh in meshes] == [2, 0]
    assert json.loads(told.err.splitlines()[-1])["fraction"] == 1
    assert read_combed(tmp_path / "out" / "ring.npz")["uv"].shape == (3 * 4096, 2)


def test_the_verb_writes_nothing_where_one_mesh_fails(tmp_path, capsys):
    write_mesh(tmp_path / "ball.npz", polygons_of(*sphere(2)), ALONG_X)
    write_mesh(tmp_path / "flat.npz", polygons_of(np.zeros((3, 3)), np.array([[0, 1, 2]])), ALONG_X)
    files = [str(tmp_path / name) for name in ("ball.npz", "flat.npz")]
    assert main(["comb", *files, "-o", str(tmp_path / "out")]) == 1
    assert "error: flat: its faces have no area" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert main(["comb", files[0], files[0], "-o", str(tmp_path / "out")]) == 1
    assert "one name" in capsys.readouterr().err

# SPDX-License-Identifier: GPL-3.0-or-later
"""Unwrapping: islands do not overlap, faces stay whole, and every fault is one line."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.cli.parser import main
from precompute.mesh import unwrap as module
from precompute.mesh.unwrap import Mesh, Packing, expected_seconds, read_mesh, unwrap, write_mesh
from precompute.mesh.xatlas_worker import _laid_out, _torn

ROOT = Path(__file__).resolve().parents[3]


def ball(columns=24, rows=12, dents=0.0) -> Mesh:
    """A sphere of quads (two triangles each) without its poles. Dents make it rough, so that it has many islands."""
    u, v = np.meshgrid(np.arange(columns), np.arange(1, rows), indexing="ij")
    longitude, latitude = 2 * np.pi * u / columns, np.pi * v / rows
    radius = 1 + dents * np.random.default_rng(0).standard_normal(u.shape)
    points = np.stack([np.cos(longitude), np.sin(longitude), np.ones(u.shape)], axis=-1)
    points *= np.stack([np.sin(latitude), np.sin(latitude), np.cos(latitude)], axis=-1) * radius[..., None]
    at = np.arange(u.size).reshape(u.shape)
    beside = np.roll(at, -1, axis=0)
    a, b, c, d = at[:, :-1].ravel(), at[:, 1:].ravel(), beside[:, 1:].ravel(), beside[:, :-1].ravel()
    triangles = np.stack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)], axis=1).reshape(-1, 3)
    return Mesh(points.reshape(-1, 3), triangles, np.repeat(np.arange(len(a)), 2))


def coverage(uv: np.ndarray, pixels: int) -> np.ndarray:
    """The number of triangles (m, 3, 2) that cover the middle of each pixel of a square map, without their rims."""
    counts = np.zeros((pixels, pixels), int)
    for triangle in uv * pixels:
        low, high = np.floor(triangle.min(axis=0)).astype(int), np.ceil(triangle.max(axis=0)).astype(int)
        x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
        sides = np.roll(triangle, -1, axis=0) - triangle
        inside = [s[0] * (y - p[1]) - s[1] * (x - p[0]) for s, p in zip(sides, triangle, strict=True)]
        # A rim has no width; a place is on it within the single precision of a map.
        covered = (np.array(inside) > 1e-3).all(axis=0) | (np.array(inside) < -1e-3).all(axis=0)
        counts[low[1] : high[1], low[0] : high[0]] += covered
    return counts


@pytest.mark.parametrize("dents", [0.0, 0.2])
def test_nothing_overlaps_and_no_face_is_torn(dents):
    mesh = ball(dents=dents)
    told = []
    found = unwrap(mesh, Packing(size=256, padding=4), progress=lambda stage, fraction: told.append(fraction))
    assert found.uv.shape == (len(mesh.triangles), 3, 2) and found.uv.min() >= 0 and found.uv.max() <= 1
    assert coverage(found.uv, 256).max() == 1
    assert not _torn(mesh, found.uv.astype(float)).any()
    first, second, third = found.uv.astype(float).transpose(1, 0, 2)
    one, other = second - first, third - first
    assert (one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0] > 0).all(), "an island is mirrored"
    assert found.islands >= 1 and 0.1 < found.filled <= 1
    assert told[-1] == 1.0 and all(np.diff(told) >= 0)


def test_a_rough_ball_has_faces_that_xatlas_would_tear():
    """Ensures that the test above covers torn faces."""
    import xatlas

    mesh = ball(dents=0.2)
    charts = xatlas.Atlas()
    charts.add_mesh(mesh.points.astype(np.float32), mesh.triangles.astype(np.uint32))
    charts.generate()
    _, corners, uv = charts.get_mesh(0)
    assert _torn(mesh, uv[corners].astype(float)).any()


def test_torn_faces_are_laid_out_in_their_own_size():
    square = np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], float)
    turn = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    points = np.concatenate([square @ turn, square + (0, 0, 5)])
    mesh = Mesh(points, np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)]), np.array([0, 0, 1, 1]))
    flat = _laid_out(mesh, np.ones(4, bool))
    ends = points[mesh.triangles]
    for one in range(3):
        wanted = np.linalg.norm(ends[:, one] - ends[:, one - 1], axis=1)
        np.testing.assert_allclose(np.linalg.norm(flat[:, one] - flat[:, one - 1], axis=1), wanted, atol=1e-12)
    np.testing.assert_allclose(flat[0, 2], flat[1, 1], atol=1e-12)
    assert flat[:2].reshape(-1, 2).max(axis=0)[0] < flat[2:].reshape(-1, 2).min(axis=0)[0]


def test_padding_keeps_islands_apart():
    found = unwrap(ball(dents=0.2), Packing(size=256, padding=6))
    assert found.islands > 1
    distance = np.full(len(found.uv), np.inf)
    # Triangles of one island share corners; corners of two islands are further apart than the padding.
    corners = np.round(found.uv.reshape(-1, 2) * 1e6).astype(int)
    _, place = np.unique(corners, axis=0, return_inverse=True)
    place = place.reshape(-1, 3)
    island = np.arange(len(place))
    while True:
        least = np.full(place.max() + 1, len(place))
        np.minimum.at(least, place, island[:, None])
        grown = least[place].min(axis=1)
        if (grown == island).all():
            break
        island = grown
    assert len(np.unique(island)) == found.islands
    for one in np.unique(island):
        mine, others = found.uv[island == one].reshape(-1, 2), found.uv[island != one].reshape(-1, 2)
        distance[one] = np.linalg.norm(mine[:, None] - others[None], axis=-1).min() * 256
    # xatlas rounds islands to whole pixels on both sides, and makes the map up to 1.25 times as large as asked.
    assert distance.min() > (6 - 2) / 1.25


def test_a_density_that_the_map_does_not_hold_is_refused():
    with pytest.raises(GratingError, match="are needed for this density; ask for a larger map, or fewer pixels"):
        unwrap(ball(), Packing(size=64, density=1000))


def test_more_triangles_take_longer():
    """As measured: half a second for 4 thousand, ten minutes for half a million, within a factor of two."""
    assert 0.25 < expected_seconds(4000) < 2 and 300 < expected_seconds(488_000) < 1200


def test_a_mesh_file_comes_back(tmp_path):
    mesh = ball()
    write_mesh(tmp_path / "mesh.npz", mesh)
    found = read_mesh(tmp_path / "mesh.npz")
    for name in ("points", "triangles", "polygons"):
        np.testing.assert_array_equal(getattr(found, name), getattr(mesh, name))


def changed(**arrays):
    mesh = ball()
    return {name: getattr(mesh, name) for name in ("points", "triangles", "polygons")} | arrays


@pytest.mark.parametrize(("arrays", "told"), [
    (changed(points=np.zeros((264, 3))), "no face has an area; scale it up, or dissolve"),
    (changed(triangles=np.zeros((0, 3), int), polygons=np.zeros(0, int)), "no faces to unwrap; choose a mesh"),
    (changed(triangles=np.full((528, 3), 9999)), "no mesh to unwrap|a face has a point that does not exist"),
    (changed(points=np.full((264, 3), np.nan)), "a point has no position"),
    (changed(points=np.zeros((264, 2))), r"no mesh to unwrap \(points is of kind float64 and shape \(264, 2\)\); give"),
    (changed(points=np.full((264, 3), 1e30)), r"a point more than 1000 km away; delete it, or scale it down"),
    (changed(polygons=np.zeros(3, int)), "no mesh to unwrap"),
    (changed(triangles=np.array([["a"]])), "no mesh to unwrap"),
    ({"points": np.zeros((3, 3))}, "no mesh to unwrap"),
    (changed(points=np.array([None, {}])), "no mesh to unwrap"),
])  # fmt: skip
def test_what_is_no_mesh_is_one_line(tmp_path, capsys, arrays, told):
    path = tmp_path / "mesh.npz"
    np.savez(path, **arrays)
    assert main(["unwrap", str(path), "-o", str(tmp_path / "out")]) == 1
    line = capsys.readouterr().err
    assert line.startswith("error: ") and line.count("\n") == 1
    with pytest.raises(GratingError, match=told):
        read_mesh(path)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 and no more", b"text"])
def test_what_is_no_file_of_arrays_is_one_line(tmp_path, capsys, content):
    path = tmp_path / "mesh.npz"
    path.write_bytes(content)
    assert main(["unwrap", str(path), "-o", str(tmp_path / "out")]) == 1
    assert f"error: {path}: no mesh to unwrap" in capsys.readouterr().err


def test_the_verb_writes_a_map_and_its_facts(tmp_path, capsys):
    write_mesh(tmp_path / "mesh.npz", ball())
    line = ["unwrap", str(tmp_path / "mesh.npz"), "-o", str(tmp_path / "out"), "--json", "-", "--progress", "none"]
    assert main(line) == 0
    facts = json.loads(capsys.readouterr().out)
    with np.load(facts["files"][0]) as file:
        assert file["uv"].shape == (len(ball().triangles), 3, 2)
    assert facts["islands"] >= 1 and facts["seconds"] > 0


def test_without_xatlas_the_remedy_is_told(monkeypatch):
    monkeypatch.setattr(module, "missing_packages", lambda: ["xatlas"])
    with pytest.raises(
        GratingError, match="xatlas: it is not installed for Python 3.*; choose Blender's own Minimum Stretch"
    ):
        unwrap(ball(), Packing())


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """The parent of private folders."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def with_worker(monkeypatch, code):
    """Run other code in place of xatlas."""
    start = module.ChildProcess
    monkeypatch.setattr(
        module, "ChildProcess",
        lambda prepare, environment, **rest: start(
            lambda folder: (prepare(folder), [sys.executable, "-c", code])[1], environment, **rest
        ),
    )  # fmt: skip


def test_a_crash_is_one_line_and_nothing_is_left(monkeypatch, temporary):
    with_worker(monkeypatch, "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    with pytest.raises(GratingError, match=r"xatlas: crashed on this mesh \(status 139\); choose Blender's own"):
        unwrap(ball(), Packing())
    assert list(temporary.iterdir()) == []


def test_an_unwrap_that_never_ends_is_ended(monkeypatch, temporary):
    with_worker(monkeypatch, "import time; time.sleep(60)")
    monkeypatch.setattr(module, "_LEAST_PATIENCE_SECONDS", 0.1)
    monkeypatch.setattr(module, "_PATIENCE", 0)
    with pytest.raises(GratingError, match=r"xatlas: no map of this mesh after \d+ s; choose Blender's own"):
        unwrap(ball(), Packing())
    assert list(temporary.iterdir()) == []


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks Linux for the processes")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_xatlas_ends_with_the_verb(tmp_path, number):
    """A slow mesh; the verb is asked to end, as a cancelled job is, or is killed."""
    write_mesh(tmp_path / "mesh.npz", ball(400, 200, dents=0.05))
    (tmp_path / "temporary").mkdir()
    command = [sys.executable, "-m", "precompute", "unwrap", str(tmp_path / "mesh.npz"), "-o", str(tmp_path / "out")]
    environment = os.environ | {"TMPDIR": str(tmp_path / "temporary")}
    verb = subprocess.Popen(command, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while not (workers := [each for keeper in children(verb.pid) for each in children(keeper)]):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    verb.send_signal(number)
    told = verb.communicate(timeout=60)[1]
    assert number == signal.SIGKILL or "stopped by SIGTERM" in told
    while any(Path(f"/proc/{worker}").exists() for worker in workers) or any((tmp_path / "temporary").iterdir()):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert not (tmp_path / "out").exists()


def children(process):
    """The numbers of a process's children, as texts."""
    try:
        return Path(f"/proc/{process}/task/{process}/children").read_text().split()
    except FileNotFoundError:
        return []

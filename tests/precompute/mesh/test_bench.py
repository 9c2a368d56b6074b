# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of combs."""

import json

import numpy as np

from laboratory.benchmarks import comb


def test_it_tells_time_and_residual_of_each_guide(tmp_path, capsys):
    path = tmp_path / "rows.json"
    assert comb.main(["--faces", "2000", "--guide", "axis", "--guide", "strokes", "--json", str(path)]) == 0
    rows = json.loads(path.read_text())["rows"]
    assert [row["guide"] for row in rows] == ["axis", "strokes"]
    for row in rows:
        assert row["seconds"] > 0 and row["residual"] <= 1e-6 and row["index"] == 0
        assert abs(row["faces"] - 2000) < 200
    assert "residual" in capsys.readouterr().out


def test_its_torus_is_closed_and_faces_outwards():
    mesh = comb.torus(2000)
    a, b, c = mesh.points[mesh.triangles].transpose(1, 0, 2)
    across = np.cross(b - a, c - a)
    assert ((across * mesh.normals[mesh.corners[:, 0]]).sum(axis=1) > 0).all()
    edges = np.stack([mesh.triangles, np.roll(mesh.triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = np.sort(edges, axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()

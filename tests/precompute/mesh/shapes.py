# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of known shape: points (n, 3) and triangles (m, 3), wound anticlockwise from outside."""

import numpy as np

from precompute.mesh.layout import Polygons


def grid(rows, columns, *, closed_rows=False, closed_columns=False):
    """Triangles of a grid of rows x columns points, numbered row by row."""
    i, j = np.meshgrid(np.arange(rows - (not closed_rows)), np.arange(columns - (not closed_columns)), indexing="ij")
    a, b = i * columns + j, (i + 1) % rows * columns + j
    c, d = (i + 1) % rows * columns + (j + 1) % columns, i * columns + (j + 1) % columns
    return np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])


def torus(around=64, across=32, *, radius=1.0, tube=0.4, jitter=0.0):
    """A torus around Z. `jitter`, in steps of the grid, moves each point at random along the surface."""
    random = np.random.default_rng(1).uniform(-0.5, 0.5, (2, around, across)) * jitter
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    u, v = (u + random[0]) * 2 * np.pi / around, (v + random[1]) * 2 * np.pi / across
    ring = radius + tube * np.cos(v)
    points = np.stack([ring * np.cos(u), ring * np.sin(u), tube * np.sin(v)], axis=-1).reshape(-1, 3)
    return points, grid(around, across, closed_rows=True, closed_columns=True)


def sphere(times=4):
    """An octahedron on the unit sphere, whose triangles are cut in four `times` times."""
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    triangles = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    for _ in range(times):
        edges = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
        edges, place = np.unique(edges, axis=0, return_inverse=True)
        (a, b, c), (x, y, z) = triangles.T, (place.reshape(-1, 3) + len(points)).T
        points = np.concatenate([points, points[edges].mean(axis=1)])
        triangles = np.concatenate([np.stack(t, axis=-1) for t in ((a, x, z), (x, b, y), (z, y, c), (x, y, z))])
    return points / np.linalg.norm(points, axis=1, keepdims=True), triangles


def sheet(rows=20, columns=30):
    """An open wavy sheet of 1 by 2."""
    y, x = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 2, columns), indexing="ij")
    points = np.stack([x, y, 0.1 * np.sin(4 * x)], axis=-1).reshape(-1, 3)
    return points, grid(rows, columns)[:, ::-1]


def tube(around=24, along=100, *, length=10.0, thick=0.5, thin=0.2):
    """A tapering tube along X, open at both ends, thick at x = 0."""
    x, v = np.meshgrid(np.linspace(0, length, along), np.arange(around) * 2 * np.pi / around, indexing="ij")
    r = thick + (thin - thick) * x / length
    points = np.stack([x, r * np.cos(v), r * np.sin(v)], axis=-1).reshape(-1, 3)
    return points, grid(along, around, closed_columns=True)[:, ::-1]


def branching():
    """A closed surface that forks: a sphere pulled out into three arms."""
    points, triangles = sphere(5)
    angle = np.arctan2(points[:, 1], points[:, 0])
    reach = 1 + 1.5 * (1 - np.abs(points[:, 2])) * np.cos(1.5 * angle) ** 4
    return points * reach[:, None] * [1, 1, 0.5], triangles


def joined(*meshes):
    first = np.cumsum([0, *(len(points) for points, _ in meshes)])
    points = np.concatenate([points for points, _ in meshes])
    return points, np.concatenate([t + at for (_, t), at in zip(meshes, first[:-1], strict=True)])


def book():
    """Three sheets that share an edge: the middle row of one is the rim of another."""
    points, triangles = sheet()
    page = points[:, [0, 2, 1]] + [0, points[0, 1] + 0.5, 0]
    spine = np.flatnonzero(np.abs(points[:, 1] - points[10 * 30, 1]) < 1e-9)
    rim = np.arange(30)
    renamed = np.arange(len(page)) + len(points)
    renamed[rim] = spine
    return np.concatenate([points, page]), np.concatenate([triangles, renamed[triangles]])


def polygons_of(points, triangles):
    """The mesh with smooth shading and each triangle as a face."""
    normals = np.zeros_like(points)
    for k in range(3):
        a, b, c = points[triangles].transpose(1, 0, 2)
        np.add.at(normals, triangles[:, k], np.cross(b - a, c - a))
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    corner = np.arange(triangles.size)
    point = triangles.ravel()
    return Polygons(points, point, normals[point], corner.reshape(-1, 3), np.arange(len(triangles)))

# SPDX-License-Identifier: GPL-3.0-or-later
"""A jewel beetle: wing cases with ridges and rows of pits, pronotum, head, eyes, legs and antennae. It stands on the
floor z = 0 and looks along -Y. Its parts are made in millimetres, from a middle that is above the floor."""

from __future__ import annotations

import bpy
import numpy as np

from precompute.mesh.shapes import of_grid

from .noise import value_noise
from .stage import add_object, new_mesh, plain_material

_MIDDLE_MM = 4.2
_ROWS, _PITS, _RIDGE_MM, _PIT_MM, _SEAM_MM = 9, 40, 0.10, 0.09, 0.28
# For the right side: the joints of the legs from the body to the claw, and those of the antenna.
_LEGS = (
    ((3.2, -7.0, -1.2), (6.6, -9.6, 0.6), (8.4, -12.0, -3.9), (9.2, -14.2, -4.1)),
    ((4.2, -2.0, -1.4), (8.6, -2.6, 0.9), (11.2, -3.6, -3.9), (13.4, -4.2, -4.1)),
    ((4.0, 3.0, -1.4), (8.2, 5.4, 0.8), (10.6, 9.6, -3.9), (11.4, 12.4, -4.1)),
)
_ANTENNA = ((1.1, -11.9, 0.6), (2.2, -13.6, 1.5), (3.6, -15.2, 1.6), (5.4, -16.4, 1.0), (7.0, -17.0, 0.2))


def add_beetle(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Add the beetle. Returns the parts that shine."""
    shell = {
        "Pronotum": _pronotum(),
        "Head": _ellipsoid((0.0, -10.2, 0.1), (2.9, 2.0, 2.2)),
        "Body": _ellipsoid((0.0, 2.5, -0.4), (5.0, 13.5, 2.6)),
    }
    plain = {}
    for name, side in (("Left", -1), ("Right", 1)):
        mirror = np.array((side, 1, 1))
        shell[f"Wing Case {name}"] = _wing_case()[:, ::side] * mirror
        for number, joints in enumerate(_LEGS, 1):
            shell[f"Leg {number} {name}"] = _tube(joints * mirror, 0.62, 0.2)
        plain[f"Antenna {name}"] = _tube(_ANTENNA * mirror, 0.22, 0.16)
        plain[f"Eye {name}"] = _ellipsoid((side * 2.35, -10.9, 0.4), (0.85, 1.25, 1.35))
    dark, eye = plain_material("Shell", (0.006,) * 3, 0.5), plain_material("Eye", (0.012, 0.006, 0.003), 0.12)
    for name, points in plain.items():
        _add(scene, name, points, eye)
    return [_add(scene, name, points, dark) for name, points in shell.items()]


def _wing_case() -> np.ndarray:
    """Points of the right wing case: rows from its front to its tip, columns from the seam to the edge."""
    s, a = np.meshgrid(np.linspace(0, 1, 900), np.linspace(0, 1, 360), indexing="ij")
    wide = 6.3 * (0.93 + 0.07 * np.sin(3 * s)) * (1 - s**2.6) ** 0.72 + 0.25
    high = 4.7 * (1 - 0.1 * (1 - s) ** 4) * (1 - s**3.4) ** 0.6 + 0.2
    row = a * _ROWS
    groove = np.round(row)
    pits = np.exp(-((row - groove) ** 2) / 0.02) * np.sin(np.pi * _PITS * s + 1.2 * groove**2) ** 2
    ridged = np.clip(8 * (1 - s), 0, 1) * np.clip(9 * s - 0.3, 0, 1) * (a > 0.04)
    relief = -ridged * (_RIDGE_MM * np.cos(np.pi * row) ** 2 + _PIT_MM * pits) - _SEAM_MM * np.exp(-((a / 0.03) ** 2))
    relief += 0.05 * value_noise(np.stack([a * 8, s * 16], axis=-1), 3)
    front = 0.8 + 0.2 * np.sqrt(np.minimum(1, 9 * s))
    return _arch(a, -4.4 + 20.4 * s, wide + relief, (high + relief) * front) + (0.03, 0.0, 0.0)


def _pronotum() -> np.ndarray:
    """Points of the shield between the head and the wing cases, with scattered pits."""
    s, a = np.meshgrid(np.linspace(0, 1, 200), np.linspace(-1, 1, 300), indexing="ij")
    cells = np.stack([a * 22, s * 16], axis=-1)
    middles = np.floor(cells) + 0.5
    middles += 0.25 * np.stack([value_noise(middles * 7.3, seed) for seed in (5, 6)], axis=-1)
    pits = np.exp(-((cells - middles) ** 2).sum(axis=-1) / 0.035) * np.clip(12 * (1 - s), 0, 1)
    wide, high = 5.9 * (1 - 0.42 * (1 - s) ** 1.7), 3.9 * (1 - 0.45 * (1 - s) ** 1.6)
    front = np.sqrt(np.minimum(1, 9 * s + 0.02))
    return _arch(a, -9.6 + 5.1 * s + 0.9 * s * (1 - a**2), wide, high * front - 0.05 * pits)


def _arch(a: np.ndarray, along: np.ndarray, wide: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Points of an arch over the body. `a` is -1 at the left edge, 0 on the back, 1 at the right edge."""
    angle = a * 0.56 * np.pi
    return np.stack([wide * np.sin(angle), along, high * np.cos(angle)], axis=-1)


def _ellipsoid(middle: tuple[float, float, float], radii: tuple[float, float, float]) -> np.ndarray:
    t, b = np.meshgrid(np.linspace(0, np.pi, 90), np.linspace(0, 2 * np.pi, 160), indexing="ij")
    return np.stack([np.sin(t) * np.cos(b), np.sin(t) * np.sin(b), np.cos(t)], axis=-1) * radii + middle


def _tube(joints: np.ndarray, first_mm: float, last_mm: float) -> np.ndarray:
    """Points of a tube along joints (n, 3), which is thick between joints and thin at each."""
    t = np.linspace(0, len(joints) - 1, 24 * (len(joints) - 1) + 1)
    line = np.stack([np.interp(t, np.arange(len(joints)), each) for each in joints.T], axis=1)
    along = np.gradient(line, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(along, (0.3, 0.2, 1.0))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    turn = np.linspace(0, 2 * np.pi, 25)[:, None]
    circle = np.cos(turn) * across[:, None] + np.sin(turn) * np.cross(along, across)[:, None]
    radius = np.linspace(first_mm, last_mm, len(t)) * (1 - 0.3 * np.cos(2 * np.pi * t))
    return line[:, None] + radius[:, None, None] * circle


def _add(scene: bpy.types.Scene, name: str, points: np.ndarray, material: bpy.types.Material) -> bpy.types.Object:
    """Add a smooth object of a grid of points (rows, columns, 3). U runs along its columns."""
    rows, columns = points.shape[:2]
    uv = np.stack(np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows)), axis=-1)
    mesh = new_mesh(name, of_grid(1e-3 * (points + (0.0, 0.0, _MIDDLE_MM)), uv))
    mesh.shade_smooth()
    mesh.materials.append(material)
    return add_object(scene, name, mesh)

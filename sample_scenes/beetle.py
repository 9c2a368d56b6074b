# SPDX-License-Identifier: GPL-3.0-or-later
"""A jewel beetle: wing cases with rows of pits, pronotum, head, eyes, legs and antennae. It stands on the floor z = 0
and looks along -Y. Lengths are in millimetres; the objects are scaled to metres."""

from __future__ import annotations

import bpy
import numpy as np

from precompute.mesh.shapes import of_grid

from .noise import value_noise
from .snake import plain_material
from .stage import add_object, new_mesh

_SCALE_M = 1e-3
# The floor lies this far below the middle of the body.
_BELLY_MM = 4.2
_ROWS, _PITS_PER_MM, _PIT_MM, _RIDGE_MM = 9, 2.2, 0.09, 0.10
_DARK = (0.006, 0.006, 0.007)


def add_beetle(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Add the beetle. Returns the parts whose shell is coloured."""
    dark = plain_material("Shell", _DARK, 0.5)
    shell = [_add(scene, name, points, dark) for name, points in _shell().items()]
    eye = plain_material("Eye", (0.012, 0.006, 0.003), 0.12)
    for side in (-1, 1):
        _add(scene, "Eye", _ball((side * 2.35, -10.9, 0.4), (0.85, 1.25, 1.35)), eye)
        for reach, (root, feet) in enumerate(_LEGS):
            shell.append(_add(scene, f"Leg {reach + 1}", _limb(side, root, feet), dark))
        _add(scene, "Antenna", _tube(np.array([(side * x, y, z) for x, y, z in _ANTENNA]), 0.22, 0.16), dark)
    return shell


def _shell() -> dict[str, np.ndarray]:
    """The points (rows, columns, 3) of the coloured parts."""
    parts = {f"Wing Case {name}": _wing_case(side) for name, side in (("Left", -1), ("Right", 1))}
    s, a = np.meshgrid(np.linspace(0, 1, 200), np.linspace(-1, 1, 300), indexing="ij")
    wide, high = 5.9 * (1 - 0.42 * (1 - s) ** 1.7), 3.9 * (1 - 0.45 * (1 - s) ** 1.6)
    round_off = np.minimum(1, np.sqrt(np.minimum(1, 9 * s + 0.02)))
    pits = _pits(np.stack([a * 7, s * 5], axis=-1) / 0.32)
    parts["Pronotum"] = _arch(a, -9.6 + 5.1 * s + 0.9 * s * (1 - a**2), wide, high * round_off - 0.05 * pits * np.clip(12 * (1 - s), 0, 1))
    t, b = np.meshgrid(np.linspace(0, np.pi, 90), np.linspace(0, 2 * np.pi, 160), indexing="ij")
    parts["Head"] = np.stack([2.9 * np.sin(t) * np.cos(b), -10.2 - 2.0 * np.cos(t), 0.1 + 2.2 * np.sin(t) * np.sin(b)], -1)
    parts["Body"] = np.stack([5.0 * np.sin(t) * np.cos(b), 2.5 + 13.5 * np.cos(t), -0.4 + 2.6 * np.sin(t) * np.sin(b)], -1)
    return parts


def _arch(a: np.ndarray, along: np.ndarray, wide: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Points of an arch over the body. `a` runs from the left edge, -1, over the back, 0, to the right edge, 1."""
    angle = a * 0.56 * np.pi
    return np.stack([wide * np.sin(angle), along, high * np.cos(angle)], axis=-1)


def _wing_case(side: int) -> np.ndarray:
    s, a = np.meshgrid(np.linspace(0, 1, 900), np.linspace(0, 1, 360), indexing="ij")
    wide = 6.3 * (0.93 + 0.07 * np.sin(3 * s)) * (1 - s**2.6) ** 0.72 + 0.25
    high = 4.7 * (1 - 0.10 * (1 - s) ** 4) * (1 - s**3.4) ** 0.6 + 0.2
    edge = np.minimum(1, 9 * s) ** 0.5
    row = a * _ROWS
    ridge = np.cos(2 * np.pi * row)
    phase = np.round(row)
    pits = np.exp(-((row - phase) ** 2) / 0.02) * (0.5 - 0.5 * np.cos(2 * np.pi * (18 * s * _PITS_PER_MM + 0.37 * phase**2)))
    fade = np.clip(8 * (1 - s), 0, 1) * np.clip(6 * s - 0.3, 0, 1)
    inner = np.exp(-((a / 0.03) ** 2))
    relief = fade * (-_RIDGE_MM * (0.5 + 0.5 * ridge) * (a > 0.04) - _PIT_MM * pits * (a > 0.04)) - 0.28 * inner
    relief += 0.05 * value_noise(np.stack([a * 9, s * 18], axis=-1) / 1.1, 3)
    points = _arch(a, -4.4 + 20.4 * s, wide + relief, (high + relief) * (0.8 + 0.2 * edge))
    points[..., 0] = side * (points[..., 0] + 0.03)
    return points[:, ::side]


def _pits(cells: np.ndarray) -> np.ndarray:
    """Pits of a shell, from 0 to 1: a jittered grid."""
    middle = np.floor(cells) + 0.5
    jitter = 0.25 * np.stack([value_noise(middle * 7.3, seed) for seed in (5, 6)], axis=-1)
    return np.exp(-((cells - middle - jitter) ** 2).sum(-1) / 0.035)


def _ball(middle: tuple[float, float, float], radii: tuple[float, float, float]) -> np.ndarray:
    t, b = np.meshgrid(np.linspace(0, np.pi, 40), np.linspace(0, 2 * np.pi, 60), indexing="ij")
    return np.stack([np.sin(t) * np.cos(b), np.sin(t) * np.sin(b), np.cos(t)], axis=-1) * radii + middle


# For the right side: a leg's root and the places of knee, ankle and claw.
_LEGS = (
    ((3.2, -7.0, -1.2), ((6.6, -9.6, 0.6), (8.4, -12.0, -3.9), (9.2, -14.2, -4.1))),
    ((4.2, -2.0, -1.4), ((8.6, -2.6, 0.9), (11.2, -3.6, -3.9), (13.4, -4.2, -4.1))),
    ((4.0, 3.0, -1.4), ((8.2, 5.4, 0.8), (10.6, 9.6, -3.9), (11.4, 12.4, -4.1))),
)
_ANTENNA = ((1.1, -11.9, 0.6), (2.2, -13.6, 1.5), (3.6, -15.2, 1.6), (5.4, -16.4, 1.0), (7.0, -17.0, 0.2))


def _limb(side: int, root, joints) -> np.ndarray:
    """A leg that narrows from joint to joint."""
    return _tube(np.array([(side * x, y, z) for x, y, z in (root, *joints)]), 0.62, 0.2)


def _tube(joints: np.ndarray, first_mm: float, last_mm: float) -> np.ndarray:
    """Points of a tube along joints (n, 3)."""
    t = np.linspace(0, len(joints) - 1, 24 * (len(joints) - 1) + 1)
    line = np.stack([np.interp(t, np.arange(len(joints)), each) for each in joints.T], axis=1)
    tangent = np.gradient(line, axis=0)
    across = np.cross(tangent, (0.3, 0.2, 1.0))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    other = np.cross(tangent / np.linalg.norm(tangent, axis=1, keepdims=True), across)
    swell = 1 - 0.3 * np.cos(2 * np.pi * t)
    radius = np.linspace(first_mm, last_mm, len(t)) * swell
    turn = np.linspace(0, 2 * np.pi, 25)
    return line[:, None] + radius[:, None, None] * (
        np.cos(turn)[:, None] * across[:, None] + np.sin(turn)[:, None] * other[:, None]
    )


def _add(scene: bpy.types.Scene, name: str, points: np.ndarray, material: bpy.types.Material) -> bpy.types.Object:
    u, v = np.meshgrid(np.linspace(0, 1, points.shape[1]), np.linspace(0, 1, points.shape[0]))
    placed = _SCALE_M * (points + (0, 0, _BELLY_MM))
    mesh = new_mesh(name, of_grid(placed, np.stack([u, v], axis=-1)))
    mesh.shade_smooth()
    mesh.materials.append(material)
    return add_object(scene, name, mesh)

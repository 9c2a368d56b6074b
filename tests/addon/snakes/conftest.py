# SPDX-License-Identifier: GPL-3.0-or-later
"""The modules of addon/snakes, and a snake that is made once for all tests of a file."""

import importlib

import pytest

pytest.importorskip("bpy")

from devtools import EXTENSION  # noqa: E402


@pytest.fixture(scope="module")
def room(extension):
    """The modules of addon/snakes by name."""
    names = ("body", "ends", "head", "mesh", "scales", "shape")
    return {name: importlib.import_module(f"{EXTENSION}.addon.snakes.{name}") for name in names}


@pytest.fixture(scope="module")
def make(room):
    """A function that makes a snake, each of them once."""
    made = {}

    def make(species="XENOPELTIS", pose="RESTING", faces=50_000, *, flatness=0.3, scatter=1.0, seed=0):
        asked = species, pose, faces, flatness, scatter, seed
        if asked not in made:
            spine = room["body"].spine_along(room["body"].POSES[pose], 1.0)
            detail = room["shape"].Detail(faces, flatness, scatter, seed)
            made[asked] = room["shape"].snake_shape(spine, species, detail)
        return made[asked]

    return make

# SPDX-License-Identifier: GPL-3.0-or-later
"""`check` shares no code with the bake; tested in the syntax trees without importing anything."""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3] / "precompute"
# Rooms that `check` may import, and the bake's rooms.
ROOMS = {"base", "optics", "reflectance", "colour", "surface", "measure", "check"}
OF_THE_BAKE = {"maths", "spectra", "table", "reference", "bake"}
# Everything that `check` shares with the bake: failures, memory and progress, the surface, directions, the observer,
# the error metrics, the reflectance of matters, the mapping of colours into a renderer's space.
SHARED = {
    "base/exr.py", "base/failure.py", "base/files.py", "base/job.py", "base/locks.py", "base/machine.py",
    "base/progress.py", "base/strict.py", "colour/channels.py", "colour/illuminants.py", "colour/observer.py",
    "colour/spaces.py", "measure/errors.py", "measure/shown_colours.py", "optics/brdf.py", "optics/plate.py",
    "optics/region.py", "reflectance/films.py", "reflectance/matter.py", "surface/height_map.py",
    "surface/periods.py", "surface/relief.py", "surface/steps/pipeline.py", "surface/steps/repairs.py",
    "surface/steps/step.py",
}  # fmt: skip


def source(target):
    """The file of a module of precompute, or None; `target` is its path without extension."""
    return next((path for path in (target.with_suffix(".py"), target / "__init__.py") if path.is_file()), None)


def reached(path, found=()):
    """Sources inside precompute that a file imports, directly or not, as paths from precompute."""
    found = set(found)
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.ImportFrom) or not node.level:
            continue
        base = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
        for each in filter(None, [source(base), *(source(base / name.name) for name in node.names)]):
            if each.relative_to(ROOT).as_posix() not in found:
                found = reached(each, found | {each.relative_to(ROOT).as_posix()})
    return found


def rooms(paths):
    return {path.split("/")[0] for path in paths} - {"__init__.py"}


def test_it_imports_no_room_of_the_bake():
    for path in (ROOT / "check").glob("*.py"):
        assert rooms(reached(path)) <= ROOMS, path.name


def test_it_shares_nothing_with_the_bake():
    shared = reached(ROOT / "check" / "verdict.py")
    assert {path for path in shared if not path.startswith("check/") and not path.endswith("__init__.py")} == SHARED
    # The readers of height maps do not import the bake either; the last lines check that imports are found at all.
    assert not rooms(reached(ROOT / "surface" / "readers" / "reader_registry.py")) & OF_THE_BAKE
    assert OF_THE_BAKE - {"bake"} <= rooms(reached(ROOT / "bake" / "make.py"))
    assert "bake" in rooms(reached(ROOT / "cli" / "bake_verb.py"))

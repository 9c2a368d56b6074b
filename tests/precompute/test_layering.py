# SPDX-License-Identifier: GPL-3.0-or-later
"""Rules for imports, checked in the syntax trees without importing anything."""

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

from devtools.changed import imports, tree_of

ROOT = Path(__file__).resolve().parents[2]
BLENDER = {"bpy", "bpy_extras", "mathutils", "gpu", "bl_ui", "bl_operators", "bmesh", "addon_utils", "_bpy", "blf"}
# The wheels of blender_manifest.toml, and NumPy, which Blender has.
ALLOWED = {"numpy", "OpenEXR", "PIL", "xatlas"}
# The repository's packages that the zip leaves out, and a pattern for their modules' names.
NOT_SHIPPED = {"laboratory", "sample_scenes", "devtools", "tests"}
MODULE_NAME = re.compile(rf"({'|'.join(sorted(NOT_SHIPPED))})(\.\w+)*")
FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__", "breakpoint"}
FORBIDDEN_MODULES = {
    "pickle", "marshal", "shelve", "threading", "_thread", "concurrent", "multiprocessing", "asyncio", "socket", "ssl",
    "http", "urllib", "ftplib", "smtplib", "requests", "ctypes",
}  # fmt: skip


def sources(package):
    found = sorted((ROOT / package).rglob("*.py"))
    assert found, f"{package} has no sources"
    return found


SHIPPED = [*sources("precompute"), *sources("addon")]
# The rooms from the ground up. A room may import itself and the rooms before it.
FLOORS = {
    "precompute": (
        "base", "maths", "mesh", "optics", "reflectance", "colour", "world_sources", "surface", "spectra", "table",
        "reference", "measure", "bake", "presets", "methods", "maps",
        "render_job", "cli",
    ),
    "addon": (
        "blender", "rendering", "gratings", "nodes", "snakes", "jobs", "worlds", "lamps", "direction", "materials",
        "cameras", "causes", "showcase", "workflow", "assets", "operators", "ui", "batch",
    ),
}  # fmt: skip


def each(*packages):
    """Make a test of one path a test of all sources of the packages, which names each file that fails."""
    return over([path for package in packages for path in sources(package)])


def over(paths):
    def looped(test):
        def run():
            faults = []
            for path in paths:
                try:
                    test(path)
                except AssertionError as fault:
                    faults.append(f"{path.relative_to(ROOT).as_posix()}: {fault}")
            assert not faults, "\n".join(faults)

        run.__name__, run.__doc__ = test.__name__, test.__doc__
        return run

    return looped


def tops(path):
    return {name.split(".")[0] for name in imports(path)}


def test_the_walk_sees_what_is_there():
    assert "precompute.surface.relief.Relief" in imports(ROOT / "precompute" / "bake" / "make.py")
    assert "precompute.base.failure.GratingError" in imports(ROOT / "precompute/surface/readers/scan_file.py")
    assert "addon" in {name.split(".")[0] for name in imports(ROOT / "__init__.py")}


@each("precompute")
def test_precompute_knows_nothing_of_blender(path):
    assert not tops(path) & (BLENDER | {"addon"})


@over([ROOT / "__init__.py", *SHIPPED])
def test_what_ships_imports_nothing_that_does_not_ship(path):
    """Looks at imports and at module names in texts, as for importlib or `python -m`."""
    assert not tops(path) & NOT_SHIPPED
    texts = [node.value for node in ast.walk(tree_of(path)) if isinstance(node, ast.Constant)]
    assert not {text for text in texts if isinstance(text, str) and MODULE_NAME.fullmatch(text)}


def test_every_package_ships_or_does_not():
    """Compares the folders that hold Python with the manifest's patterns for the zip."""
    folders = {path.parent.name for path in ROOT.glob("[a-z]*/__init__.py")} | {"tests"}
    assert folders == {"precompute", "addon"} | NOT_SHIPPED
    excluded = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["build"]["paths_exclude_pattern"]
    assert NOT_SHIPPED == {name for name in folders if f"/{name}/" in excluded}


def room_of(package, path):
    """The source's room, which is its folder; None for files at the package's top."""
    parts = path.relative_to(ROOT / package).parts
    return parts[0] if len(parts) > 1 else None


def rooms_imported(package, path):
    """The rooms of its own package from which a source imports, also inside functions."""
    dotted = [name.split(".") for name in imports(path)]
    return {parts[1] for parts in dotted if parts[0] == package and len(parts) > 2}


@pytest.mark.parametrize("package", FLOORS)
def test_every_room_has_its_floor(package):
    rooms = {room_of(package, path) for path in sources(package)} - {None}
    assert rooms == set(FLOORS[package])


@each("precompute", "addon")
def test_nothing_imports_upwards(path):
    package = path.relative_to(ROOT).parts[0]
    room, floors = room_of(package, path), FLOORS[package]
    if room is not None:
        assert rooms_imported(package, path) <= set(floors[: floors.index(room) + 1])


@pytest.mark.parametrize("package", FLOORS)
def test_there_are_no_circles(package):
    """Removes files that import no remaining file, until none is left."""
    files = {path.relative_to(ROOT).with_suffix("").as_posix().replace("/", "."): path for path in sources(package)}
    files = {name.removesuffix(".__init__"): path for name, path in files.items()}

    def imported(path):
        names = imports(path)
        return {name for name in names | {n.rpartition(".")[0] for n in names} if name in files}

    left = {name: imported(path) - {name} for name, path in files.items()}
    while free := {name for name, needs in left.items() if not needs & set(left)}:
        left = {name: needs for name, needs in left.items() if name not in free}
    assert not left


@each("precompute", "addon", "tests", "laboratory", "devtools", "sample_scenes")
def test_no_file_is_longer_than_700_lines(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 700


# Functions that Blender calls by position.
BLENDER_CALLS = {"draw_item"}


@each("precompute", "addon")
def test_no_function_takes_more_than_seven_arguments_nor_more_than_three_by_place(path):
    """`self` and `cls` do not count. The limit for arguments by place holds for public functions."""
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.FunctionDef) and node.name not in BLENDER_CALLS:
            places = [a.arg for a in (*node.args.posonlyargs, *node.args.args) if a.arg not in ("self", "cls")]
            assert len(places) + len(node.args.kwonlyargs) <= 7, node.name
            assert node.name.startswith("_") or len(places) <= 3, node.name


@each("precompute")
def test_precompute_needs_only_what_is_bundled(path):
    assert tops(path) - {"precompute"} <= ALLOWED | sys.stdlib_module_names


@each("precompute", "addon")
def test_imports_inside_the_extension_are_relative(path):
    """Blender names the extension bl_ext.REPOSITORY.natural_gratings."""
    for node in ast.walk(tree_of(path)):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.level == 0:
            names = [node.module]
        for name in names:
            assert name.split(".")[0] not in {"precompute", "addon", "natural_gratings", "bl_ext"}


@each("addon")
def test_the_addon_transforms_nothing(path):
    """All physics is in precompute, so the add-on computes no Fourier transform."""
    assert not any(name == "numpy.fft" or name.startswith(("numpy.fft.", "scipy")) for name in imports(path))
    for node in ast.walk(tree_of(path)):
        assert not (isinstance(node, ast.Attribute) and node.attr in {"fft", "fft2", "rfft", "rfft2"})


@each("precompute", "addon")
def test_nothing_is_evaluated_pickled_or_threaded(path):
    assert not tops(path) & FORBIDDEN_MODULES
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Call):
            name = node.func.id if isinstance(node.func, ast.Name) else None
            assert name not in FORBIDDEN_CALLS
            keywords = {keyword.arg: keyword.value for keyword in node.keywords}
            assert "allow_pickle" not in keywords
            shell = keywords.get("shell")
            assert shell is None or (isinstance(shell, ast.Constant) and shell.value is False)


def test_the_root_imports_the_addon_only_when_registered():
    """`python -m precompute` must not import bpy."""
    top_level = tree_of(ROOT / "__init__.py").body
    assert not any(isinstance(node, ast.Import | ast.ImportFrom) for node in top_level)

# SPDX-License-Identifier: GPL-3.0-or-later
"""What may import what, read off the syntax trees: nothing is imported or run."""

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BLENDER = {"bpy", "bpy_extras", "mathutils", "gpu", "bl_ui", "bl_operators", "bmesh", "addon_utils", "_bpy", "blf"}
# Wheels of blender_manifest.toml, and NumPy, which is Blender's own.
ALLOWED = {"numpy", "OpenEXR", "PIL", "gwyfile"}
FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__", "breakpoint"}
FORBIDDEN_MODULES = {
    "pickle", "marshal", "shelve", "threading", "_thread", "concurrent", "multiprocessing", "asyncio", "socket", "ssl",
    "http", "urllib", "ftplib", "smtplib", "requests", "ctypes",
}  # fmt: skip


def sources(package):
    found = sorted((ROOT / package).rglob("*.py"))
    assert found, f"{package} has no sources"
    return found


def each(*packages):
    paths = [path for package in packages for path in sources(package)]
    return pytest.mark.parametrize("path", paths, ids=[path.relative_to(ROOT).as_posix() for path in paths])


def tree_of(path):
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def imports(path):
    """Dotted names that a source imports, relative ones resolved from the root: `addon.panel`, `numpy.fft`."""
    package = path.relative_to(ROOT).parent.parts
    names = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            # One dot is the package itself.
            base = package[: len(package) + 1 - node.level] if node.level else ()
            assert len(package) + 1 >= node.level, f"{path}: a relative import leaves the extension"
            module = ".".join((*base, *([node.module] if node.module else [])))
            names |= {f"{module}.{alias.name}".lstrip(".") for alias in node.names}
    return names


def tops(path):
    return {name.split(".")[0] for name in imports(path)}


def test_the_walk_sees_what_is_there():
    """Of sources whose imports are known."""
    assert "precompute.surface.relief.Relief" in imports(ROOT / "precompute" / "bake" / "make.py")
    assert "precompute.base.failure.GratingError" in imports(ROOT / "precompute/surface/readers/nid.py")
    assert "addon" in {name.split(".")[0] for name in imports(ROOT / "__init__.py")}


@each("precompute")
def test_precompute_knows_nothing_of_blender(path):
    assert not tops(path) & BLENDER
    assert not tops(path) & {"addon", "sample_scenes", "devtools", "tests"}


PLOTS = {"plots.py": {"matplotlib"}}


@each("precompute")
def test_precompute_needs_only_what_is_bundled(path):
    assert tops(path) - {"precompute"} <= ALLOWED | PLOTS.get(path.name, set()) | sys.stdlib_module_names


@each("precompute", "addon")
def test_imports_inside_the_extension_are_relative(path):
    """Blender gives the extension a name of its own: bl_ext.REPOSITORY.natural_gratings."""
    for node in ast.walk(tree_of(path)):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.level == 0:
            names = [node.module]
        for name in names:
            assert name.split(".")[0] not in {"precompute", "addon", "natural_gratings", "bl_ext"}


@each("addon")
def test_the_addon_transforms_nothing(path):
    """The physics is precompute's: no Fourier transform beside it."""
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
    """A program that wants precompute alone, `python -m precompute`, must not meet bpy."""
    top_level = tree_of(ROOT / "__init__.py").body
    assert not any(isinstance(node, ast.Import | ast.ImportFrom) for node in top_level)

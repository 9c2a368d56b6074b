# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev test --changed`: tests of the rooms that a change touches, and of the rooms that import what it touches."""

import ast
import subprocess
from functools import cache
from pathlib import Path

from . import ROOT, DevError

PACKAGES = ("precompute", "addon")
# Packages and rooms that pictures show at once. One small render tests them.
SEEN = (
    "precompute/optics",
    "precompute/spectra",
    "precompute/table",
    "precompute/bake",
    "addon/materials",
    "addon/lamps",
)
RENDER = ROOT / "tests/render/test_plane.py"
ALWAYS = ROOT / "tests/precompute/test_layering.py"


@cache
def tree_of(path: Path) -> ast.Module:
    """A source's syntax tree."""
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def imports(path: Path) -> set[str]:
    """Dotted names that a source imports, relative ones resolved from the root: `addon.panel`, `numpy.fft`."""
    package = path.relative_to(ROOT).parent.parts
    names = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else ()
            assert len(package) + 1 >= node.level, f"{path}: a relative import leaves the extension"
            module = ".".join((*base, *([node.module] if node.module else [])))
            names |= {f"{module}.{alias.name}".lstrip(".") for alias in node.names}
    return names


def changed_files() -> list[str]:
    """Paths of the files that differ from the last commit; in a clean tree, those of the last commit."""

    def listed(*words: str) -> list[str]:
        run = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True)
        return run.stdout.splitlines()

    now = listed("diff", "--name-only", "HEAD") + listed("ls-files", "--others", "--exclude-standard")
    return now or listed("diff", "--name-only", "HEAD~1", "HEAD")


def affected_tests(files: list[str]) -> list[Path]:
    """The tests that could notice a change of these files, without those of higher rooms that import it only through
    others. Raises DevError if none can."""
    found = {test for file in files for test in _tests_of(Path(file))}
    if not found:
        raise DevError(f"no test reads {', '.join(files) or 'any change'}; remedy: ./dev test")
    return sorted(test for test in {*found, ALWAYS} if test.exists() and not found & set(test.parents))


def _tests_of(file: Path) -> set[Path]:
    top = file.parts[0]
    if top == "tests":
        return {ROOT / file if file.name.startswith("test_") else (ROOT / file).parent}
    if top == "devtools":
        return {ROOT / "tests/package/test_suites.py"}
    if file.suffix == ".md" or top == "docs":
        return {ROOT / "tests/precompute/test_project_pages.py"}
    if top not in PACKAGES or file.suffix != ".py":
        return set()
    module = ".".join(file.with_suffix("").parts).removesuffix(".__init__")
    touched = [path for package in PACKAGES for path in (ROOT / package).rglob("*.py") if _imports(path, module)]
    rooms = {path.relative_to(ROOT).parts[:2] for path in (*touched, ROOT / file) if path.parent.parent != ROOT}
    found = {ROOT.joinpath("tests", *room) for room in rooms}
    return found | ({RENDER} if file.as_posix().startswith(SEEN) else set())


def _imports(path: Path, module: str) -> bool:
    return any(f"{name}.".startswith(f"{module}.") for name in imports(path))

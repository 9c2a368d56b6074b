# SPDX-License-Identifier: GPL-3.0-or-later
"""Rules of Blender's extensions platform that the sources and the manifest show. devtools/extensions_platform.md lists
all rules."""

import ast
import re
import tomllib

import pytest

from .test_layering import ROOT, SHIPPED, imports, tree_of

MANIFEST = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
RULES = ROOT / "devtools" / "extensions_platform.md"
# The platform's limit for a tagline and for the reason of a permission, in characters.
TERSE = 64
# Scripts of processes of their own: second Blenders, a keeper, and the worker of a farm. Nothing imports them.
STARTS = {
    "addon/assets/start_library_maker.py", "addon/worlds/start_second_blender.py", "precompute/base/keeper.py",
    "addon/rendering/start_worker.py",
}  # fmt: skip
# The files that start a process. Each starts this Blender or its Python.
STARTERS = {"precompute/base/child_process.py", "precompute/base/keeper.py"}
STARTING = re.compile(r"subprocess\.(Popen|run|call|check_\w+)|os\.(system|popen|exec\w+|spawn\w+|posix_spawn\w*)")
# The longest list of file types has 209 characters without a space.
WORD_MAX = 300
# Methods of a path, or functions, that change what is on the disk.
WRITES = {
    "write_text", "write_bytes", "mkdir", "touch", "unlink", "rmdir", "rename", "replace", "symlink_to", "chmod",
    "write_whole", "write_together", "save", "savez", "write", "copyfile", "copytree", "rmtree",
}  # fmt: skip
# Operators of Blender that reach the web, install something, or change preferences for good.
FORBIDDEN_OPERATORS = ("wm.url_open", "extensions.", "preferences.", "wm.save_userpref")


def name_of(path):
    return path.relative_to(ROOT).as_posix()


def names_from_own_folder(tree):
    """Names that a module derives from __file__."""
    names = {"__file__"}
    for node in tree.body:
        if isinstance(node, ast.Assign) and names & {each.id for each in ast.walk(node.value) if is_name(each)}:
            names |= {target.id for target in node.targets if is_name(target)}
    return names - {"__file__"}


def is_name(node):
    return isinstance(node, ast.Name)


def writes_to(tree, names):
    """The lines of calls that write to a path with one of these names in it."""
    lines = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute | ast.Name):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else node.func.id
            modes = {each.value for each in ast.walk(node) if isinstance(each, ast.Constant)}
            writes = called in WRITES or called == "open" and modes & {"w", "wb", "a", "ab", "x", "xb", "r+", "r+b"}
            if writes and any(is_name(each) and each.id in names for each in ast.walk(node)):
                lines.append(node.lineno)
    return lines


def test_the_manifest_keeps_the_platform_s_limits():
    assert "blender" not in MANIFEST["name"].lower()
    for text in (MANIFEST["tagline"], *MANIFEST["permissions"].values()):
        assert 0 < len(text) <= TERSE
        assert text[-1].isalnum()
    assert MANIFEST["license"] == ["SPDX:GPL-3.0-or-later"]
    assert set(MANIFEST["permissions"]) == {"files"}
    assert "blender_version_max" not in MANIFEST


def test_no_package_of_blender_is_bundled():
    bundled = {wheel.rpartition("/")[2].partition("-")[0] for wheel in MANIFEST["wheels"]}
    assert bundled
    assert not bundled & {"numpy", "requests", "urllib3", "certifi", "idna", "zstandard", "cattrs", "attrs"}


def test_only_the_starts_of_other_processes_change_python_s_modules_and_path():
    found = set()
    for path in (ROOT / "__init__.py", *SHIPPED):
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.Attribute) and ast.unparse(node) in ("sys.modules", "sys.path", "sys.meta_path"):
                found.add(name_of(path))
    assert found - {"precompute/mesh/unwrap.py"} == STARTS  # unwrap.py reads the path, for its child process


def test_nothing_imports_the_starts_of_other_processes():
    modules = {name.removesuffix(".py").replace("/", ".") for name in STARTS}
    imported = {name for path in SHIPPED for each in imports(path) for name in (each, each.rpartition(".")[0])}
    # keeper.py runs by its path; the number that says "late" is imported from it, which runs none of its code.
    assert modules & imported == {"precompute.base.keeper"}
    assert ast.unparse(tree_of(ROOT / "precompute/base/keeper.py").body[-1]).startswith("if __name__ ==")


def test_processes_are_started_in_two_places():
    calls = [(path, node) for path in SHIPPED for node in ast.walk(tree_of(path)) if isinstance(node, ast.Call)]
    assert {name_of(path) for path, node in calls if STARTING.fullmatch(ast.unparse(node.func))} == STARTERS


def test_nothing_writes_into_the_extension_s_own_folder():
    own = {path: names for path in SHIPPED if (names := names_from_own_folder(tree_of(path)))}
    assert len(own) > 5
    everywhere = set.union(*own.values()) - {"FOLDER"}  # other modules give this name to other folders
    found = {name_of(path): writes_to(tree_of(path), everywhere | own.get(path, set())) for path in SHIPPED}
    assert {name: lines for name, lines in found.items() if lines} == {}


@pytest.mark.parametrize(
    "line",
    [
        '(HERE / "a").write_text("b")',
        "HERE.mkdir()",
        'np.save(HERE / "a", b)',
        '(HERE / "a").open("wb")',
        "write_whole(HERE, f)",
    ],
)
def test_a_write_into_the_own_folder_would_be_found(line):
    tree = ast.parse(f"HERE = Path(__file__).parent\ndef f():\n    {line}\n    (HERE / 'a').read_text()\n")
    assert names_from_own_folder(tree) == {"HERE"}
    assert writes_to(tree, {"HERE"}) == [3]


def test_no_operator_reaches_the_web_installs_or_saves_preferences():
    forbidden = tuple(f"bpy.ops.{name}" for name in FORBIDDEN_OPERATORS)
    attributes = [
        (path, node) for path in SHIPPED for node in ast.walk(tree_of(path)) if isinstance(node, ast.Attribute)
    ]
    assert [
        f"{name_of(path)}:{node.lineno}" for path, node in attributes if ast.unparse(node).startswith(forbidden)
    ] == []


def test_all_code_can_be_read():
    """No text without a space is long enough to hide code, and no bytes are."""
    for path in SHIPPED:
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.Constant) and isinstance(node.value, str | bytes):
                words = node.value.split()
                assert max(map(len, words), default=0) <= WORD_MAX, f"{name_of(path)}:{node.lineno}"


def test_each_proof_in_the_table_of_rules_is_there():
    page = RULES.read_text(encoding="utf-8")
    proofs = set(re.findall(r"`(tests/[\w/]+\.py)(?:::(\w+))?`", page))
    assert len(proofs) > 10
    for file, test in proofs:
        assert not test or f"\ndef {test}(" in (ROOT / file).read_text(encoding="utf-8"), f"{file}::{test}"


def test_the_entry_has_the_manifest_s_tagline_and_a_short_description():
    page = RULES.read_text(encoding="utf-8")
    assert f"> {MANIFEST['tagline']}\n" in page
    description = page.partition("## Description\n")[2].partition("\n###")[0]
    assert len(description.replace(">", "").split()) <= 200

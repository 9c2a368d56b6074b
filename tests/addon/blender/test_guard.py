# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions that Blender calls let no exception through: handlers, timers, and the drawing of panels and menus."""

import ast
from types import SimpleNamespace

import bpy
import pytest

from devtools import ROOT
from tests.addon.layout import Layout

# Methods that Blender calls, each with its guard.
METHODS = {
    "draw": "guarded_draw", "draw_header_preset": "guarded_draw", "draw_item": "guarded_item", "modal": "guarded_modal",
}  # fmt: skip
# Functions that catch their own exceptions, because they have to unregister themselves.
OWN_GUARD = {"directing.py": {"_draw"}}
# Blender's functions that take a callback.
TAKERS = ("timers.register", "draw_handler_add")


def sources():
    for path in sorted((ROOT / "addon").rglob("*.py")):
        yield path, ast.parse(path.read_text(encoding="utf-8"), str(path))


def decorators(function):
    return {ast.unparse(each) for each in function.decorator_list}


def test_every_method_that_draws_or_follows_is_guarded():
    found = set()
    for path, tree in sources():
        for owner in (node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)):
            for method in (node for node in owner.body if isinstance(node, ast.FunctionDef)):
                if method.name in METHODS or method.name.startswith("draw_"):
                    found.add((owner.name, method.name))
                    assert METHODS[method.name] in decorators(method), f"{path}: {owner.name}.{method.name}"
    assert {("_Drawn", "draw"), ("StepList", "draw_item"), ("FollowsJob", "modal")} <= found


def test_every_timer_and_persistent_handler_is_guarded():
    found = set()
    for path, tree in sources():
        owners = [node for node in tree.body if isinstance(node, ast.ClassDef)]
        functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
        functions |= {f"self.{node.name}": node for each in owners for node in each.body if hasattr(node, "name")}
        called = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
        taken = {ast.unparse(call.args[0]) for call in called if ast.unparse(call.func).endswith(TAKERS)}
        taken |= {name for name, function in functions.items() if "persistent" in decorators(function)}
        for name in taken - OWN_GUARD.get(path.name, set()):
            found.add(name)
            assert "guarded" in decorators(functions[name]), f"{path}: {name}"
    assert {"follow_change", "recall_bakes", "refresh", "_go_on", "_forget"} <= found


def test_every_handler_and_menu_entry_that_is_registered_is_guarded(extension):
    lists = [held for name in dir(bpy.app.handlers) if isinstance(held := getattr(bpy.app.handlers, name), list)]
    menus = [getattr(bpy.types, name) for name in dir(bpy.types) if "_MT_" in name]
    lists += [menu.draw._draw_funcs for menu in menus if hasattr(getattr(menu, "draw", None), "_draw_funcs")]
    own = [each for held in lists for each in held if each.__module__.startswith(extension.__name__)]
    assert len(own) >= 18
    for function in own:
        assert function.__code__.co_filename.endswith("guard.py"), function


@pytest.fixture
def guard(addon):
    addon.guard._printed.clear()
    return addon.guard


def fail(*_):
    return {}["no such key"]


def test_a_handler_that_fails_prints_one_line_once(guard, capsys):
    handler = guard.guarded(fail)
    assert (handler(), handler(1)) == (None, None)
    (line,) = capsys.readouterr().err.splitlines()
    assert "test_guard.fail failed at test_guard.py:" in line and "KeyError" in line and "report this line" in line


def test_a_failure_that_says_what_to_do_is_printed_as_it_is(guard, capsys):
    @guard.guarded
    def refuse():
        raise guard.GratingError("scan.nid", "it is damaged", "import another")

    refuse()
    assert capsys.readouterr().err == "Natural Gratings: scan.nid: it is damaged; import another\n"


def test_a_panel_that_fails_draws_the_line_each_time_and_prints_it_once(guard, capsys):
    @guard.guarded_draw
    def draw(self, context):
        fail()

    @guard.guarded_item
    def draw_item(self, context, layout, data, item, icon, active_data, active_property):
        fail()

    panel, row = SimpleNamespace(layout=Layout()), Layout()
    for _ in range(2):
        draw(panel, None)
        draw_item(None, None, row, None, None, None, None, None)
    for layout in (panel.layout, row):
        assert len(layout.labels) == 2 and "report this line" in layout.labels[0]
    assert len(capsys.readouterr().err.splitlines()) == 2


def test_an_operator_that_fails_is_cancelled(guard):
    told = []

    class Follows:
        @guard.guarded_modal
        def modal(self, context, event):
            fail()

        def cancel(self, context):
            told.append("cancelled")

        def report(self, kind, line):
            told.append(line)

    assert Follows().modal(None, None) == {"CANCELLED"}
    assert told[0] == "cancelled" and "report this line" in told[1]

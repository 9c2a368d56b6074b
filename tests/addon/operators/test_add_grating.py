# SPDX-License-Identifier: GPL-3.0-or-later
"""Grating by Parameters: the operator, and a grating without a file in a scene."""

import importlib
import json
from types import SimpleNamespace

import bpy
import pytest

from devtools import EXTENSION
from precompute.surface.generated.kinds import KINDS, PARAMETERS, PERIOD_UNITS
from precompute.table.atlas import read_header


@pytest.fixture
def operator():
    """The operator's properties, as Blender registered them."""
    return bpy.ops.grating.add_grating.get_rna_type().properties


def fields(operator):
    return [each.identifier for each in operator if each.identifier not in ("rna_type", "kind", "lines_per_mm")]


def test_it_adds_a_grating_as_a_sample_is_added(scene):
    assert bpy.ops.grating.add_grating() == {"FINISHED"}
    grating = scene.natural_gratings.active()
    assert grating.name == "Blazed 2.5 um"
    assert grating.source == grating.source_file() == "grating:blazed?period_um=2.5&depth_nm=246.23"
    assert "period 2500 nm at 0 deg" in grating.summary and grating.quality


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_has_its_own_defaults(scene, kind):
    """Even if a script names only the kind."""
    assert bpy.ops.grating.add_grating(kind=kind.upper()) == {"FINISHED"}
    source = importlib.import_module(f"{EXTENSION}.precompute.surface.generated.parameters").text_of(kind, {})
    assert scene.natural_gratings.active().source == source


def test_numbers_are_those_that_were_typed(scene):
    given = {"period_um": 1.7, "depth_nm": 123.4, "duty": 0.3, "period_disorder": 0.05, "depth_disorder": 0.1}
    bpy.ops.grating.add_grating(kind="BINARY", direction_disorder_deg=2.5, seed=2_000_000_001, **given)
    assert scene.natural_gratings.active().source == (
        "grating:binary?period_um=1.7&depth_nm=123.4&duty=0.3&period_disorder=0.05&depth_disorder=0.1"
        "&direction_disorder_deg=2.5&seed=2000000001"
    )


def test_lines_per_mm_set_the_period(scene):
    bpy.ops.grating.add_grating(kind="SINUSOIDAL", lines_per_mm=500)
    assert scene.natural_gratings.active().source == "grating:sinusoidal?period_um=2&depth_nm=200"


def test_what_does_not_fit_together_is_refused_in_one_line(scene):
    with pytest.raises(RuntimeError, match="neighbouring grooves would run into each other; lower duty") as told:
        bpy.ops.grating.add_grating(kind="GROOVE", duty=0.95)
    assert len(str(told.value).strip().splitlines()) == 1
    with pytest.raises(RuntimeError, match="deeper than 5000 nm"):
        bpy.ops.grating.add_grating(kind="ECHELLE", period_um=20, angle_deg=45)
    assert len(scene.natural_gratings.items) == 0


def test_the_same_grating_is_not_added_twice(scene):
    for _ in range(2):
        bpy.ops.grating.add_grating(kind="BINARY")
    bpy.ops.grating.import_height_map(filepath="grating:binary?period_nm=2500")
    assert [grating.name for grating in scene.natural_gratings.items] == ["Binary 2.5 um"]


def test_the_fields_are_those_of_the_kinds(operator):
    kinds = [(item.identifier.lower(), item.name, item.description) for item in operator["kind"].enum_items]
    assert kinds == [(name, kind.title, kind.help) for name, kind in KINDS.items()]
    assert sorted(fields(operator)) == sorted(PARAMETERS)
    numbers = PARAMETERS | {"lines_per_mm": PERIOD_UNITS["lines_per_mm"][0]}
    for name, number in numbers.items():
        low, high = operator[name].hard_min, operator[name].hard_max
        assert (low, high) == (pytest.approx(number.low), pytest.approx(number.high)), name
    blazed = KINDS["blazed"].defaults
    assert {name: operator[name].default for name in blazed} == {k: pytest.approx(v) for k, v in blazed.items()}


def test_every_tooltip_has_the_unit_of_its_label(operator):
    units = {"um": "micrometres", "nm": "nanometres", "deg": "degrees"}
    for name in fields(operator):
        unit = units.get(name.rpartition("_")[2])
        assert unit is None or unit in operator[name].description
        assert unit is None or f"({name.rpartition('_')[2]})" in operator[name].name


class Drawn:
    """A layout that lists the fields drawn into it."""

    def __init__(self):
        self.names = []

    def prop(self, _, name, **__):
        self.names.append(name)


@pytest.mark.parametrize("kind", KINDS)
def test_only_the_fields_of_a_kind_are_shown(addon, kind):
    layout = Drawn()
    cls = importlib.import_module(f"{EXTENSION}.addon.operators.add_grating").AddGrating
    cls.draw(SimpleNamespace(layout=layout, kind=kind.upper()), None)
    shown = [name for name in layout.names if name not in ("kind", "lines_per_mm")]
    assert layout.names[0] == "kind" and shown == list(KINDS[kind].defaults)
    assert layout.names.index("lines_per_mm") == layout.names.index("period_um") + 1


def test_choosing_a_kind_sets_its_defaults(addon):
    """The callback of the field, on an operator without a dialog."""
    module = importlib.import_module(f"{EXTENSION}.addon.operators.add_grating")
    dialog = SimpleNamespace(kind="HEXAGONAL", period_um=9.0, duty=0.7)
    module._take_defaults(dialog)
    assert (dialog.period_um, dialog.depth_nm, dialog.seed, dialog.duty) == (1.5, 200, 0, 0.7)
    assert isinstance(dialog.seed, int)


def test_it_bakes_and_is_baked_for_a_scene_without_a_file(addon, scene, tmp_path, monkeypatch):
    """The saved scene holds the grating's text, and the header of the bake does."""
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(tmp_path / "cache"))
    bpy.ops.grating.add_grating(kind="BINARY", period_um=1.2)
    grating = scene.natural_gratings.active()
    grating.delta_e, grating.coherence_um = 9.0, 4.0
    assert bpy.ops.grating.bake(directory=str(tmp_path / "bakes")) == {"FINISHED"}
    path = grating.baked_file()
    _, header = read_header(path)
    assert header["source"] == "grating:binary?period_um=1.2&depth_nm=140&duty=0.5"
    assert header["request"] == grating.bake_request().as_dict()
    # A grating that was made from the bake alone needs no file either.
    other = scene.natural_gratings.items.add()
    other.name, other.bake_path = "other", str(path)
    needs = importlib.import_module(f"{EXTENSION}.precompute.bake.needs").EVERYTHING
    request = importlib.import_module(f"{EXTENSION}.addon.workflow.baking").request_with(other, needs)
    assert request.scans[0].source == header["source"]


def test_the_command_line_imports_it(addon, tmp_path):
    report, file = tmp_path / "facts.json", tmp_path / "a.blend"
    line = ["import", "grating:crossed?lines_per_mm=500", "--json", str(report), "--save", str(file)]
    assert addon.commands.execute(line) == 0
    assert json.loads(report.read_text())["name"] == "Crossed 2 um" and file.is_file()
    assert bpy.context.scene.natural_gratings.active().source_file().startswith("grating:crossed?period_um=2&")


def test_the_menu_s_tooltip_needs_no_file():
    description = bpy.types.GRATING_OT_import_height_map.description
    told = [description(bpy.context, SimpleNamespace(filepath=each)) for each in ("sample:cd", "grating:pits")]
    assert all("needs no file" in each for each in told)


def test_the_dialog_begins_with_the_kind_s_defaults_except_what_its_caller_set(scene):
    """Blender shows no dialog in background, so the operator's invoke() is called with a stand-in for its window."""
    module = importlib.import_module(f"{EXTENSION}.addon.operators.add_grating")
    shown = []
    window_manager = SimpleNamespace(invoke_props_dialog=lambda operator, width: shown.append(operator) or {"RUNNING"})
    fields = SimpleNamespace(kind="PITS", period_um=1.5)
    fields.properties = SimpleNamespace(is_property_set=lambda name: name == "period_um")
    module.AddGrating.invoke(fields, SimpleNamespace(window_manager=window_manager), None)
    assert shown == [fields]
    defaults = KINDS["pits"].defaults
    assert fields.period_um == 1.5 and fields.depth_nm == defaults["depth_nm"] and fields.duty == defaults["duty"]

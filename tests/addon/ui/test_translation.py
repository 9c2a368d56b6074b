# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in another language: a made-up one that puts each text into brackets."""

import re
from types import SimpleNamespace

import bpy
import pytest

from devtools.docs.user_texts import template
from tests.addon.layout import Layout, context_of
from tests.hostile.shader_editor import shader_editor

# What no translation has: names of data-blocks, nothing, and an abbreviation.
NAMES = {"Sun", "", "IOR"}


@pytest.fixture(scope="module")
def catalog():
    """The texts that the template for translators has, with their contexts."""
    found = re.findall(r'(?:msgctxt "(\w+)"\n)?msgid "(.+)"\n', template())
    return {(context, text.replace('\\"', '"').replace("\\\\", "\\")) for context, text in found}


@pytest.fixture
def brackets(addon, catalog, monkeypatch):
    """Translates into the language of brackets, as Blender does for a registered dictionary: a text that it lacks
    stays."""

    def translate(text, context=""):
        return f"[{text}]" if (context, text) in catalog else text

    monkeypatch.setattr(addon.wording, "pgettext_iface", translate)
    return translate


class Translating(Layout):
    """A layout that translates as Blender's does, and records what it shows."""

    def __init__(self, translate):
        super().__init__(folded=False)
        self.translate, self.shown = translate, []

    def label(self, text="", icon="NONE", translate=True):
        super().label(text, icon)
        self.shown.append(self.translate(text) if translate else text)

    def operator(self, name, text=None, **given):
        made = super().operator(name)
        self._show_operator(name, text)
        return made

    def operator_menu_enum(self, name, _property, text=None, **given):
        super().operator_menu_enum(name, _property)
        self._show_operator(name, text)

    def prop(self, data, name, text=None, **given):
        super().prop(data, name)
        self.shown.append(self.translate(data.bl_rna.properties[name].name if text is None else text))

    def progress(self, text="", **_):
        self.shown.append(self.translate(text))

    def _show_operator(self, name, text):
        group, _, operator = name.partition(".")
        label = getattr(getattr(bpy.ops, group), operator).get_rna_type().name
        self.shown.append(self.translate(label if text is None else text, "Operator"))

    def untranslated(self):
        """What is shown and has no bracket at its beginning, or after the name of the scene's world, which an earlier
        test may have changed."""
        world = bpy.context.scene.world
        texts = {text if world is None else text.removeprefix(f"{world.name}: ") for text in self.shown}
        return sorted(text for text in texts if text not in NAMES and not text.startswith("["))


def drawn(addon, translate, *panels, **given):
    layout, context = Translating(translate), context_of(100_000)
    vars(context).update(given)
    for panel in panels:
        panel.draw(SimpleNamespace(layout=layout), context)
    assert layout.shown and not [text for text in layout.shown if "report this line" in text]
    return layout


def panels(addon):
    return addon.panel.GratingPanel, addon.direction_panel.DirectionPanel, addon.panel.ReferencePanel


@pytest.mark.night("test_each_next_step_is_translated")
def test_the_start_is_translated(scene, addon, brackets):
    for selected in (False, True):
        bpy.context.object.select_set(selected)
        assert drawn(addon, brackets, addon.panel.GratingPanel).untranslated() == []


@pytest.mark.night("test_each_next_step_is_translated")
def test_a_baked_grating_is_translated(scene, grating, addon, brackets):
    assert drawn(addon, brackets, *panels(addon)).untranslated() == []


def test_each_next_step_is_translated(scene, grating, addon, brackets):
    """Bake, select a mesh, assign, light, and render."""
    panel = addon.panel.GratingPanel
    bpy.ops.grating.lights(lights="LAMPS")
    grating.bake_path, kept = "", grating.bake_path
    assert "[Bake]" in drawn(addon, brackets, panel).shown
    grating.bake_path = kept
    said = drawn(addon, brackets, panel, selected_objects=[]).shown
    assert "[Select a mesh in the 3D view. It will show the grating]" in said
    assert "[Assign to Plane]" in drawn(addon, brackets, panel).shown
    bpy.ops.grating.assign()
    view = next(area.spaces.active for area in bpy.context.window.screen.areas if area.type == "VIEW_3D")
    view.shading.type = "SOLID"
    assert "[Switch to Rendered]" in drawn(addon, brackets, panel, space_data=view).shown
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    dark = drawn(addon, brackets, panel)
    assert {"[Nothing lights the grating]", "[Add a Light Rig]"} <= set(dark.shown)
    assert dark.untranslated() == []


def test_names_are_not_translated(scene, grating, addon, brackets):
    """A lamp is named as one of the texts."""
    bpy.data.objects["Sun"].name = "Pattern"
    bpy.ops.grating.lights(lights="LAMPS")
    bpy.ops.grating.assign()
    assert brackets("Pattern") == "[Pattern]" and "Pattern" in drawn(addon, brackets, addon.panel.GratingPanel).shown


@pytest.mark.night("test_each_next_step_is_translated")
@pytest.mark.parametrize("lights", ["LAMPS", "REST", "ALL"])
def test_a_grating_on_a_mesh_is_translated(scene, grating, addon, brackets, lights):
    bpy.ops.grating.lights(lights=lights)
    bpy.ops.grating.assign()
    bpy.ops.grating.vary(turn=0.3)
    bpy.ops.grating.hologram(pattern="CRYSTAL")
    assert drawn(addon, brackets, *panels(addon)).untranslated() == []


def test_a_refusal_is_translated_as_far_as_its_texts_are_fixed(scene, addon, brackets):
    scene.natural_gratings.items.add().name = "waves"
    paint = bpy.data.materials.new("Paint")
    addon.compat.enable_nodes(paint)
    bpy.context.object.data.materials.append(paint)
    told = r"waves: \[not baked yet\]; \[press Bake Grating first\]"
    with shader_editor(), pytest.raises(RuntimeError, match=told):
        bpy.ops.grating.add_grating_node()
    error = addon.wording.GratingError("cd.json", "{", "add `title`")
    assert addon.wording.in_words(error) == "cd.json: {; add `title`"


def test_a_translation_may_order_values_and_a_faulty_one_is_not_used(addon, monkeypatch):
    texts = {"Put on {name}": "{name}: auflegen", "{count} lamps": "{counts} Lampen", "{count} lamp": "{count.x} Lampe"}
    texts |= {"{text}, {share}": "{share} ({text})"}
    monkeypatch.setattr(addon.wording, "pgettext_iface", lambda text: texts.get(text, text))
    assert addon.wording.translated("{text}, {share}", text="a", share=1) == "1 (a)"
    assert addon.wording.translated("Put on {name}", name="{x}") == "{x}: auflegen"
    assert addon.wording.counted("{count} lamp", "{count} lamps", 2) == "2 lamps"
    assert addon.wording.counted("{count} lamp", "{count} lamps", 1) == "1 lamp"
    assert addon.wording.translated("100 % {") == "100 % {"


def test_the_template_has_what_blender_looks_up(scene, addon, catalog):
    """The labels and tooltips of the operators, panels and menus, and of their properties, as Blender has them."""
    missing = []
    for cls in addon.package.CLASSES:
        rna = getattr(bpy.types, cls.__name__, None) or cls
        is_operator = issubclass(cls, bpy.types.Operator)
        context = "Operator" if is_operator else ""
        held = [(context, getattr(cls, "bl_label", "")), (context, getattr(cls, "bl_description", ""))]
        if is_operator:
            own = [each for each in rna.bl_rna.properties if each.identifier in cls.__annotations__]
            held += [("", text) for each in own if not each.is_hidden for text in (each.name, each.description)]
        missing += [f"{cls.__name__}: {text}" for key, text in held if text and (key, text) not in catalog]
    assert missing == []

# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by Blender with the add-on enabled: `--python draw_panels.py -- MODULE [PACKAGE ...]`.

Draws every panel of the add-on MODULE, without and with a grating. The panel Grating must list each missing PACKAGE in
one line, and no panel may fail."""

import importlib
import sys
from pathlib import Path
from types import SimpleNamespace

import bpy

sys.path.append(str(Path(__file__).resolve().parents[2]))

from tests.addon.layout import Layout, context_of

MODULE, *PACKAGES = sys.argv[sys.argv.index("--") + 1 :]


def drawn(panel: type) -> Layout:
    """What a panel draws, with all its parts open."""
    layout = Layout(folded=False)
    panel.draw(SimpleNamespace(layout=layout), context_of())
    failures = [label for label in layout.labels if "report this line" in label]
    assert not failures, failures
    return layout


addon = importlib.import_module(f"{MODULE}.addon")
for step in (None, bpy.ops.grating.add_preset):
    if step is not None:
        assert step(preset="gold_foil", assign=False) == {"FINISHED"}
    for panel in (each for each in addon.CLASSES if issubclass(each, bpy.types.Panel)):
        text = " ".join(drawn(panel).labels)
        is_main = panel.__name__ in ("GratingPanel", "MaterialPanel", "ShaderPanel")
        assert text.count("Missing packages") == (is_main and bool(PACKAGES)), text
        for name in PACKAGES if is_main else ():
            assert f"{name} (" in text, text

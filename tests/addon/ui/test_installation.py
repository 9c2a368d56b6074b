# SPDX-License-Identifier: GPL-3.0-or-later
"""The button of the manual: where it is, and which page it opens."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

from devtools.docs.site import IN_ZIP
from tests.addon.layout import Layout, context_of


@pytest.fixture
def opened(addon, tmp_path, monkeypatch):
    """The addresses that a browser was asked for. The extension has a manual in a folder whose name needs quoting."""
    addresses = []
    page = tmp_path / "my add-ons" / "index.html"
    page.parent.mkdir()
    page.touch()
    monkeypatch.setattr(addon.installation, "MANUAL", page)
    monkeypatch.setattr("webbrowser.open", lambda address: addresses.append(address) or True)
    return addresses


def buttons(addon):
    """The operators in the headers of the panels and in the preferences."""
    layout = Layout()
    holder = SimpleNamespace(layout=layout)
    for panel in (addon.panel.GratingPanel, addon.panel.MaterialPanel, addon.panel.ShaderPanel):
        panel.draw_header_preset(holder, context_of())
    addon.installation.Preferences.draw(holder, context_of())
    return layout.operators


def test_it_opens_the_page_that_the_zip_holds(addon, opened, tmp_path):
    assert bpy.ops.grating.manual() == {"FINISHED"}
    assert opened == [f"file://{tmp_path}/my%20add-ons/index.html"]
    assert buttons(addon) == ["grating.manual"] * 4


def test_without_a_browser_it_names_the_page(addon, opened, monkeypatch):
    monkeypatch.setattr("webbrowser.open", lambda address: False)
    with pytest.raises(RuntimeError, match=r"index.html: no web browser was found; open this file in a browser"):
        bpy.ops.grating.manual()


def test_a_copy_without_a_manual_has_no_button(addon, monkeypatch, tmp_path):
    monkeypatch.setattr(addon.installation, "MANUAL", tmp_path / "index.html")
    assert buttons(addon) == []
    assert not bpy.ops.grating.manual.poll()


def test_it_is_looked_for_where_the_zip_has_it(addon, extension):
    assert Path(extension.__file__).parent / IN_ZIP / "index.html" == addon.installation.MANUAL

# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of Sphinx for the site of these pages: `./dev docs`."""

from docutils import nodes
from sphinx.application import Sphinx

project = "Natural Gratings"
copyright = "Natural Gratings, GPL-3.0-or-later"
extensions = ["myst_parser"]
myst_heading_anchors = 6  # a page links to titles as GitHub names them
highlight_language = "none"  # blocks of commands and formulas
html_theme = "furo"
html_title = project
html_copy_source = html_show_sphinx = False


def link_pictures(app: Sphinx, page: nodes.document) -> None:
    """Let a click on a picture open it in full size: Sphinx links a picture that has a scale."""
    for picture in page.findall(nodes.image):
        picture["scale"] = 100


def setup(app: Sphinx) -> None:
    """Tell Sphinx about the pictures."""
    app.connect("doctree-read", link_pictures)

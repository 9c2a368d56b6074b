# SPDX-License-Identifier: GPL-3.0-or-later
"""The site of the pages builds without a warning, and has a page with every verb."""

import pytest

from devtools import environments
from devtools.docs import site
from laboratory.verbs import PACKAGES


@pytest.mark.night("tests/precompute/test_project_pages.py")
def test_the_site_has_no_fault(tmp_path):
    assert site.build(environments.require(environments.DOCS), tmp_path / "site") == []
    commands = (tmp_path / "site" / "commands.html").read_text(encoding="utf-8")
    plain = {f"usage: grating {verb} " for verbs in PACKAGES.values() for verb in verbs}
    assert [usage for usage in plain if usage not in commands] == []
    assert "usage: blender --command grating light-rig " in commands

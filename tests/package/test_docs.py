# SPDX-License-Identifier: GPL-3.0-or-later
"""The site of the pages builds without a warning."""

import pytest

from devtools import environments
from devtools.docs import site


@pytest.mark.night("tests/precompute/test_project_pages.py")
def test_the_site_has_no_fault(tmp_path):
    assert site.build(environments.require(environments.DOCS), tmp_path / "site") == []

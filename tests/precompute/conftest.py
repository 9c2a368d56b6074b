# SPDX-License-Identifier: GPL-3.0-or-later
"""Every test has a cache of its own: none finds the bake of another."""

import pytest


@pytest.fixture(autouse=True)
def cache_folder(tmp_path_factory, monkeypatch):
    """The cache's folder, outside of tmp_path; not made yet."""
    folder = tmp_path_factory.mktemp("own") / "cache"
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(folder))
    monkeypatch.delenv("NATURAL_GRATINGS_CACHE_MB", raising=False)
    return folder

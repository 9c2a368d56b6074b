# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by tests of colours: an independent implementation."""

import warnings

import pytest


@pytest.fixture(scope="session")
def science():
    """colour-science, an independent implementation."""
    with warnings.catch_warnings():
        # It warns of missing packages that only its plots need.
        warnings.simplefilter("ignore")
        return pytest.importorskip("colour", reason="colour-science is the judge here", exc_type=ImportError)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares two files of the same bake.

The order of the sums in a matrix product may differ. A half float may then round the other way, by 2^-10 of itself, and
the measured errors change by a thousandth at most. Everything else is equal."""

import numpy as np
import pytest

from precompute.table import atlas


def assert_same_bake(found, expected):
    """Check that two files have the same terms, measured errors and other records."""
    (table, record), (expected_table, expected_record) = atlas.read(found), atlas.read(expected)
    largest = np.abs(expected_table.terms).max()
    np.testing.assert_allclose(table.terms, expected_table.terms, rtol=2**-10, atol=1e-6 * largest)
    assert table.ratio_ior == expected_table.ratio_ior
    errors, expected_errors = record.pop("delta_e"), expected_record.pop("delta_e")
    for name in ("lamps", "lamps_claim"):
        # They have two decimals.
        lamps, expected_lamps = (each.pop(name, {}) for each in (errors, expected_errors))
        assert list(lamps) == list(expected_lamps)
        for lamp, figures in lamps.items():
            assert figures == pytest.approx(expected_lamps[lamp], rel=1e-3, abs=0.0101)
    assert errors == pytest.approx(expected_errors, rel=1e-3)
    assert record == expected_record

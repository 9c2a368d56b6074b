# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether two files hold the bake of one request.

The order of the sums in a matrix product is free. So a half float may round the other way, which is 2^-10 of it, and
the measured errors follow by a thousandth at most. All else is equal.
"""

import numpy as np
import pytest

from precompute.table import atlas_file


def assert_same_bake(found, expected):
    """Check the terms, the measured errors and the rest of the records of two files of a bake."""
    (table, record), (expected_table, expected_record) = atlas_file.read(found), atlas_file.read(expected)
    largest = np.abs(expected_table.terms).max()
    np.testing.assert_allclose(table.terms, expected_table.terms, rtol=2**-10, atol=1e-6 * largest)
    errors, expected_errors = errors_by_form(record), errors_by_form(expected_record)
    assert errors.keys() == expected_errors.keys()
    for form, measured in expected_errors.items():
        assert errors[form] == pytest.approx(measured, rel=1e-3)
    assert record == expected_record


def errors_by_form(record):
    """Take the errors out of a record."""
    return {"shown": record.pop("delta_e"), **record.pop("delta_e_by_form")}

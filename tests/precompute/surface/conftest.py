# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads files that must be refused."""

import pytest

from precompute.base.failure import GratingError
from precompute.surface.readers.reader_registry import read_height_map


@pytest.fixture
def fails(tmp_path):
    """A function that reads a file of the given bytes, which must fail, and returns the one-line error."""

    def line_of(name, data, **options):
        path = tmp_path / name
        path.write_bytes(data)
        before = sorted(tmp_path.iterdir())
        with pytest.raises(GratingError) as caught:
            read_height_map(str(path), **options)
        line = str(caught.value)
        assert line.startswith(f"{path}: ")
        assert "; " in line
        assert "\n" not in line
        assert sorted(tmp_path.iterdir()) == before
        return line.removeprefix(f"{path}: ")

    return line_of

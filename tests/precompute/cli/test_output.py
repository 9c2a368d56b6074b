# SPDX-License-Identifier: GPL-3.0-or-later
"""What a verb writes: JSON that every program reads."""

import json
import math

import pytest

from laboratory.study.colour_comparison import ColourComparison
from precompute.base.failure import GratingError
from precompute.cli.printing import emit
from precompute.measure.errors import Errors


@pytest.mark.parametrize("figure", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("to_file", [True, False])
def test_json_holds_no_figure_that_is_not_finite(tmp_path, capsys, figure, to_file):
    """JSON has no word for them: Python's NaN and Infinity are errors to other programs."""
    target = tmp_path / "facts.json"
    with pytest.raises(GratingError, match="not finite.*; "):
        emit({"errors": [{"p99": figure}]}, str(target) if to_file else "-", lambda: [])
    assert not target.exists()
    assert capsys.readouterr().out == ""


def test_a_surface_without_light_around_the_first_order_is_refused(refused):
    """A mirror's spectrum is dark: it has no colours that the bake's could be compared with."""
    options = ("--period-nm", "1000", "--methods", "bake", "--progress", "none", "--json", "-")
    assert "dark around the first order of 1000 nm" in refused("evaluate", "sample:flat", *options)


def test_colours_without_a_dominant_wavelength_are_null():
    """Such as purples: no angle's error can be given in nanometres."""
    none = ColourComparison(10.0, 10.0, None, 0.01, 1.0)
    assert json.loads(json.dumps(none.as_dict(), allow_nan=False))["dominant_wavelength_rms_nm"] is None
    assert "no dominant wavelength" in none.summary()


def test_an_infinite_error_is_null():
    """A table that answers with NaN has infinite errors of colour (`measure`)."""
    found = Errors(math.inf, math.inf, math.inf, math.inf, 0.1, 0.1, 0.0, 7).as_dict()
    assert found["p99"] is None and found["relative_dy"] == 0.1

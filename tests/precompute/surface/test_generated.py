# SPDX-License-Identifier: GPL-3.0-or-later
"""Gratings by their parameters: text, refusals, and surfaces."""

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.base.failure import GratingError
from precompute.maths.chebyshev import bessel_j
from precompute.spectra.spectrum import FrequencyGrid, scattered_spectrum
from precompute.surface.generated.catalogue import make_grating, surface_of
from precompute.surface.generated.kinds import KINDS, PARAMETERS, PERIOD_UNITS
from precompute.surface.generated.lines import line_starts
from precompute.surface.generated.parameters import GratingParameters, canonical, parse_grating, text_of, title_of_stem
from precompute.surface.generated.pixels import pixels_of
from precompute.surface.quality import describe
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import Relief
from precompute.surface.samples.catalogue import make_sample
from tests.precompute.test_layering import ROOT

_LINES = ("sinusoidal", "binary", "blazed", "echelle")
_RANDOM = "period_disorder=0.1&depth_disorder=0.2&seed=3"


@st.composite
def gratings(draw):
    """The kind and the values of a grating, with some parameters left out."""
    kind = draw(st.sampled_from(list(KINDS)))
    names = draw(st.sets(st.sampled_from(list(KINDS[kind].defaults))))
    values = {}
    for name in names:
        number = PARAMETERS[name]
        numbers = st.integers(int(number.low), int(number.high)) if number.whole else st.floats(number.low, number.high)
        values[name] = draw(numbers)
    return kind, values


@settings(max_examples=200, deadline=None)
@given(gratings())
def test_a_text_gives_its_grating_again(grating):
    kind, values = grating
    text = text_of(kind, values)
    try:
        parsed = parse_grating(text)
    except GratingError as error:  # grooves that overlap, or facets that are too deep
        assert kind in ("groove", "echelle") and "lower" in str(error)
        return
    assert parse_grating(parsed.text) == parsed
    assert canonical(parsed.text) == parsed.text
    for name, value in values.items():
        assert getattr(parsed, name) == pytest.approx(value, rel=1e-11)
    for name, default in KINDS[kind].defaults.items():
        assert name in values or getattr(parsed, name) == default


@settings(max_examples=300, deadline=None)
@given(st.text(max_size=60), st.sampled_from(["", *KINDS]))
def test_any_text_is_a_grating_or_a_refusal_in_one_line(text, kind):
    try:
        assert isinstance(parse_grating(f"grating:{kind}{text}"), GratingParameters)
    except GratingError as error:
        assert "\n" not in str(error) and len(str(error)) < 500


@pytest.mark.parametrize("period", ["period_um=2.5", "period_nm=2500", "lines_per_mm=400"])
def test_the_period_has_three_units(period):
    assert parse_grating(f"grating:blazed?{period}").text == "grating:blazed?period_um=2.5&depth_nm=246.23"


def test_a_text_that_is_no_grating_stays():
    assert canonical("grating:nonsense") == "grating:nonsense"
    assert canonical("sample:cd") == "sample:cd"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "there is no such kind of grating; choose one of sinusoidal, binary"),
        ("blaze", "there is no such kind of grating"),
        ("Blazed", "there is no such kind of grating"),
        ("blazed?", "Blazed has no parameter ''; give period_um, depth_nm, .*, seed, period_nm, lines_per_mm"),
        ("blazed?period_um", "period_um: cannot be ''; give period_um, a number from 0.2 to 20, as period_um=0.2"),
        ("blazed?period_um=", "period_um: cannot be ''"),
        ("blazed?period_um=0", "period_um: cannot be '0'"),
        ("blazed?period_um=-2.5", "period_um: cannot be '-2.5'"),
        ("blazed?period_um=nan", "period_um: cannot be 'nan'"),
        ("blazed?period_um=inf", "period_um: cannot be 'inf'"),
        ("blazed?period_um=1e6", "period_um: cannot be '1e6'"),  # a metre
        ("blazed?period_um=1_0", "period_um: cannot be '1_0'"),
        ("blazed?period_um=2,5", "period_um: cannot be '2,5'"),
        ("blazed?period_um=٢", "period_um: cannot be"),
        ("blazed?period_um=2&period_um=2", "the period, by period_um, period_nm, lines_per_mm, is given twice"),
        ("blazed?period_um=2&lines_per_mm=500", "the period, by .* is given twice; give it once"),
        ("blazed?lines_per_mm=0", "lines_per_mm: cannot be '0'; give lines_per_mm, a number from 50 to 5000"),
        ("blazed?depth_nm=1e6", "depth_nm: cannot be '1e6'"),  # a millimetre
        ("blazed?depth_nm=5&depth_nm=5", "depth_nm is given twice; give it once"),
        ("blazed?duty=0.5", "Blazed has no parameter 'duty'"),
        ("binary?duty=2", "duty: cannot be '2'; give duty, a number from 0.05 to 0.95"),
        ("binary?duty=0", "duty: cannot be '0'"),
        ("binary?colour=red", "Binary has no parameter 'colour'"),
        ("binary?&duty=0.5", "Binary has no parameter ''"),
        ("binary?period_disorder=5", "period_disorder: cannot be '5'"),
        ("binary?seed=-1", "seed: cannot be '-1'; give seed, a whole number from 0"),
        ("binary?seed=1e99", "seed: cannot be '1e99'"),
        ("binary?seed=1.5", "seed: cannot be '1.5'"),
        ("echelle?depth_nm=5", "Echelle has no parameter 'depth_nm'"),
        ("echelle?period_um=20&angle_deg=45", "facets of 10000 nm are deeper than 5000 nm; lower"),
        ("groove?duty=0.9", "neighbouring grooves would run into each other; lower duty or modulation_nm"),
        ("blazed?" + "x" * 10_000, "a text of 10015 characters; give at most 500"),
        ("blazed?" + "&" * 400, "Blazed has no parameter ''"),
    ],
)  # fmt: skip
def test_a_text_that_is_no_grating_is_refused_in_one_line(text, told):
    with pytest.raises(GratingError, match=rf"^grating:.*: {told}") as refusal:
        read_height_map(f"grating:{text}")
    assert "\n" not in str(refusal.value) and len(str(refusal.value)) < 500


def test_a_grating_takes_no_size():
    with pytest.raises(GratingError, match="a grating by its parameters does not need it; leave out --size-um"):
        read_height_map("grating:blazed", size_um=65)


@pytest.mark.parametrize("kind", ["sinusoidal", "binary", "blazed"])
def test_a_kind_s_default_is_the_sample_of_its_name(kind):
    made, sample = make_grating(f"grating:{kind}"), make_sample(kind)
    np.testing.assert_array_equal(made.height_m, sample.height_m)
    assert made.pixel_size_m == sample.pixel_size_m


def test_pits_are_those_of_the_sample():
    np.testing.assert_array_equal(make_grating("grating:pits?seed=780").height_m != 0, make_sample("cd").height_m != 0)


@pytest.mark.night("test_disorders_have_their_sizes")
@pytest.mark.parametrize("kind", KINDS)
def test_a_surface_is_whole_and_the_same_every_time(kind):
    hm = make_grating(f"grating:{kind}?{_RANDOM}" if kind not in ("brushed", "pits") else f"grating:{kind}?seed=3")
    assert hm.periodic and np.isfinite(hm.height_m).all()
    assert hm.source == canonical(hm.source) and hm.source_name == hm.source
    assert not set(hm.stem) & set(':?&*/\\"<>|') and hm.stem.startswith(f"grating_{kind}_period_um=")
    assert title_of_stem(hm.stem) == parse_grating(hm.source).title
    assert (
        title_of_stem("skin_10um") == "skin_10um" and title_of_stem("grating_x_period_um=1") == "grating_x_period_um=1"
    )
    assert max(hm.height_m.shape) <= 2048 and max(hm.pixel_size_m) < 95e-9
    np.testing.assert_array_equal(hm.height_m, make_grating(hm.source).height_m)
    other = make_grating(hm.source.replace("seed=3", "seed=4"))
    assert not np.array_equal(hm.height_m, other.height_m)


@pytest.mark.parametrize("period_um", [0.2, 0.37, 1.6, 2.5, 7.77, 20])
def test_pixels_resolve_every_period(period_um):
    pixels = pixels_of(period_um * 1e-6)
    assert pixels.count <= 2048 and pixels.pixel_m <= 80.001e-9
    assert pixels.per_period >= 16 and pixels.periods >= 8
    assert pixels.length_m == pytest.approx(pixels.periods * period_um * 1e-6, rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("random", ["", f"&{_RANDOM}", f"&{_RANDOM}&direction_disorder_deg=10"])
def test_edges_wrap(kind, random):
    """The step over the edge is one of the steps inside. Where heights jump, random depths set the highest step, so
    the mean step over the edge is compared instead."""
    accepted = [pair for pair in random.split("&") if pair.partition("=")[0] in KINDS[kind].defaults]
    hm = make_grating(f"grating:{kind}?" + "&".join(["period_um=2", *accepted]))
    smooth = kind in ("sinusoidal", "hexagonal", "brushed", "groove", "echelle") or not random
    for axis in (0, 1):
        inside = np.abs(np.diff(hm.height_m, axis=axis))
        over = np.abs(np.take(hm.height_m, 0, axis) - np.take(hm.height_m, -1, axis))
        if smooth:
            assert over.max() <= inside.max() * (1 + 1e-9)
        else:
            assert over.mean() <= inside.mean(axis=1 - axis).max() * 1.5


@pytest.mark.short("-0.8", "-4.0", "-1.5")
@pytest.mark.parametrize(("kind", "asked"), [
    *((kind, period) for kind in (*_LINES, "crossed", "hexagonal", "pits") for period in (0.8, 2.0)),
    ("groove", 4.0), ("groove", 6.0), ("brushed", 1.5),
])  # fmt: skip
def test_info_finds_the_asked_period(kind, asked):
    """To half a bin of the spectrum, and for brushed metal to the width of its lobe."""
    hm = make_grating(f"grating:{kind}?period_um={asked}")
    found = describe(hm)
    tolerance = 0.25 if kind == "brushed" else 0.5 * asked * 1e-6 / hm.size_m[1]
    along_t = [p for p, a in zip(found.periods_m, found.period_angles_deg, strict=True) if abs(a) < 5]
    assert along_t[0] == pytest.approx(asked * 1e-6, rel=tolerance)
    assert found.periods_m[0] == pytest.approx(asked * 1e-6, rel=tolerance)


def _efficiencies(hm, turns_per_m):
    """The light in the orders of a line grating, from one period of its map, at a path difference in wavelengths."""
    period_m = parse_grating(hm.source).period_m
    row = hm.height_m[:1, : pixels_of(period_m).per_period]
    relief = Relief(row - row.mean(), (np.ones(1), np.ones(row.size)), (period_m, period_m / row.size), periodic=True)
    orders = np.arange(-4, 5)
    grid = FrequencyGrid(np.zeros(1), orders / period_m, row.shape)
    scattered, zero = scattered_spectrum(relief, turns_per_m, grid)
    return {**dict(zip(orders.tolist(), scattered[0].tolist(), strict=True)), 0: float(zero)}


_TURNS = 0.7


def _sine(order, turns):
    return bessel_j(math.pi * turns, abs(order) + 1)[abs(order)] ** 2


def _rectangle(duty):
    def of(order, turns):
        if order == 0:
            return abs(1 - duty + duty * np.exp(2j * np.pi * turns)) ** 2
        return (2 * math.sin(math.pi * turns) * math.sin(math.pi * order * duty) / (math.pi * order)) ** 2

    return of


def _blaze(order, turns):
    return float(np.sinc(turns + order) ** 2)


def _facets(order, turns):
    """The integral of exp(-2 pi i (turns h(x) + order x)) over both facets."""
    long = math.cos(math.radians(10)) ** 2
    up, down = 2j * np.pi * (turns / long + order), 2j * np.pi * (order - turns / (1 - long))
    first = (1 - np.exp(-up * long)) / up
    start = np.exp(-2j * np.pi * (turns + order * long))
    return abs(first + start * (1 - np.exp(-down * (1 - long))) / down) ** 2


@pytest.mark.parametrize(
    ("text", "formula", "tolerance"),
    [
        ("sinusoidal?period_um=2.5", _sine, 1e-12),
        ("binary?period_um=2.5", _rectangle(0.5), 3e-3),
        ("binary?period_um=5&duty=0.25", _rectangle(0.25), 3e-3),
        ("blazed?period_um=20", _blaze, 1e-3),
        ("echelle?period_um=20", _facets, 2e-3),
    ],
)
def test_orders_have_the_efficiencies_of_closed_forms(text, formula, tolerance):
    """The sum over N pixels is the mid-point rule of the Fourier integral, whose error falls as 1 / N^2 for profiles
    that jump between pixels; N is 32 to 250."""
    hm = make_grating(f"grating:{text}")
    depth_m = parse_grating(hm.source).depth_m
    found = _efficiencies(hm, _TURNS / depth_m)
    for order, value in found.items():
        assert value == pytest.approx(formula(order, _TURNS), abs=tolerance), order


def test_crossed_is_the_product_of_two_lines():
    """A square lattice of shallow posts has the Fourier series of the product of two rectangles."""
    hm = make_grating("grating:crossed?period_um=2&depth_nm=100")
    series = np.fft.fft2(hm.height_m) / hm.height_m.size
    n = pixels_of(2e-6).periods
    for i, j in ((1, 0), (0, 1), (1, 1), (3, 1)):
        expected = 100e-9 * 0.25 * np.sinc(i / 2) * np.sinc(j / 2)
        # Sampling at 26 pixels a period changes sinc to a ratio of sines, (pi m / 26)^2 / 6 = 2 % at m = 3.
        assert abs(series[i * n, j * n]) == pytest.approx(abs(expected), rel=0.03)


def test_hexagonal_has_six_equal_first_orders():
    hm = make_grating("grating:hexagonal")
    series = np.abs(np.fft.fft2(hm.height_m)) / hm.height_m.size
    n = pixels_of(1.5e-6).periods
    m = round(hm.size_m[0] / (1.5e-6 * 2 / math.sqrt(3)))
    # Three first orders of a lattice with its rows a period apart; the opposite ones are conjugate.
    np.testing.assert_allclose([series[m, n // 2], series[-m, n // 2]], series[0, n], rtol=1e-3)


def test_a_groove_swings_by_its_modulation():
    hm = make_grating("grating:groove?period_um=5&modulation_nm=400&wave_um=4")
    pixels = pixels_of(5e-6)
    lines = -hm.height_m.reshape(hm.rows, pixels.periods, pixels.per_period)
    middle = (lines * np.arange(pixels.per_period)).sum(-1) / lines.sum(-1) * pixels.pixel_m
    swing = np.abs(middle - 2.5e-6).max(axis=0)
    # Each groove reaches the modulation, to half a pixel (the pixels' middles are at half-integers).
    np.testing.assert_allclose(swing, 400e-9, atol=pixels.pixel_m)
    spectrum = np.abs(np.fft.rfft(middle - middle.mean(axis=0), axis=0)).mean(axis=1)
    waves = np.arange(len(spectrum)) / hm.size_m[0]
    band = (waves > 1 / 33e-6) & (waves < 1 / 3.9e-6)
    assert spectrum[~band].max() < 0.01 * spectrum[band].max()


def test_disorders_have_their_sizes():
    """Of random values n deep the standard deviation is known to 1 / sqrt(2 n); three of these are allowed."""
    widths = np.diff(line_starts(np.random.default_rng(0), 2000, 0.1))
    assert widths.mean() == pytest.approx(1, rel=1e-12)
    assert widths.std() == pytest.approx(0.1, rel=3 / math.sqrt(4000))
    depths = make_grating("grating:crossed?period_um=0.8&depth_nm=100&depth_disorder=0.2").height_m.max()
    assert 150e-9 < depths < 220e-9
    bent = make_grating("grating:sinusoidal?direction_disorder_deg=10")
    gy, gx = np.gradient(bent.height_m)
    # Directions of the lines, weighted by the squared slope (the structure tensor). The shift changes along T too, by
    # a fifth of its slope along B.
    turns = np.arctan2(gy, gx)[np.hypot(gx, gy) > 0.5 * np.hypot(gx, gy).max()]
    turned = np.degrees((turns + np.pi / 2) % np.pi - np.pi / 2)
    assert turned.std() == pytest.approx(10, rel=0.15)


def test_one_disorder_does_not_change_the_values_of_another():
    plain, deep = (make_grating(f"grating:binary?period_disorder=0.1{more}") for more in ("", "&depth_disorder=0.2"))
    np.testing.assert_array_equal(plain.height_m > 0, deep.height_m > 0)


def test_brushed_has_the_rms_of_its_depth():
    hm = surface_of(parse_grating("grating:brushed?depth_nm=200"))
    assert hm.height_m.std() == pytest.approx(200e-9 / (2 * math.sqrt(2)), rel=1e-12)


def test_every_parameter_belongs_to_a_kind():
    used = {name for kind in KINDS.values() for name in kind.defaults}
    assert used == set(PARAMETERS)
    for kind in KINDS.values():
        for name, default in kind.defaults.items():
            assert PARAMETERS[name].low <= default <= PARAMETERS[name].high


def test_the_page_has_every_kind_and_parameter():
    page = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")
    disorders = [name for name in PARAMETERS if "disorder" in name]
    for name, kind in KINDS.items():
        own = [
            f"`{p}` {kind.defaults[p]:g}" for p in PARAMETERS if p in kind.defaults and p not in (*disorders, "seed")
        ]
        random = [f"{kind.defaults[p]:g}" if p in kind.defaults else "-" for p in disorders]
        assert f"| `{name}` | {kind.help} | {', '.join(own)} | {' | '.join(random)} |\n" in page
    for name, number in PARAMETERS.items():
        assert re.search(rf"^\| `{name}` \| [A-Z].+ \| {number.low:g} to {number.high:.10g} \|$", page, re.MULTILINE)
    for name, (number, _, _) in PERIOD_UNITS.items():
        assert name == "period_um" or f"`{name}` ({number.low:g} to {number.high:g})" in page.replace("\n", " ")

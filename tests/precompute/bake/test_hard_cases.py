# SPDX-License-Identifier: GPL-3.0-or-later
"""Every hard case matches the reference or is refused with the reason (docs/data_flow.md, Hard surfaces).

The surfaces and what each is compared with come from `./dev bench hard_cases`. To save time the bakes here skip their
self-check, which other tests cover."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from laboratory.benchmarks import hard_cases
from laboratory.benchmarks.hard_cases import CASES, COHERENCE_M, PIXEL_M, Case, outcome, scan, skin
from precompute.bake.ensemble import bake, plan
from precompute.bake.needs import EVERYTHING
from precompute.bake.plan import kernel_for
from precompute.bake.request import BakeRequest
from precompute.base.failure import GratingError
from precompute.cli.parser import main
from precompute.measure.errors import measure
from precompute.optics import coherence
from precompute.surface.relief import prepare
from precompute.table import atlas

BY_NAME = {case.name: case for case in CASES}
REFUSED = {
    "1 x 1": "too small to average 30 coherence areas",
    "2 x 2": "0.16 x 0.16 um, is too small",
    "nothing but NaN": "every height is missing",
    "coherence longer than the patch": "longer than the scan, 10.2 x 10.2 um, .* ask for at most 10.24 um",
    "coherence under a wavelength": "ask for at least 0.55 um",
}
# Cases whose figures have their own test.
FIGURES = ("theta of 89.9 degrees", "u = v = 0", "period under the shortest wavelength", "half-float underflow")


def stored(relief, coherence_m, needs=EVERYTHING):
    """A relief's table, as read from its file."""
    return atlas.unpack(*atlas.pack(bake(relief, BakeRequest(coherence_length_m=coherence_m, needs=needs))))


def assert_kept(found):
    """Check the asked accuracy: a dE00 of 1 for 99 % of the light, and 1 % of the luminance."""
    assert found.refusal == ""
    assert found.errors.pairs >= 40
    assert found.errors.p99 < 1
    assert found.errors.relative_dy < 0.01
    # Half floats round white by 2^-12, and the series has an error of twice 1e-4. Holes and steps change the surface
    # itself.
    assert found.errors.zero_order_dy < 3e-3


@pytest.mark.short("non-square pixels", "NaN holes")
@pytest.mark.parametrize("name", [name for name in BY_NAME if name not in REFUSED and name not in FIGURES])
def test_the_bake_is_the_reference(name):
    assert_kept(outcome(replace(BY_NAME[name], figures=None), stored))


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_refused_in_one_line(name):
    with pytest.raises(GratingError, match=REFUSED[name]) as caught:
        stored(prepare(BY_NAME[name].surface()), BY_NAME[name].coherence_m)
    assert "\n" not in str(caught.value)


@pytest.mark.night("test_the_bake_is_the_reference")
def test_at_grazing_the_light_is_right_and_no_more_than_was_received():
    """The largest albedo is found to a hundredth (test_largest_albedo.py)."""
    found = outcome(BY_NAME["theta of 89.9 degrees"], stored)
    assert_kept(found)
    assert 0.5 < found.figures["albedo of a mirror"] <= 1.01
    assert 0.1 < found.figures["albedo of keratin"] <= 1.01


def test_in_the_middle_the_zero_order_is_bessels():
    """The tolerance is the rounding of half floats, 2^-12 of 1, and twice the 1e-4 of the amplitude's series."""
    found = outcome(BY_NAME["u = v = 0"], stored)
    assert_kept(found)
    assert found.figures["zero order against J0^2"] < 5e-4


@pytest.mark.night("test_the_table_tells_of_errors_and_refusals")
def test_a_deep_relief_is_kept_in_floats():
    """Half floats round terms by 2^-12. At its darkest a relief of 2 um has terms ten thousand times their sum."""
    relief = prepare(scan(skin(96, 96, 2e-6)))
    baked = bake(relief, BakeRequest(coherence_length_m=COHERENCE_M))
    assert baked.precision is np.float32
    truth = hard_cases.anywhere(relief, baked.sigma_b)
    halves = atlas.unpack(*atlas.pack(replace(baked, precision=np.float16)))
    assert measure(truth, halves.candidate).p99 > 5
    assert (
        plan(prepare(scan(skin(96, 96, 200e-9))), BakeRequest(coherence_length_m=COHERENCE_M)).precision is np.float16
    )


@pytest.mark.night("test_the_table_tells_of_errors_and_refusals")
def test_a_shallow_relief_does_not_vanish_in_halves():
    """Scattered light grows with the square of the height, apart from (2 pi s h)^2 = 3e-6. A relief of 0.05 nm thus
    scatters 1/400 of the light of one of 1 nm. Half floats keep this, since they round both by 2^-11."""
    case = BY_NAME["half-float underflow"]
    assert_kept(outcome(replace(case, figures=None), stored))
    shallow, deep = (stored(prepare(scan(skin(relief_m=h))), COHERENCE_M) for h in (0.05e-9, 1e-9))
    assert shallow.precision is np.float16
    u, v = np.random.default_rng(0).uniform(-0.4, 0.4, (2, 300))
    one, other = (each.scattered_over_w2(u, v, 1.2)[:, 1] for each in (shallow, deep))
    # The series of one nanometre is exact to 2e-4 of its light. The faintest place has 1 % of the brightest's light.
    np.testing.assert_allclose(400 * one, other, rtol=5e-3, atol=1e-3 * other.max())


def test_a_period_under_the_shortest_wavelength_is_dark_from_above():
    """sin(t) = 380 / 250 is no direction. For light at 80 degrees the order goes back at 0.54. The nearest real
    direction is eight standard deviations of the kernel (0.06) away: exp(-32)."""
    found = outcome(BY_NAME["period under the shortest wavelength"], stored)
    assert_kept(found)
    assert found.figures["Y, light at 80 degrees"] > 0.01
    assert found.figures["Y, light at 0 degrees"] < 1e-9


def test_steps_scatter_what_their_rounding_is():
    """Rounding to steps of d has the standard deviation d / sqrt(12) if the surface crosses many steps. Here it crosses
    25, on 16384 pixels."""
    step = 2e-6 / 255
    off = prepare(hard_cases.stepped(step)).height_m - prepare(scan(skin())).height_m
    assert off.std() == pytest.approx(step / 12**0.5, rel=0.05)


@pytest.mark.night("test_the_bake_is_the_reference")
def test_narrow_orders_leave_no_gaps_at_the_rim():
    """The wavelengths follow the kernel: their sum is flat to 1e-3 at |u| = 2. The cubic reading adds less than 1 % of
    a sum of overlapping orders. With half as many wavelengths an order moves by 3.2 standard deviations, and the sum is
    flat only to 2 exp(-2 pi^2 / 3.2^2) = 29 %."""
    case = BY_NAME["orders narrower than the wavelength step"]
    relief = prepare(case.surface())
    figures = hard_cases.fewer_wavelengths(relief, stored(relief, case.coherence_m))
    assert figures["wavelengths"] > 81
    assert figures["off near the rim"] < 0.011
    assert figures["with half of them"] > 0.1


def test_the_width_of_a_single_row_does_not_count():
    """A single row is a profile. 30 areas are 30 shifts of sqrt(2) sigma_s along it."""
    row = skin()[:1]
    kernels = [kernel_for((prepare(scan(row, (dy, PIXEL_M))),), BakeRequest()) for dy in (10e-9, 80e-9)]
    assert kernels[0] == kernels[1] == pytest.approx(coherence.kernel_sigma(4 * 128 * PIXEL_M / 30 / 2**0.5))


@pytest.mark.parametrize("asked_m", [None, 16 * PIXEL_M])
def test_a_thin_scan_has_no_coherence_over_its_width(asked_m):
    """The apodisation's width is at most sqrt(2 / 3) of the kernel's at 780 nm, also for an asked coherence length. Its
    equivalent noise bandwidth is 0.75 / 0.64 (Harris 1978), up to the sampling of 16 pixels."""
    thin = prepare(scan(skin(16, 4096)))
    window = 0.75 / 0.64 / (np.sqrt(2 * np.pi) * 16 * PIXEL_M)
    least = 780e-9 * window / np.sqrt(2 / 3)
    assert kernel_for((thin,), BakeRequest(coherence_length_m=asked_m)) == pytest.approx(least, rel=1e-2)


def test_a_thin_scan_is_refused_that_holds_no_wavelength_across():
    """However long it is: 5 pixels of 80 nm are 0.4 um."""
    with pytest.raises(GratingError, match="is too small to average"):
        kernel_for((prepare(scan(skin(5, 4096))),), BakeRequest())


def test_a_pixel_is_refused_on_the_command_line(tmp_path, capsys):
    Image.fromarray(np.zeros((1, 1), np.uint8)).save(tmp_path / "pixel.png")
    asked = ["--size-um", "0.08", "--height-nm", "100", "--progress", "none", "--no-cache"]
    assert main(["bake", str(tmp_path / "pixel.png"), *asked, "-o", str(tmp_path / "out")]) == 1
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_the_table_tells_of_errors_and_refusals():
    kept = outcome(Case("flat", "zeros", lambda: scan(np.zeros((32, 32)))), stored)
    assert kept.text == "dE00 0.00, dY 0.00%"
    assert outcome(BY_NAME["nothing but NaN"]).text.startswith("refused: the scan: every height is missing")

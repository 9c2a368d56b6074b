# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes with channels for several lamps: the same XYZ as a plain bake, and the colours under each lamp."""

from dataclasses import replace

import numpy as np
import pytest

from precompute.bake.ensemble import bake, plan
from precompute.bake.make import make
from precompute.bake.request import BakeRequest
from precompute.bake.self_check import LAMPS, judge
from precompute.base.progress import silent
from precompute.reflectance.matter import parse
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare
from precompute.table import atlas

COHERENCE_M = 12e-6


def request_for(illuminant, matter="dielectric"):
    return BakeRequest(coherence_length_m=COHERENCE_M, illuminant=illuminant, matter=parse(matter))


@pytest.fixture(scope="module")
def disc():
    return prepare(read_height_map("sample:cd"))


@pytest.fixture(scope="module")
def made(disc):
    """The bake under an illuminant, with its errors; made once for each."""
    found = {}

    def of(illuminant, matter="dielectric"):
        if (illuminant, matter) not in found:
            found[illuminant, matter] = make([disc], request_for(illuminant, matter))
        return found[illuminant, matter]

    return of


@pytest.fixture(scope="module", params=["dielectric", "gold"])
def matter(request):
    return request.param


@pytest.mark.short("dielectric")
def test_the_first_channels_are_those_of_a_plain_bake(disc, matter):
    """Planned and summed alike, before the functions of w are learnt: the same products with the same weights. A matrix
    product may sum them in another order, and single precision rounds some hundred terms by 1e-5 of the largest."""
    plain, more = (bake([disc], request_for(illuminant, matter)) for illuminant in ("D65", "D65+smooth"))
    assert more.terms.shape[-1] == more.zero_order.shape[-1] == 6 and len(plain.terms) == len(more.terms)
    np.testing.assert_array_equal(more.basis, plain.basis)
    largest = np.abs(plain.terms).max()
    np.testing.assert_allclose(more.terms[..., :3], plain.terms, rtol=0, atol=1e-5 * largest)
    np.testing.assert_allclose(more.zero_order[:, :3], plain.zero_order, atol=1e-6)


@pytest.mark.night("test_the_first_channels_are_those_of_a_plain_bake")
def test_a_file_s_xyz_are_those_of_a_plain_bake(disc, made, matter):
    """Both files have fewer functions of w than the table that they are learnt from, and half floats. Its XYZ are the
    same for both (the test above), so the files differ by at most the sum of what each loses. The functions are learnt
    from all channels, but the strongest shapes are those of the light itself: the files are closer to each other than
    the plain one is to the table."""
    whole = bake([disc], request_for("D65", matter))
    plain, more = made("D65", matter).table, made("D65+smooth", matter).table
    rng = np.random.default_rng(0)
    u, v, w = rng.uniform(-1.4, 1.4, 4000), rng.uniform(-1.4, 1.4, 4000), rng.uniform(0.5, 2, 4000)
    right, one, other = (table.scattered_over_w2(u, v, w) for table in (whole, plain, more))
    apart, lost = np.abs(one - other).max(), np.abs(one - right).max()
    print(f"{matter}: {apart / np.abs(right).max():.1e} apart, {lost / np.abs(right).max():.1e} lost")
    assert len(plain.terms) == len(more.terms) < len(whole.terms) and 0 < apart <= lost
    np.testing.assert_allclose(more.zero_order_xyz(w), plain.zero_order_xyz(w), atol=2.0**-10)


@pytest.mark.night("test_the_first_channels_are_those_of_a_plain_bake")
def test_its_colours_under_lamps_are_right(made, matter):
    """The self-check's figures: within the dE00 of 1 that the bake is asked for under black bodies and daylight at the
    95th percentile. Under a part of the illuminant they are as right as under daylight, at the worst w: at most twice
    as far off, as another spectrum has other colours."""
    plain, smooth, tube = (made(illuminant, matter) for illuminant in ("D65", "D65+smooth", "D65+FL11"))
    for each in (plain, smooth, tube):
        assert tuple(each.lamps) == LAMPS
    assert max(smooth.lamps[lamp].p95 for lamp in ("2000K", "2700K", "4000K", "10000K", "D5500")) <= 1
    assert tube.lamps["FL11"].p95 <= min(1, 2 * tube.errors.p95_of_w)
    # Daylight's bake times a lamp's colour is several times as far off.
    assert plain.lamps["2700K"].p95 > 5 and plain.lamps["FL11"].p95 > 5
    facts = smooth.delta_e
    assert facts["lamps"]["2700K"] == [round(smooth.lamps["2700K"].mean, 2), round(smooth.lamps["2700K"].p95, 2)]
    assert all(claim >= facts["lamps"][lamp][1] for lamp, claim in facts["lamps_claim"].items())


@pytest.mark.night("test_the_first_channels_are_those_of_a_plain_bake")
def test_wrong_channels_are_errors_under_lamps_only(disc):
    """The judge reads each channel: without those beyond XYZ, colours under lamps are wrong, and XYZ are right."""
    chosen = plan([disc], request_for("D65+smooth"))
    table = bake([disc], request_for("D65+smooth"))
    found = judge([disc], chosen, "D65+smooth", progress=silent)
    right = found.errors_under_lamps(table)["2700K"]
    for channel in range(3, 6):
        terms = table.terms.copy()
        terms[..., channel] = 0
        wrong = replace(table, terms=terms)
        assert found.errors_under_lamps(wrong)["2700K"].p95 > 2 * right.p95
        assert found.errors_of(wrong).p99 == found.errors_of(table).p99


@pytest.mark.night("test_the_first_channels_are_those_of_a_plain_bake")
def test_a_table_under_a_lamp_is_a_plain_table_of_it(made):
    """`under` gives what the lamp's own bake holds: the part's channels, which are summed as in a bake under it."""
    both = made("D65+FL11").table
    own = both.under("FL11")
    assert (own.illuminant, own.terms.shape[-1], len(own.wider)) == ("FL11", 3, len(both.wider))
    np.testing.assert_array_equal(own.terms, both.terms[..., 3:])
    np.testing.assert_array_equal(own.zero_order, both.zero_order[:, 3:])
    image, layout = atlas.pack(own)
    assert layout.is_valid and layout.triples == 1 and np.isfinite(image).all()


@pytest.mark.night("tests/precompute/bake/test_spread.py")
def test_under_another_light_than_daylight_no_lamps_are_stated(made):
    assert made("2700K").lamps == {} and "lamps" not in made("2700K").delta_e

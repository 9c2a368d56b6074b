# SPDX-License-Identifier: GPL-3.0-or-later
"""The traffic lights of a scan: each fault changes only its own light."""

import json

import numpy as np
import pytest

from precompute.surface.height_map import HeightMap
from precompute.surface.quality import LIGHTS, Finding, Quality, describe
from precompute.surface.readers.reader_registry import read_height_map

PIXEL = 50e-9
TOPICS = ["pixel", "slopes", "period", "tilt", "dirt", "steps", "tip"]


def grating(count=256, pixel=PIXEL, *, period=1000e-9, amplitude=40e-9):
    """Lines across T with 0.3 nm of noise."""
    x = np.arange(count) * pixel
    noise = 0.3e-9 * np.random.default_rng(0).standard_normal((count, count))
    return amplitude * np.sin(2 * np.pi * x / period) + noise


def findings(height, pixel=PIXEL, **options):
    quality = describe(HeightMap(height, (pixel, pixel), "scan", **options)).quality
    return quality, {finding.topic: finding for finding in quality.findings}


def test_a_good_scan_is_good_in_everything():
    quality, found = findings(grating())
    assert [finding.light for finding in quality.findings] == ["good"] * 7, quality.in_words()
    assert list(found) == TOPICS
    assert quality.light == "good" and quality.in_words()[0] == "quality: good"
    assert "12.8 times" in found["period"].sentence


def test_the_whole_is_as_its_worst():
    lights = [("a", "good"), ("b", "poor"), ("c", "usable")]
    quality = Quality(tuple(Finding(topic, light, "so it is", 1.0) for topic, light in lights))
    assert quality.light == "poor"
    assert quality.in_words() == [
        "quality: poor",
        "  a: good; so it is",
        "  b: poor; so it is",
        "  c: usable; so it is",
    ]
    assert json.loads(json.dumps(quality.as_dict()))["findings"][1] == {
        "topic": "b", "light": "poor", "sentence": "so it is", "figure": 1.0
    }  # fmt: skip


def worse(height, topic, light, *, pixel=PIXEL):
    """The finding of a topic, which must have this light; all other lights must be good."""
    quality, found = findings(height, pixel)
    lights = {name: finding.light for name, finding in found.items()}
    assert lights == {**dict.fromkeys(TOPICS, "good"), topic: light}, quality.in_words()
    assert quality.light == light
    return found[topic]


@pytest.mark.parametrize(
    ("pixel", "light"), [(90e-9, "good"), (100e-9, "usable"), (189e-9, "usable"), (191e-9, "poor")]
)
def test_pixels_against_light(pixel, light):
    """Two pixels of 95 nm resolve 190 nm, the finest period that diffracts."""
    assert findings(grating(pixel=pixel, period=4e-6), pixel)[1]["pixel"].light == light


def test_pixels_against_the_period():
    found = worse(grating(period=6 * PIXEL, amplitude=10e-9), "pixel", "usable")
    assert "6 pixels to a period" in found.sentence
    coarse = grating(pixel=90e-9, period=3.5 * 90e-9, amplitude=10e-9)
    assert worse(coarse, "pixel", "poor", pixel=90e-9).figure == 90e-9


def test_steep_flanks():
    """A triangle wave with one flank in eight steeper than 45 degrees."""
    x = np.arange(256) % 32
    saw = np.where(x < 28, x / 28, (32 - x) / 4) * 300e-9 + 0.3e-9 * np.random.default_rng(0).standard_normal(
        (256, 256)
    )
    found = findings(saw)[1]["slopes"]
    assert found.light == "poor" and found.figure == pytest.approx(1 / 8, abs=0.01) and "12% of it" in found.sentence
    assert findings(saw / 10)[1]["slopes"].light == "good"


def test_a_grating_of_few_repeats_is_only_likely():
    found = worse(grating(period=1.4e-6, amplitude=60e-9), "period", "usable")
    assert found.sentence.startswith(
        "1400 nm at 0 deg is likely: it repeats 9.14 times, and stands over 1000 times over"
    )


def test_a_fine_period_says_where_its_colours_are():
    """555 nm / 320 nm = 2 sin 60.1 deg."""
    sentence = findings(grating(pixel=20e-9, period=320e-9), 20e-9)[1]["period"].sentence
    assert "green shows only on the lamp's side, with lamp and view both about 60 deg from the normal" in sentence
    assert "lamp's side" not in findings(grating(pixel=20e-9, period=640e-9), 20e-9)[1]["period"].sentence


def test_no_grating_is_poor():
    noise = 2e-9 * np.random.default_rng(0).standard_normal((256, 256))
    assert findings(noise)[1]["period"].light == "poor"


def test_the_periods_confidence_is_the_gratings_and_not_the_wavinesss():
    x = np.arange(256) * PIXEL
    waviness = 200e-9 * np.sin(2 * np.pi * x[:, None] / 9e-6)
    found = findings(grating() + waviness)[1]["period"]
    assert found.sentence.startswith("1000 nm at 0 deg is sure: it repeats 12.8 times")


@pytest.mark.parametrize(("degrees", "light"), [(1.9, "good"), (2.1, "usable"), (9.9, "usable"), (10.1, "poor")])
def test_tilt_is_told_in_degrees(degrees, light):
    """The tilt is along the diagonal. A grating of whole periods adds almost no slope."""
    y, x = np.indices((256, 256)) * PIXEL / np.sqrt(2)
    found = findings(grating(period=16 * PIXEL) + np.tan(np.radians(degrees)) * (x - y))[1]["tilt"]
    assert found.light == light and found.figure == pytest.approx(degrees, abs=0.05)


def test_dust_is_told_with_its_remedy():
    height = grating()
    height[100:108, 60:68] += 400e-9
    found = findings(height)[1]["dirt"]
    assert found.light == "usable" and found.sentence.endswith(
        "like dust or scratches; bake it with --level plane,dust"
    )
    assert found.figure == pytest.approx(64 / 65536, rel=0.7)
    height[150, 20:90] += 200e-9
    both = findings(height)[1]["dirt"].sentence
    assert "like scars" in both and both.endswith("--level plane,dust,scars")


def test_holes_are_told():
    height = grating()
    height[:20] = np.nan
    found = findings(height)[1]["dirt"]
    assert found.light == "poor" and found.sentence == "7.81% of it is missing"
    assert findings(grating())[1]["dirt"].sentence == "nothing is seen"


@pytest.mark.parametrize(("step_nm", "light"), [(1, "good"), (5, "usable"), (20, "poor")])
def test_coarse_steps_of_the_heights(step_nm, light):
    """At 380 nm a step of 3 nm turns the phase by 4 pi 3 / 380 = 0.1 rad, a step of 15 nm by 0.5 rad."""
    height = np.round(grating() / (step_nm * 1e-9)) * step_nm * 1e-9
    found = findings(height)[1]["steps"]
    assert found.light == light and found.figure == pytest.approx(step_nm * 1e-9)
    assert f"steps of {step_nm} nm" in found.sentence


def test_heights_of_floating_point_have_no_steps():
    assert findings(grating())[1]["steps"].sentence == "the heights come in steps finer than 0.01 nm"


def test_tops_that_a_tip_has_rounded():
    """Circles side by side, as a round tip draws repeated fine edges: valleys are cusps."""
    x = (np.arange(256) * 10e-9 + 1e-9) % 400e-9 - 200e-9
    tops = np.sqrt((250e-9) ** 2 - x**2) + np.zeros((256, 1))
    found = findings(tops, 10e-9)[1]["tip"]
    # In the middle of a pixel at a cusp: 10 nm * 2 * 0.8 / 1.5 over (10 nm)^2, and 1 / 250 nm at a top.
    assert found.light in ("usable", "poor") and "a blunt tip" in found.sentence and "tip:NM" in found.sentence
    assert findings(-tops, 10e-9)[1]["tip"].light == "good"


def test_a_synthetic_surface_has_no_faults_of_a_microscope():
    """Its few heights are not coarse steps, and its facets are not tilt."""
    _, found = findings(np.round(grating(period=16 * PIXEL), 8), periodic=True)
    assert list(found) == ["pixel", "slopes", "period"]


@pytest.mark.parametrize("shape", [(1, 1), (1, 200), (200, 1), (2, 2), (3, 3)])
def test_the_smallest_scans_are_judged(shape):
    quality, _ = findings(np.arange(np.prod(shape)).reshape(shape) * 1e-9)
    assert quality.light in LIGHTS
    json.dumps(quality.as_dict(), allow_nan=False)


def test_the_real_skins(shared_data):
    """Known facts: clean rows at 87.5 degrees with fingers 531 and 584 nm apart, and height steps of 3.2 nm."""
    elaphe, xenopeltis = (
        describe(read_height_map(str(shared_data / "snake" / f"{name}_65um.png"), size_um=65, height_nm=height)).quality
        for name, height in (("elaphe", 375), ("xenopeltis", 818.69))
    )
    assert elaphe.light == "good"
    found = {finding.topic: finding for finding in xenopeltis.findings}
    assert xenopeltis.light == "usable"
    assert found["period"].light == "good" and found["period"].sentence.startswith("1501 nm at 87 deg is sure")
    assert "545.4 nm at 4 deg" in found["period"].sentence
    assert found["steps"].figure == pytest.approx(818.69e-9 / 255, rel=1e-6)
    assert found["dirt"].light == "usable" and found["dirt"].sentence.endswith("--level plane,dust")


@pytest.mark.parametrize(
    "scale, side, told",
    [
        (1e-5, 1.0, "the relief of 0.85 pm is finer than an atom; is the unit of height right?"),
        (0.0, 1.0, "no relief; is the unit of height right?"),
        (10.0, 1e-3, "the relief of 849 nm is larger than the scan, 12.8 nm wide; is the width right, and the"),
    ],
)
def test_a_relief_that_no_scan_has_asks_for_its_size(scale, side, told):
    quality, found = findings(grating() * scale, PIXEL * side)
    assert quality.light == found["size"].light == "poor"
    assert told in found["size"].sentence
    assert found["size"] is quality.findings[0]


@pytest.mark.parametrize("scale", [1e-3, 1.0, 100.0])
def test_a_relief_that_a_scan_may_have_is_not_questioned(scale):
    assert "size" not in findings(grating() * scale)[1]


def test_the_relief_of_the_real_skin_over_a_thousandth_of_its_width(shared_data):
    path = str(shared_data / "snake" / "xenopeltis_65um.png")
    quality = describe(read_height_map(path, 0.065, 818.69)).quality
    assert quality.findings[0].sentence.endswith("65 nm wide; is the width right, and the unit of height?")
    assert not [each for each in describe(read_height_map(path, 65, 818.69)).quality.findings if each.topic == "size"]

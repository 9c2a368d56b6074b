# SPDX-License-Identifier: GPL-3.0-or-later
"""If a file holds both scan directions, a grating must be in both."""

import json
from functools import partial

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.cli.parser import main
from precompute.surface.height_map import HeightMap
from precompute.surface.quality import describe
from precompute.surface.readers.reader_registry import read_height_map, read_other_way
from precompute.surface.readers.scan_file import other_way
from precompute.surface.steps.pipeline import level, parse_steps
from tests.hostile import instruments, microscopes
from tests.precompute.surface.scan_files import NID_CHANNELS, PIXEL_M, TILTED, gwy_bytes, nid_bytes
from tests.precompute.surface.test_waves import shifted_rows

COUNT = 256
Y, X = np.indices((COUNT, COUNT))
# The scan is 6.4 um wide: eight periods of 800 nm, and 20.3 of the hum's lines along the rows.
GRATING = 5e-9 * np.sin(2 * np.pi * 8 * X / COUNT)
HUM = 30e-9 * np.sin(2 * np.pi * 20.3 * Y / COUNT)
GROUND = [0.3e-9 * np.random.default_rng(seed).standard_normal((COUNT, COUNT)) for seed in range(2)]


def write(folder, forward, backward, channels=NID_CHANNELS):
    path = folder / "scan.nid"
    path.write_bytes(nid_bytes(forward + GROUND[0], channels=channels, backward=backward + GROUND[1]))
    return str(path)


def described(path, **options):
    scan = read_height_map(path, **options)
    return describe(scan, partial(read_other_way, scan))


def period(figures):
    return next(each for each in figures.quality.findings if each.topic == "period")


def test_lines_that_the_way_back_lacks_are_line_noise(tmp_path):
    path = write(tmp_path, GRATING + HUM, GRATING)
    alone = describe(read_height_map(path)).waves
    assert alone.gratings[0].period_m == pytest.approx(6.4e-6 / 20.3, rel=0.001) and alone.noise is None
    figures = described(path)
    (grating,) = figures.waves.gratings
    assert grating.period_m == pytest.approx(800e-9, rel=0.002) and abs(grating.angle_deg) < 1
    assert figures.waves.one_way and figures.waves.noise == alone.gratings[0]
    (line,) = [line for line in figures.in_words() if line.startswith("line noise")]
    assert "315.3 nm at 90 deg" in line and "the scan in the other direction lacks it" in line
    assert line.endswith("compare its channel, or turn the sample by 90 deg and scan it again")
    assert period(figures).sentence.endswith("as the scan in the other direction lacks it, and is left out")


def test_only_such_lines_are_no_grating_at_all(tmp_path):
    figures = described(write(tmp_path, HUM, 0 * HUM))
    assert figures.waves.gratings == () and figures.waves.one_way
    assert period(figures).light == "poor"
    assert period(figures).sentence.endswith("and is left out; turn the sample by 90 deg and scan it again")


def test_the_way_back_is_judged_by_the_way_forth(tmp_path):
    figures = described(write(tmp_path, GRATING, GRATING + HUM), channel="Z-Axis backward")
    assert figures.periods_m == (pytest.approx(800e-9, rel=0.002),) and figures.waves.one_way


def test_a_hum_is_mirrored_on_the_way_back(tmp_path):
    """Time runs from left to right in the forward scan, and from right to left in the backward scan."""
    hums = [10e-9 * np.sin(2 * np.pi * (17 * Y + sign * 6 * X) / COUNT) for sign in (1, -1)]
    waves = described(write(tmp_path, GRATING + hums[0], GRATING + hums[1])).waves
    assert [wave.period_m for wave in waves.gratings] == [pytest.approx(800e-9, rel=0.002)]
    assert waves.noise.repeats == pytest.approx(np.hypot(17, 6), abs=0.1)


@pytest.mark.parametrize("angle", [0, 30, 90])
@pytest.mark.parametrize("repeats", [5.3, 19.6])
@pytest.mark.parametrize("shift", [(0, 0), (3, -5)])
def test_a_grating_of_both_ways_stays(tmp_path, angle, repeats, shift):
    """The backward scan may be shifted, by three rows as on the real grid."""
    turned = X * np.cos(np.radians(angle)) + Y * np.sin(np.radians(angle))
    grating = 10e-9 * np.sin(2 * np.pi * repeats * turned / COUNT)
    path = write(tmp_path, grating, 0.8 * np.roll(grating, shift, (0, 1)))
    assert described(path) == describe(read_height_map(path))
    assert described(path).waves.gratings[0].repeats == pytest.approx(repeats, abs=0.1)


@pytest.mark.parametrize("beside", [0.5, 2.0])
def test_one_bin_is_the_resolution(tmp_path, beside):
    forth, back = (5e-9 * np.sin(2 * np.pi * repeats * Y / COUNT) for repeats in (20, 20 + beside))
    assert bool(described(write(tmp_path, forth, back)).waves.gratings) == (beside < 1)


@pytest.mark.night("test_lines_that_the_way_back_lacks_are_line_noise")
def test_slow_drift_is_seldom_in_both_ways():
    """Of the seeds 0 to 99 a single direction shows a grating in 18, and both in 3; the test takes the second half."""
    found = []
    for seed in range(50, 100):
        rng = np.random.default_rng(seed)
        ways = [
            HeightMap(shifted_rows(rng) + np.cumsum(0.3e-9 * rng.standard_normal((COUNT, 1)), axis=0), (4e-8, 4e-8), "")
            for _ in range(2)
        ]
        found.append([bool(describe(ways[0], other).waves.gratings) for other in (None, lambda each=ways[1]: each)])
    alone, both = np.sum(found, axis=0)
    assert alone == 13 and both == 1


def test_the_real_grid_keeps_its_period(shared_data):
    path = str(shared_data / "nanosurf" / "grid.nid")
    for channel in ("Z-Axis forward", "Z-Axis backward"):
        scan = read_height_map(path, channel=channel)
        other = read_other_way(scan)
        assert {scan.channel, other.channel} == {"Z-Axis forward", "Z-Axis backward"}
        figures = described(path, channel=channel)
        assert figures == describe(scan) and figures.periods_m == (pytest.approx(316.2e-9, rel=0.003),)


@pytest.mark.parametrize(
    "name, channels",
    [
        ("nanosurf/grid.nid", ("Z-Axis forward", "Z-Axis backward")),
        ("formats/st_nid-1.nid", ("Z-AxisSensor forward", "Z-AxisSensor backward")),
        ("formats/st_di-1.di", ("Height trace", "Height retrace")),
        ("formats/st_spot_1-1000nm.ibw", ("Height trace", "Height retrace")),
        ("formats/afmreader_sample_0.jpk", ("Height (measured) trace", "Height (measured) retrace")),
    ],
)
def test_no_real_file_stores_the_way_back_mirrored(shared_data, name, channels):
    """The best match of the two directions is a shift of three pixels at most, and mirroring makes them less alike."""
    forth = read_height_map(str(shared_data / name), channel=channels[0])
    back = read_other_way(forth)
    assert back.channel == channels[1]
    heights = [np.nan_to_num(level(each).height_map.height_m) for each in (forth, back)]
    transforms = [np.fft.rfft2(each) for each in (*heights, heights[1][:, ::-1])]
    alike, mirrored = (np.fft.irfft2(transforms[0] * each.conj(), heights[0].shape) for each in transforms[1:])
    norm = np.sqrt(np.prod([(each**2).sum() for each in heights]))
    row, col = np.unravel_index(alike.argmax(), alike.shape)
    assert alike.max() > 0.85 * norm and alike.max() > mirrored.max()
    assert min(row, alike.shape[0] - row) <= 3 and min(col, alike.shape[1] - col) <= 3


def test_the_other_way_is_read_only_for_a_grating():
    def other():
        read.append(1)

    read = []
    describe(HeightMap(GROUND[0], (25e-9, 25e-9), "noise"), other)
    assert not read
    describe(HeightMap(GRATING + GROUND[0], (25e-9, 25e-9), "grating"), other)
    assert read == [1]


def test_a_file_of_one_way_stays_as_it_is(tmp_path):
    path = write(tmp_path, GRATING + HUM, GRATING, channels=NID_CHANNELS[:2])
    assert read_other_way(read_height_map(path)) is None
    assert described(path) == describe(read_height_map(path))


def test_a_way_back_that_cannot_be_read_does_not_count():
    def other():
        raise GratingError("scan", "damaged", "copy it again")

    scan = HeightMap(GRATING + GROUND[0], (25e-9, 25e-9), "scan")
    assert describe(scan, other) == describe(scan)


def test_info_levels_both_ways_alike(tmp_path, capsys):
    path = write(tmp_path, GRATING + HUM, GRATING)
    for steps in ("plane", "plane,rotate:30", "plane,crop:0.3:0.5:6:6.2"):
        assert main(["info", path, "--level", steps, "--json", "-"]) == 0
        facts = json.loads(capsys.readouterr().out)
        scan = level(read_height_map(path), parse_steps(steps)).height_map
        assert facts["line_noise"]["period_m"] == pytest.approx(describe(scan).periods_m[0], rel=1e-9)
        assert len(facts["periods_m"]) == 1


@pytest.mark.parametrize(
    "make, extension",
    [
        (nid_bytes, "nid"),
        (instruments.ibw, "ibw"),
        (instruments.jpk, "jpk"),
        (instruments.agilent, "mi"),
        (microscopes.ntmdt_mda, "mdt"),
        (microscopes.sxm, "sxm"),
    ],
)
def test_both_ways_of_each_format(tmp_path, make, extension):
    """The makers store negated heights in the backward scan; single precision has 24 bits."""
    path = tmp_path / f"both.{extension}"
    path.write_bytes(make(TILTED) if make is nid_bytes else make(TILTED, PIXEL_M))
    forth = read_height_map(str(path))
    np.testing.assert_allclose(read_other_way(forth).height_m, -forth.height_m, rtol=0, atol=2e-7 * 200e-9)
    assert read_other_way(read_other_way(forth)).channel == forth.channel


@pytest.mark.parametrize("words", [("HeightTrace", "HeightRetrace"), ("Z-Axis forward", "Z-Axis backward")])
def test_both_ways_of_gwyddions_files(tmp_path, words):
    """These files name the directions in their titles, as files that Gwyddion 2.62 makes from a .ibw and a .nid do."""
    fields = {f"/{number}/data": sign * TILTED for number, sign in enumerate((1, -1))}
    titles = {f"/{number}/data/title": word for number, word in enumerate(words)}
    (tmp_path / "both.gwy").write_bytes(gwy_bytes(fields | titles))
    scan = read_height_map(str(tmp_path / "both.gwy"), channel=words[0])
    np.testing.assert_array_equal(read_other_way(scan).height_m, -scan.height_m)


@pytest.mark.parametrize(
    "label, found",
    [
        ("Height trace", "Height Retrace"),
        ("height retrace", "Height trace"),
        ("Topography backward", "Topography forward"),
        ("Height trace 2", "Height retrace 2"),
        ("ZSensor trace", None),
        ("Height", None),
        ("", None),
    ],
)
def test_the_name_of_the_other_way(label, found):
    labels = ("Height trace", "Height Retrace", "Topography forward", "Height retrace 2", "ZSensor retrace 2", "Height")
    assert other_way(label, labels) == found

# SPDX-License-Identifier: GPL-3.0-or-later
import ast
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from precompute.check.direct_sums import PAD, draw_pairs, scattered_cells, scattered_xyz, zero_order_xyz
from precompute.check.table_file import read_table
from precompute.check.verdict import __file__
from precompute.cli import parser
from precompute.cli.map import write_picture
from precompute.colour.observer import spectral_weights, wavelengths
from precompute.optics.coherence import narrowest_averaging_kernel
from precompute.optics.region import Region
from precompute.reference.ensemble import reference_grid, reference_xyz
from precompute.spectra.spectrum import zero_order_amplitude
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.surface.samples.gratings import blazed
from precompute.table import atlas, atlas_file
from precompute.table.atlas_file import read_header
from precompute.table.table import Table

PIXEL, W, STEP_M = 70e-9, 1.6, 100e-9
PICTURE = ("--size-um", "4", "--height-nm", "250")
# A kernel of 0.06 in (u, v): what a turn by 5 degrees moves at the first order.
SHORT = ("--coherence-um", "4")
QUICK = ("--pairs", "1000", "--step-nm", "10", "--progress", "none")


def skin(periodic, shape=(48, 60), seed=3):
    """An irregular grating of 1.05 um along T; nothing about it is symmetric."""
    rng = np.random.default_rng(seed)
    y, x = (np.arange(n) / n for n in shape)
    phase = 0.8 * np.cos(2 * np.pi * (x + y[:, None])) + 0.5 * np.cos(2 * np.pi * (2 * x - y[:, None]) + 1)
    heights = 110e-9 * np.sin(2 * np.pi * 4 * x + phase) + 30e-9 * rng.standard_normal(shape).cumsum(axis=0) / 7
    return prepare(HeightMap(heights, (PIXEL, PIXEL), "test", periodic=periodic))


def places(count=60, seed=1):
    return np.random.default_rng(seed).uniform(-1.4, 1.4, (2, count))


# Independence


ROOT = Path(__file__).parent


def source(target):
    """Where a module of precompute stands, or None if it is none: `target` a path without an ending."""
    return next((path for path in (target.with_suffix(".py"), target / "__init__.py") if path.is_file()), None)


def reached(path, found=()):
    """Sources inside precompute that one imports, through whatever it imports, as paths from precompute."""
    found = set(found)
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.ImportFrom) or not node.level:
            continue
        base = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
        for each in filter(None, [source(base), *(source(base / name.name) for name in node.names)]):
            if each.relative_to(ROOT).as_posix() not in found:
                found = reached(each, found | {each.relative_to(ROOT).as_posix()})
    return found


def test_it_shares_nothing_with_the_bake():
    shared = reached(ROOT / "check.py")
    package = {"__init__.py"}  # which is empty
    assert shared - package == {
        "direct.py", "figures.py", "brdf.py", "colour.py", "failure.py", "height_map.py", "relief.py"
    }  # fmt: skip
    own = {"bake", "atlas", "spectrum", "series", "resample", "albedo", "chebyshev", "coherence", "reference", "metric"}
    own = {f"{name}.py" for name in own}
    assert not shared & own
    # Nor what reads the height maps; and the walk does see what there is to see.
    assert not reached(ROOT / "readers" / "__init__.py") & own
    assert own - {"bake.py"} <= reached(ROOT / "bake.py") | reached(ROOT / "cli.py")


# The truth


def test_where_it_wraps_it_is_the_reference():
    """Both sum the surface's own orders; what this one leaves out lies past 6 sigma, in u or in v, and is at most all
    of the light."""
    relief, sigma_b = skin(periodic=True), 0.03
    u, v = places()
    expected, zero_order = reference_xyz(relief, u, v, w=W, sigma_b=sigma_b, step_m=STEP_M)
    computed = scattered_xyz([relief], u, v, w=W, sigma_b=sigma_b, step_m=STEP_M)
    np.testing.assert_allclose(computed, expected, rtol=0, atol=2 * np.exp(-18) / (2 * np.pi * sigma_b**2))
    assert expected.max() > 1e5 * 2 * np.exp(-18) / (2 * np.pi * sigma_b**2)
    # The zero order's own wavelengths are 1 nm apart: at 1 nm the reference has the same.
    _, zero_order = reference_xyz(relief, u[:1], v[:1], w=W, sigma_b=sigma_b, step_m=1e-9)
    np.testing.assert_allclose(zero_order_xyz([relief], np.array([W]))[0], zero_order, rtol=1e-6)


def folded(relief, lam, sigma_b, lengths):
    """The most by which a sum over frequencies 1 / length apart misses the integral that it stands for, as a density
    over (u, v): lags a length apart are taken for one another, so that each of the autocorrelation's has the kernel's
    weight at its images too."""
    rows, cols = relief.height_m.shape
    p = np.exp(-2j * np.pi * (W / lam) * relief.height_m)
    p = relief.apodisation * (p - (relief.apodisation**2 * p).sum() / (relief.apodisation**2).sum())
    lagged = np.fft.ifft2(np.abs(np.fft.fft2(p, (2 * rows, 2 * cols))) ** 2)
    correlation = np.abs(np.fft.fftshift(lagged)) / (relief.apodisation**2).sum()
    own, images = [], []
    for count, length in zip((rows, cols), lengths, strict=True):
        lag = (np.arange(2 * count) - count) * PIXEL
        weigh = np.exp(-2 * (np.pi * sigma_b / lam * (lag + np.arange(-3, 4)[:, None] * length)) ** 2)
        own.append(weigh[3])
        images.append(weigh.sum(axis=0))
    return (correlation * (np.outer(*images) - np.outer(*own))).sum() * PIXEL**2 / lam**2


def test_where_it_does_not_wrap_it_is_the_reference():
    """To what either misses of the integral; the reference, which pads less, by most."""
    relief = skin(periodic=False)
    sigma_b = narrowest_averaging_kernel(relief.size_m)
    u, v = places()
    lambdas = wavelengths(STEP_M)
    padded = [n * PIXEL for n in reference_grid(relief, sigma_b).transform_shape]
    missed = np.zeros((2, 3))
    for lam, weight in zip(lambdas, spectral_weights(lambdas), strict=True):
        longer = [length + PAD * lam / (2 * np.pi * sigma_b) for length in relief.size_m]
        missed += [weight * folded(relief, lam, sigma_b, lengths) for lengths in (longer, padded)]
    expected, _ = reference_xyz(relief, u, v, w=W, sigma_b=sigma_b, step_m=STEP_M)
    computed = scattered_xyz([relief], u, v, w=W, sigma_b=sigma_b, step_m=STEP_M)
    assert (np.abs(computed - expected) <= missed.sum(axis=0)).all()
    assert (missed[0] < 1e-3 * expected.max(axis=0)).all()
    assert (missed[1] < 0.02 * expected.max(axis=0)).all()


@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize("shape", [(1, 40), (40, 1), (33, 48)])
def test_the_cells_hold_all_the_light(periodic, shape):
    """By Parseval, but for the Nyquist frequency of an even count, which is left out: this relief has next to nothing
    there."""
    y, x = (np.arange(n) / n for n in shape)
    heights = 60e-9 * (np.cos(2 * np.pi * 2 * x) + np.sin(2 * np.pi * y[:, None]) * (shape[0] > 1))
    relief = prepare(HeightMap(heights, (PIXEL, PIXEL), "test", periodic=periodic))
    s = W / 550e-9
    cells = scattered_cells(relief, s, (1e12, 1e12), 5e4)
    zero_order = abs(zero_order_amplitude(relief, s)) ** 2
    assert cells.power.sum() + zero_order == pytest.approx(1, abs=1e-9 if periodic else 1e-4)
    assert cells.power.shape == (len(cells.q_y), len(cells.q_x))


def test_a_facet_sends_the_light_down_its_slope():
    """u = -slope w, whichever road: a ramp one wavelength high, sampled, is the order m = -1 and nothing else."""
    period, lam = 3e-6, 550e-9
    relief = prepare(blazed(period, lam / W, periods=4, rows=1))
    cells = scattered_cells(relief, W / lam, (1e7, 1e7), 1e4)
    at = np.unravel_index(np.argmax(cells.power), cells.power.shape)
    assert cells.q_x[at[1]] == pytest.approx(-1 / period)
    assert cells.power[at] == pytest.approx(1, rel=1e-12)


def test_several_scans_are_their_mean():
    reliefs, (u, v) = [skin(False, seed=3), skin(False, seed=4)], places(10)
    one, other = (scattered_xyz([relief], u, v, w=W, sigma_b=0.1, step_m=STEP_M) for relief in reliefs)
    np.testing.assert_allclose(
        scattered_xyz(reliefs, u, v, w=W, sigma_b=0.1, step_m=STEP_M), (one + other) / 2, rtol=1e-12
    )
    w = np.array([0.0, 0.7])
    one, other = (zero_order_xyz([relief], w) for relief in reliefs)
    np.testing.assert_allclose(zero_order_xyz(reliefs, w), (one + other) / 2, rtol=1e-12)


def test_pairs_are_such_as_the_bake_covers():
    region, sigma_b = Region((0.1, 0.9), (-0.2, 0.3)), 0.05
    pairs = draw_pairs([skin(True)], sigma_b, 1.1, count=400, region=region, rng=np.random.default_rng(0))
    assert (~pairs.drawn).sum() == 200 and pairs.drawn.sum() > 150
    assert (pairs.u >= 0.1).all() and (pairs.u <= 0.9).all() and (pairs.v >= -0.2).all() and (pairs.v <= 0.3).all()
    np.testing.assert_allclose(pairs.wi[:, 2] + pairs.wr[:, 2], 1.1, atol=1e-12)
    assert (np.minimum(pairs.wi[:, 2], pairs.wr[:, 2]) >= 0).all()


def test_drawn_pairs_are_where_the_light_is():
    """A grating of 560 nm: its first orders, and no others, are within the horizon at u = lam / period."""
    x = np.arange(64) / 64
    relief = prepare(HeightMap(60e-9 * np.sin(2 * np.pi * 8 * x)[None], (PIXEL, PIXEL), "test", periodic=True))
    pairs = draw_pairs([relief], 0.01, 1.2, 400, (-2, 2), (-2, 2), np.random.default_rng(0))
    u, v = np.abs(pairs.u[pairs.drawn]), pairs.v[pairs.drawn]
    assert len(u) > 150
    assert (np.abs(v) < 0.05).all() and ((u > 0.63) & (u < 1.45)).all()
    # Not at a dozen wavelengths alone.
    assert np.diff(np.sort(u)).max() < 0.12


# The table


@pytest.mark.parametrize("precision", [np.float16, np.float32])
def test_a_table_is_read_as_a_renderer_reads_it(tmp_path, precision):
    """As bake.py does, which shares no line with it."""
    rng = np.random.default_rng(0)
    tiles = rng.standard_normal((5, 40, 300, 3)).astype(np.float32)
    table = Table(
        tiles, rng.random((600, 3)), 0.05, 0.01, "E", first=(-0.1, -0.4), w_range=(0.5, 1.9), precision=precision
    )
    path = tmp_path / "table.exr"
    atlas_file.write(path, *atlas.pack(table), {"model": "ensemble"})
    read, stored = read_table(path), atlas_file.read(path)[0]
    assert read.region == (pytest.approx((-0.38, 2.57)), pytest.approx((-0.08, 0.27)))
    assert (read.w_range, read.sigma_b, read.illuminant) == ((0.5, 1.9), 0.05, "E")
    u, v = rng.uniform(-0.5, 2.7, 500), rng.uniform(-0.2, 0.4, 500)
    for w in (0.5, 1.234, 1.9):
        expected = stored.scattered_over_w2(u, v, w)
        np.testing.assert_allclose(read.scattered_over_w2(u, v, w), expected, rtol=0, atol=1e-5)
        np.testing.assert_allclose(read.zero_order_xyz(w), stored.zero_order_xyz(w), rtol=1e-6)


# The verdict


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("check")


@pytest.fixture(scope="module")
def scan(folder):
    """A grey picture of an irregular grating, 48 x 48 pixels, that does not wrap."""
    x, y = np.meshgrid(*[np.arange(48) / 48] * 2)
    grey = 127 + 90 * np.sin(2 * np.pi * 5.3 * x + np.sin(2 * np.pi * y)) + 30 * np.cos(2 * np.pi * 2.6 * y)
    Image.fromarray(grey.astype(np.uint8)).save(folder / "skin.png")
    return folder / "skin.png"


@pytest.fixture(scope="module")
def baked(folder, scan):
    """The file of a real bake of it."""
    line = ["bake", scan, *PICTURE, *SHORT, "-o", folder / "bakes", "--no-cache", "--progress", "none"]
    assert parser.main([str(each) for each in line]) == 0
    return folder / "bakes" / "skin.exr"


@pytest.fixture
def run(capsys):
    """Run a command line: (status, standard output, standard error)."""

    def run_line(*argv):
        capsys.readouterr()
        try:
            status = parser.main([str(each) for each in argv])
        except SystemExit as end:
            status = end.code
        return status, *capsys.readouterr()

    return run_line


@pytest.fixture
def refused(run):
    """Run a command line that must fail in one line of what is wrong and what to do."""

    def run_line(*argv):
        status, out, err = run(*argv)
        assert (status, out) == (1, "")
        assert err.startswith("error: ") and len(err.splitlines()) == 1 and "; " in err
        return err

    return run_line


def spoilt(baked, path, fault, **header):
    """The bake's file again, with its table changed and its header kept, but for what is given."""
    table, record = atlas_file.read(baked)
    for key in ("format", "layout"):
        del record[key]
    atlas_file.write(path, *atlas.pack(fault(table)), {**record, **header})
    return path


def turned(table, degrees):
    """Each tile turned about (0, 0), read between its texels."""
    v, u = np.meshgrid(*table.axes, indexing="ij")
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x = (c * u + s * v - table.first[1]) / table.texel
    y = (c * v - s * u - table.first[0]) / table.texel
    rows, columns = table.tile
    x0, y0 = (np.clip(np.floor(at).astype(int), 0, n - 2) for at, n in ((x, columns), (y, rows)))
    fx, fy = (np.clip(at - low, 0, 1)[..., None] for at, low in ((x, x0), (y, y0)))
    t = table.terms
    lower = t[:, y0, x0] * (1 - fx) + t[:, y0, x0 + 1] * fx
    upper = t[:, y0 + 1, x0] * (1 - fx) + t[:, y0 + 1, x0 + 1] * fx
    return replace(table, terms=(lower * (1 - fy) + upper * fy).astype(np.float32))


def test_a_bake_passes(run, baked, scan):
    status, out, err = run("check", baked, scan, *PICTURE, *QUICK)
    assert (status, err) == (0, "")
    assert len(out.splitlines()) == 2 and "dE00 mean" in out and "|dY|" in out


def test_its_figures_are_those_of_the_bake(run, baked, scan):
    status, out, _ = run("check", baked.parent, scan, *PICTURE, *QUICK, "--json", "-")
    facts, record = json.loads(out), read_header(baked)[1]
    assert status == 0 and facts["passed"] and facts["faults"] == []
    assert facts["asked_delta_e"] == 1
    assert facts["delta_e"]["p99"] <= 1 and facts["delta_e"]["relative_dy"] <= 0.01
    # Two samples of one distribution, drawn by two programs.
    for name in ("mean", "p95", "p99"):
        assert facts["delta_e"][name] == pytest.approx(record["delta_e"][name], rel=0.6)
    assert facts["delta_e"]["pairs"] == sum(ring["pairs"] for ring in facts["rings"])
    assert sum(ring["light"] for ring in facts["rings"]) == pytest.approx(1)
    assert [ring["u_to"] for ring in facts["rings"]] == [0.1, 0.5, 1, 2]
    weighed = sum(ring["light"] * ring["relative_dy"] for ring in facts["rings"])
    assert weighed == pytest.approx(facts["delta_e"]["relative_dy"])


def test_the_same_files_give_the_same_figures(run, baked, scan):
    facts = [json.loads(run("check", baked, scan, *PICTURE, *QUICK, "--json", "-")[1]) for _ in range(2)]
    for each in facts:
        del each["seconds"]
    assert facts[0] == facts[1]


@pytest.mark.parametrize(("name", "fault"), [
    ("black", lambda table: replace(table, terms=0 * table.terms)),
    ("bright", lambda table: replace(table, terms=1.3 * table.terms)),
    ("turned", lambda table: turned(table, 5)),
    ("mirrored", lambda table: replace(table, terms=table.terms[:, ::-1])),
])  # fmt: skip
def test_a_wrong_bake_fails(refused, baked, scan, tmp_path, name, fault):
    path = spoilt(baked, tmp_path / f"{name}.exr", fault)
    told = refused("check", path, scan, *PICTURE, *QUICK)
    assert told.startswith(f"error: {path}: dE00 p99 ") and "asked 1" in told and "bake it again" in told


def test_a_turn_by_nothing_passes(run, baked, scan, tmp_path):
    """It is the turn that fails, not the turning."""
    path = spoilt(baked, tmp_path / "turned.exr", lambda table: turned(table, 0))
    assert run("check", path, scan, *PICTURE, *QUICK)[0] == 0


def test_a_wrong_zero_order_fails(refused, baked, scan, tmp_path):
    path = spoilt(baked, tmp_path / "dim.exr", lambda table: replace(table, zero_order=0.99 * table.zero_order))
    told = refused("check", path, scan, *PICTURE, *QUICK)
    assert "zero order" in told and "dE00" not in told


def test_a_failure_gives_its_figures_all_the_same(run, baked, scan, tmp_path):
    path = spoilt(baked, tmp_path / "bright.exr", lambda table: replace(table, terms=1.3 * table.terms))
    status, out, err = run("check", path, scan, *PICTURE, *QUICK, "--json", "-")
    facts = json.loads(out)
    assert status == 1 and len(err.splitlines()) == 1
    assert not facts["passed"] and len(facts["faults"]) == 2
    assert facts["delta_e"]["relative_dy"] == pytest.approx(0.3, abs=0.01)


def test_what_was_asked_may_be_told(run, refused, baked, scan, tmp_path):
    assert "asked 0.01" in refused("check", baked, scan, *PICTURE, *QUICK, "--delta-e", "0.01")
    path = spoilt(baked, tmp_path / "loose.exr", lambda table: replace(table, terms=1.02 * table.terms))
    assert "|dY|" in refused("check", path, scan, *PICTURE, *QUICK)
    assert run("check", path, scan, *PICTURE, *QUICK, "--delta-e", "4")[0] == 0


def test_a_mirror_passes(run, refused, tmp_path):
    """Its scattered light is a rounding of none, and of that no share is asked."""
    black = tmp_path / "mirror.png"
    Image.fromarray(np.zeros((16, 16), np.uint8)).save(black)
    size = ("--size-um", "2", "--height-nm", "100", "--progress", "none")
    assert run("bake", black, *size, "-o", tmp_path, "--no-cache")[0] == 0
    bake = tmp_path / "mirror.exr"
    assert run("check", bake, black, *size, *QUICK)[0] == 0
    glow = spoilt(bake, tmp_path / "glow.exr", lambda table: replace(table, terms=table.terms + 0.1))
    assert "dE00" in refused("check", glow, black, *size, *QUICK)


def test_several_scans(run, refused, scan, tmp_path):
    other = tmp_path / "other.png"
    Image.open(scan).rotate(90).save(other)
    quick = (*PICTURE, *SHORT, "--delta-e", "3", "--no-cache", "--progress", "none")
    assert run("bake", scan, other, *quick, "-o", tmp_path / "both")[0] == 0
    assert run("check", tmp_path / "both", scan, other, *PICTURE, *QUICK)[0] == 0
    assert "2 height maps, not 1" in refused("check", tmp_path / "both", scan, *PICTURE, *QUICK)
    assert "another surface" in refused("check", tmp_path / "both", other, scan, *PICTURE, *QUICK)


def test_a_bake_of_a_part(run, scan, tmp_path):
    """Judged where it claims to hold."""
    needs = tmp_path / "needs.json"
    needs.write_text(json.dumps({"format": 1, "u": [0.1, 1.3], "v": [-0.2, 0.4], "w": [0.9, 1.8]}))
    quick = (*PICTURE, *SHORT, "--needs", needs, "--no-cache", "--progress", "none")
    assert run("bake", scan, *quick, "-o", tmp_path / "part")[0] == 0
    status, out, _ = run("check", tmp_path / "part", scan, *PICTURE, *QUICK, "--json", "-")
    facts = json.loads(out)
    assert status == 0
    assert facts["delta_e"]["pairs"] > 1000
    assert all(0.9 <= w <= 1.8 for w in facts["w"])


# What is refused


def test_another_surface(refused, baked, scan, tmp_path):
    other = tmp_path / "other.png"
    Image.open(scan).rotate(180).save(other)
    assert "another surface" in refused("check", baked, other, *PICTURE, *QUICK)
    assert "another surface" in refused("check", baked, scan, "--size-um", "4", "--height-nm", "260", *QUICK)
    assert "pixels of 83.33 nm" in refused("check", baked, scan, "--size-um", "5", "--height-nm", "250", *QUICK)


def test_bakes_that_are_none(refused, scan, tmp_path):
    assert "no such file" in refused("check", tmp_path / "missing.exr", scan, *PICTURE, *QUICK)
    assert "no bake" in refused("check", tmp_path, scan, *PICTURE, *QUICK)
    text = tmp_path / "text.exr"
    text.write_bytes(b"hello\n")
    assert "not a readable" in refused("check", text, scan, *PICTURE, *QUICK)
    picture = tmp_path / "picture.exr"
    write_picture(picture, np.ones((8, 8, 3)), "D65")
    assert "not a Natural Gratings bake" in refused("check", picture, scan, *PICTURE, *QUICK)


@pytest.mark.parametrize("share", [0.02, 0.5, 0.95])
def test_a_truncated_bake(run, baked, scan, tmp_path, share):
    """Not by way of `refused`: OpenEXR itself warns on standard output."""
    whole = baked.read_bytes()
    path = tmp_path / "half.exr"
    path.write_bytes(whole[: int(share * len(whole))])
    status, _, err = run("check", path, scan, *PICTURE, *QUICK)
    assert status == 1
    assert err.startswith(f"error: {path}: ") and len(err.splitlines()) == 1


def test_another_model_and_another_version(refused, baked, scan, tmp_path):
    path = spoilt(baked, tmp_path / "patch.exr", lambda table: table, model="patch")
    assert "patch" in refused("check", path, scan, *PICTURE, *QUICK)
    path = spoilt(baked, tmp_path / "old.exr", lambda table: table, format=2)
    assert "format 2" in refused("check", path, scan, *PICTURE, *QUICK)


@pytest.mark.parametrize(("key", "value"), [
    ("terms", 99), ("tile_rows", 7), ("strip_rows", -1), ("texel", 0.0), ("sigma_b", float("nan")), ("w_max", 0.0),
    ("illuminant", "moon"), ("scale", "1"), ("columns", None), ("zero_order_samples", 1), ("rows", 2.5),
    ("inner_rows", 10**4), ("inner_columns", 0), ("levels", 1), ("levels", "2"),
])  # fmt: skip
def test_a_header_that_cannot_be(refused, baked, scan, tmp_path, key, value):
    layout = {**atlas_file.read(baked)[1]["layout"], key: value}
    path = spoilt(baked, tmp_path / "odd.exr", lambda table: table, layout=layout)
    assert "do not agree" in refused("check", path, scan, *PICTURE, *QUICK)


def test_a_table_that_is_no_number(refused, baked, scan, tmp_path):
    table, record = atlas_file.read(baked)
    image, layout = atlas.pack(table)
    image[-9, 9] = np.nan
    atlas_file.write(tmp_path / "nan.exr", image, layout, record)
    assert "no number" in refused("check", tmp_path / "nan.exr", scan, *PICTURE, *QUICK)


@pytest.mark.parametrize("option", [
    ("--delta-e", "0"), ("--groups", "0"), ("--pairs", "-1"), ("--step-nm", "0"), ("--step-nm", "nan"),
])  # fmt: skip
def test_numbers_that_are_none(refused, baked, scan, option):
    assert option[0] in refused("check", baked, scan, *PICTURE, *QUICK, *option)

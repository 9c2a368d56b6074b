# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps of different spectra in one scene: renders against exact sums over each lamp's spectrum, and what stays as it
is where all lamps are white."""

import functools
import os
import subprocess
import sys

import bpy
import numpy as np
import pytest

from precompute.bake.ensemble import bake
from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest, Scan
from precompute.colour.channels import row_of
from precompute.colour.illuminants import canonical
from precompute.colour.observer import white_xyz
from precompute.colour.spaces import delta_e_2000, lab, lamp_rgb, rgb_over_lamp, shown_rgb
from precompute.surface.relief import prepare
from precompute.table.radiance import reflected_xyz
from tests.addon.worlds.made import painted, world_with
from tests.precompute.world_sources.worlds import picture, sky

from .conftest import read_channels, rgb_of
from .test_radiance import TURN, assign, geometry, shape
from .world_scenes import add_ball, look_at_ball
from .world_scenes import assign as world_assign

ENGINES = ["cycles", "eevee"]
RGB_FROM_XYZ = rgb_over_lamp("Rec.709", "D65")


@pytest.fixture(scope="session")
def bakes(tmp_path_factory):
    """The files of bakes of a blaze by the texts of their lights, made when first asked for."""

    @functools.cache
    def file(light):
        asked = request_for(light)
        folder = tmp_path_factory.mktemp("lamp_spectra")
        return bake_to_folder([asked.scans[0].read()], asked, folder)["files"][0]

    return file


@functools.cache
def table_under(light):
    """The table of the blaze under one light."""
    asked = request_for(light)
    return bake(prepare(asked.scans[0].read()), asked)


def request_for(light):
    return BakeRequest(coherence_length_m=3e-6, illuminant=canonical(light), scans=(Scan("sample:blazed"),))


def sun(stage, to, spectrum="", kelvins=0, energy=2.0):
    """Add a sun of a spectrum, by its field or by its temperature, as an artist does."""
    lamp = stage.lamp("SUN", to=to, energy=energy, angle=0.0, name=spectrum or f"{kelvins}K")
    if spectrum:
        lamp.data.diffraction_spectrum = spectrum
    elif kelvins:
        lamp.data.use_temperature, lamp.data.temperature = True, kelvins
    return lamp


def sphere(stage):
    mesh, (location, target, angle) = shape(stage, "sphere")
    stage.camera(location, target, angle=angle)
    return mesh


def sums(stage, mesh, lamps):
    """The picture (n, n, 3) as the sum over suns, each by a bake under its own spectrum; and the pixels that see the
    mesh. `lamps` are the suns and their spectra."""
    passes, seen = geometry(stage, mesh)
    n, wr, t = (passes[name][seen] for name in ("Normal", "Incoming", "Tangent"))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    t -= n * (n * t).sum(axis=1, keepdims=True)
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    b = np.cross(n, t)
    frame = np.stack([t * np.cos(TURN) + b * np.sin(TURN), b * np.cos(TURN) - t * np.sin(TURN), n], axis=1)
    view = np.einsum("nij,nj->ni", frame, wr)
    out = np.zeros((*seen.shape, 3))
    for lamp, spectrum in lamps:
        light = np.broadcast_to(np.array(lamp.matrix_world.col[2][:3]), n.shape)
        way = np.einsum("nij,nj->ni", frame, light)
        lit = (way[:, 2] > 0) & (view[:, 2] > 0)
        xyz = reflected_xyz(table_under(spectrum), way, view)
        data = lamp.data
        colour = np.array(data.color) * (np.array(data.temperature_color) if data.use_temperature else 1)
        out[seen] += shown_rgb(xyz, rgb_over_lamp("Rec.709", spectrum)) * data.energy * colour * lit[:, None]
    return out, seen


def differences(rendered, truth, seen):
    """CIEDE2000 of two pictures where one of them is lit, at an exposure for the brightest hundredth."""
    both = np.stack([rendered[seen], truth[seen]])
    luminance = both @ np.linalg.inv(RGB_FROM_XYZ)[1]
    scale = 1 / np.percentile(luminance[1], 99)
    lit = (scale * luminance).max(axis=0) > 0.002
    xyz = (scale * both[:, lit]) @ np.linalg.inv(RGB_FROM_XYZ).T
    return delta_e_2000(*(lab(each, white_xyz()) for each in xyz))


# Of six or nine channels on this blaze: the mean dE00 is at most 0.3, and the 95th percentile 0.8 (LED-B1).
MEDIAN, P95 = 0.3, 0.8


@pytest.mark.short("cycles")
@pytest.mark.parametrize("engine", ENGINES)
def test_three_spectra_in_one_scene(stage, bakes, engine):
    mesh = sphere(stage)
    lamps = [
        (sun(stage, (0.8, -0.6, 0.3), kelvins=2700), "2700K"),
        (sun(stage, (-0.9, -0.5, 0.4), "LED-B1"), "LED-B1"),
        (sun(stage, (0.1, -0.7, 0.9), "tube"), "FL11"),
    ]
    assign(stage, mesh, bakes("led+tube"))
    assert bpy.ops.grating.lights(lights="LAMPS") == {"FINISHED"}
    bpy.context.view_layer.update()
    truth, seen = sums(stage, mesh, lamps)
    off = differences(stage.rgb(engine, truth.shape[0]), truth, seen)
    assert np.median(off) < MEDIAN
    assert np.percentile(off, 95) < P95


def lit(stage, bakes, light):
    """Assign a bake to a sphere under what lamps there are, with Lamps Only."""
    mesh = sphere(stage)
    node = assign(stage, mesh, bakes(light))
    assert bpy.ops.grating.lights(lights="LAMPS") == {"FINISHED"}
    return mesh, node.node_tree


@pytest.mark.night("test_three_spectra_in_one_scene")
def test_a_keyed_temperature_is_followed(stage, bakes):
    lamp = sun(stage, (0.1, -0.7, 0.9), kelvins=2700)
    for frame, kelvins in ((1, 2700), (24, 9000)):
        lamp.data.temperature = kelvins
        lamp.data.keyframe_insert("temperature", frame=frame)
    mesh, _ = lit(stage, bakes, "smooth")
    for frame, nearest in ((24, 9000), (1, 2700)):
        stage.scene.frame_set(frame)
        spectrum = f"{nearest}K"
        truth, seen = sums(stage, mesh, [(lamp, spectrum)])
        off = differences(stage.rgb("cycles", truth.shape[0]), truth, seen)
        assert np.median(off) < MEDIAN, frame
        assert np.percentile(off, 95) < P95, frame
    rows = []
    for frame in range(1, 25):
        stage.scene.frame_set(frame)
        rows.append(stage.scene["ng_key_0_spectrum"][0])
        assert rows[-1] == pytest.approx(row_of(f"{round(lamp.data.temperature)}K"), abs=0.51)  # half a row
    assert len(set(rows)) == 24


@pytest.mark.night("test_three_spectra_in_one_scene")
def test_white_lamps_need_nothing_more(stage, bakes):
    """A bake of nine channels under white lamps: no node more than a bake of three, and the same picture."""
    sun(stage, (0.1, -0.7, 0.9))
    mesh, group = lit(stage, bakes, "D65")
    nodes, picture = len(group.nodes), stage.rgb()
    bpy.data.objects.remove(mesh)
    mesh, group = lit(stage, bakes, "led+tube")
    assert len(group.nodes) == nodes
    assert not [name for name in stage.scene.keys() if "spectrum" in name]  # noqa: SIM118  # no iterable
    (labelled,) = (node for node in group.nodes if node.label == "Response")
    assert not [link for link in group.links if link.from_node == labelled and "of Lamp" in link.from_socket.name]
    # The two tables are of different functions of w, each to a dE00 of 0.5: 1 % of the light.
    np.testing.assert_allclose(stage.rgb(), picture, atol=0.01 * picture.max())


def test_a_lamp_becomes_coloured_and_white_again(stage, bakes):
    lamp = sun(stage, (0.1, -0.7, 0.9))
    lit(stage, bakes, "led+tube")
    white = stage.rgb()
    lamp.data.diffraction_spectrum = "tube"
    assert lamp.data.diffraction_spectrum == "FL11"
    np.testing.assert_allclose(lamp.data.color, lamp_rgb("Rec.709", "FL11"), rtol=1e-6)
    bpy.context.view_layer.update()
    tube = stage.rgb()
    assert np.abs(tube - white).max() > 0.1 * white.max()
    lamp.data.diffraction_spectrum = "2700K"
    assert lamp.data.diffraction_spectrum == ""
    assert (lamp.data.use_temperature, lamp.data.temperature) == (True, 2700)
    lamp.data.use_temperature = False
    bpy.context.view_layer.update()
    # The nodes remain until the file is opened again, with the row of white: the same matrix in single precision.
    np.testing.assert_allclose(stage.rgb(), white, rtol=1e-5, atol=1e-6 * white.max())


@pytest.mark.night("test_three_spectra_in_one_scene")
def test_of_many_lamps_each_keeps_its_spectrum(stage, bakes):
    """Five lamps, of which a sample answers to two: the mean of many samples is the picture of all five."""
    ways = ((0.8, -0.6, 0.3), (-0.9, -0.5, 0.4), (0.1, -0.7, 0.9), (-0.3, -0.9, 0.2), (0.5, -0.8, 0.1))
    for way, spectrum in zip(ways, ("FL11", "LED-B1", "D5500", "LED-RGB1", ""), strict=True):
        sun(stage, way, spectrum)
    lit(stage, bakes, "led+tube")
    drawn = stage.rgb(samples=64)
    stage.scene.natural_gratings.active().every_lamp = True
    bpy.context.view_layer.update()
    apart = drawn - (every := stage.rgb(samples=64))
    noise = np.sqrt((apart**2).mean(axis=(0, 1)))
    # Five standard errors of a mean over independent pixels, in each of red, green and blue; a lamp with another's
    # spectrum would change a colour by a tenth (test_a_lamp_becomes_coloured_and_white_again).
    assert (noise > 0).all()
    assert (np.abs(apart.mean(axis=(0, 1))) < 5 * noise / len(apart)).all()
    assert (5 * noise / len(apart) < 0.05 * every.mean(axis=(0, 1))).all()


def test_a_file_s_spectrum_has_a_row_of_its_own(stage, bakes, tmp_path):
    lamp = sun(stage, (0.1, -0.7, 0.9))
    _, group = lit(stage, bakes, "led+tube")
    assert bpy.ops.grating.lights(lights="REST") == {"FINISHED"}
    picture = stage.rgb()
    path = tmp_path / "lamp.csv"
    path.write_text("440,0\n450,1\n460,0\n570,0\n590,1\n610,0\n")
    lamp.data.diffraction_spectrum = str(path)
    assert ":" in lamp.data.diffraction_spectrum
    bpy.context.view_layer.update()
    own = stage.rgb()
    assert np.abs(own - picture).max() > 0.05 * picture.max()
    lamp.data.diffraction_spectrum = "570:0 590:1 610:0"
    bpy.context.view_layer.update()
    assert np.abs(stage.rgb() - own).max() > 0.05 * own.max()
    assert stage.addon.lost_parts.lost([group]) == []


OPENED = """
import sys

import bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
assert "natural_gratings" not in " ".join(sys.modules)
bpy.context.scene.render.filepath = sys.argv[2]
bpy.ops.render.render(write_still=True)
"""


@pytest.mark.night("tests/package/test_installed.py")
def test_a_file_renders_alike_without_the_extension(files, bakes, tmp_path):
    for way, spectrum, kelvins in (((0.8, -0.6, 0.3), "LED-B1", 0), ((0.1, -0.7, 0.9), "", 2700)):
        sun(files, way, spectrum, kelvins)
    lit(files, bakes, "led+tube")
    with_it = files.rgb(pixels=32, name="with")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "lamps.blend"))
    alone = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "empty")}
    picture = tmp_path / "without.exr"
    words = [sys.executable, "-c", OPENED, str(tmp_path / "lamps.blend"), str(picture)]
    subprocess.run(words, env=alone, check=True, capture_output=True, cwd=tmp_path)
    np.testing.assert_array_equal(rgb_of(read_channels(picture)), with_it)


@pytest.mark.night("test_three_spectra_in_one_scene")
@pytest.mark.parametrize("engine", ENGINES)
def test_the_random_order_has_the_spectrum_of_the_world(stage, bakes, engine):
    """All light of a smooth world comes by the random order. Under a line every direction has the colour of the world,
    where daylight shows all hues."""
    colour = lamp_rgb("Rec.709", "2700K")
    world, background = world_with("ShaderNodeTexEnvironment")
    image = painted(picture(sky()).mean(axis=-1, keepdims=True) * colour)
    image.pack()
    background.inputs["Color"].links[0].from_node.image = image
    stage.scene.world = world
    add_ball()
    look_at_ball(stage)
    world_assign(stage, bakes("D65+532nm"), "REST")
    assert round(stage.scene["ng_world_rest_spectrum"][0]) == row_of("2700K")

    def hues(row):
        stage.scene["ng_world_rest_spectrum"] = [float(row)]
        stage.scene.update_tag()
        bpy.context.view_layer.update()
        found = stage.rgb(engine, 32, 16, f"{row}") / colour
        lit = found[found.mean(axis=-1) > 0.2 * found.mean()]
        return np.abs(lit / lit.mean(axis=-1, keepdims=True) - 1).mean()

    # Single precision, and a few roundings of EEVEE's half floats.
    assert hues(row_of("532nm")) < (1e-5 if engine == "cycles" else 2**-8)
    if engine == "cycles":
        assert hues(0) > 0.03

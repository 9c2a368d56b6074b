# SPDX-License-Identifier: GPL-3.0-or-later
"""Physics through the whole path: bake file, assign operator, node group, renderer, EXR.

A plane at z = 0 seen from one metre above, with diffraction alone: every pixel's directions are known.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from precompute.bake.ensemble import bake
from precompute.bake.needs import EVERYTHING, Needs
from precompute.bake.request import BakeRequest
from precompute.colour.observer import spectral_weights, wavelengths
from precompute.colour.spaces import rgb_from_xyz, shown_rgb
from precompute.maps import brdf_map
from precompute.optics.region import Region
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import Relief, prepare
from precompute.table import atlas
from precompute.table.radiance import lamp_radiance
from precompute.table.table import Table

from .conftest import clear

PIXELS = 360
FIELD_DEG = 90.0
# Of Blender's default, and of a sun whose mirror image is 18 pixels wide.
SUN_ANGLE, WIDE_SUN_ANGLE = 0.00918, 0.1


@dataclass(frozen=True)
class Baked:
    """A sample, its bake as the file holds it, and the file."""

    relief: Relief
    bake: Table
    path: Path


@pytest.fixture(scope="session")
def bakes(tmp_path_factory):
    """get(sample name, needs) -> Baked, each made once."""
    folder = tmp_path_factory.mktemp("bakes")
    made: dict[tuple[str, Needs], Baked] = {}

    def get(name: str, needs: Needs = EVERYTHING) -> Baked:
        if (name, needs) not in made:
            relief = prepare(read_height_map(f"sample:{name}"))
            image, layout = atlas.pack(bake(relief, BakeRequest(needs=needs)))
            path = folder / f"{name}{len(made)}.exr"
            atlas.write_together({path: (image, layout)}, {})
            made[name, needs] = Baked(relief, atlas.unpack(image, layout), path)
        return made[name, needs]

    return get


@dataclass(frozen=True)
class View:
    """Each pixel's unit directions along the plane's T, B and N, (n, n, 3), row 0 at the top."""

    wi: np.ndarray
    wr: np.ndarray

    @property
    def half(self) -> np.ndarray:
        return self.wi + self.wr

    def software_rgb(self, baked: Table, sun_angle: float = SUN_ANGLE) -> np.ndarray:
        """Radiance under unit irradiance (n, n, 3) by the node group's formula in NumPy."""
        wi, wr = (np.reshape(each, (-1, 3)) for each in (self.wi, self.wr))
        variance = np.sin(sun_angle / 2) ** 2 / 4
        return lamp_radiance(baked, wi, wr, irradiance=np.ones(3), variance=variance).reshape(*self.wi.shape)


def view_of(to_sun) -> View:
    """Directions of the plane's picture: camera one metre above, square field of FIELD_DEG, looking down, +y up."""
    half_width = np.tan(np.radians(FIELD_DEG / 2))
    x = ((np.arange(PIXELS) + 0.5) / PIXELS * 2 - 1) * half_width
    px, py = np.meshgrid(x, -x)
    wr = np.stack([-px, -py, np.ones_like(px)], axis=-1)
    wr /= np.linalg.norm(wr, axis=-1, keepdims=True)
    return View(np.broadcast_to(np.asarray(to_sun) / np.linalg.norm(to_sun), wr.shape), wr)


@pytest.fixture
def picture(stage):
    """picture(path, to_sun, engine, turn_deg) -> a bake rendered on the plane: linear RGB (n, n, 3), row 0 on top."""
    import bpy

    def render(
        path: Path, to_sun=(0, 0, 1), engine="cycles", turn_deg=0.0, energy=1.0, behind=False, angle=SUN_ANGLE
    ) -> np.ndarray:
        clear(stage.addon, stage.scene)
        bpy.ops.mesh.primitive_plane_add(size=4)
        plane = bpy.context.object
        turn_uv(plane.data, np.radians(turn_deg))
        if behind:
            plane.data.flip_normals()
        stage.lamp("SUN", to=to_sun, energy=energy, angle=angle)
        stage.camera((0, 0, 1), angle=np.radians(FIELD_DEG)).rotation_euler = (0, 0, 0)
        grating = stage.scene.natural_gratings.items.add()
        grating.name, grating.bake_path = "plane", str(path)
        stage.scene.natural_gratings.active_index = 0
        stage.addon.assigning.assign_to_meshes(stage.scene, [plane])
        for node in plane.active_material.node_tree.nodes:
            if node.type == "BSDF_PRINCIPLED":
                node.inputs["Base Color"].default_value = (0, 0, 0, 1)
        return stage.rgb(engine, PIXELS)

    return render


def turn_uv(mesh, angle: float) -> None:
    """Turn the UV map so that U runs at `angle` from +x towards +y."""
    for loop in mesh.uv_layers.active.data:
        x, y = loop.uv
        loop.uv = (x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle))


PERIOD_M, DEPTH_M = 2.5e-6, 246.23e-9
LUMINANCE = np.linalg.inv(rgb_from_xyz("Rec.709"))[1]


def blazed_rgb(u: np.ndarray, w: np.ndarray, sigma_b: float) -> np.ndarray:
    """Closed form (n, 3), linear RGB as displayed, of a blaze rising along T at v = 0 and R = O = 1: order m of
    wavelength lambda at u = m lambda / d, blurred by the kernel, with efficiency sinc^2(m + w depth / lambda), the
    transform of a ramp (Born and Wolf 8.6). Independent of the core's spectrum code."""
    lambdas = wavelengths(1e-9)
    m = np.arange(-8, 9)[:, None]
    xyz = np.zeros((len(u), 3))
    for lam, weight in zip(lambdas, spectral_weights(lambdas), strict=True):
        efficiency = np.sinc(m + w * DEPTH_M / lam) ** 2
        density = (efficiency * np.exp(-((u - m * lam / PERIOD_M) ** 2) / (2 * sigma_b**2))).sum(axis=0)
        xyz += density[:, None] * weight
    return shown_rgb(xyz, rgb_from_xyz("Rec.709"))


def middle_row(image: np.ndarray) -> np.ndarray:
    """The mean of the two rows next to the horizontal middle. In both, v is half a pixel away from 0."""
    n = len(image) // 2
    return image[n - 1 : n + 1].mean(axis=0)


@pytest.mark.short("[1]")
@pytest.mark.parametrize("order", [-1, 1])
def test_first_orders_lie_where_the_grating_equation_says(bakes, picture, order):
    blazed = bakes("blazed")
    view = view_of((0, 0, 1))
    row = middle_row(picture(blazed.path)) @ LUMINANCE
    u, _, w = middle_row(view.half).T
    # Between 420 and 640 nm no visible light of another order falls: order 2 begins at 760 nm of order 1.
    inside = (order * u * PERIOD_M > 420e-9) & (order * u * PERIOD_M < 640e-9)
    expected = blazed_rgb(u[inside], w[inside], blazed.bake.sigma_b) @ LUMINANCE
    # Stam's obliquity times Fresnel varies smoothly by 6 % over the order; the core's own factor removes it.
    factor = middle_row(view.software_rgb(blazed.bake))[inside] @ LUMINANCE
    assert factor.min() > 0
    angle = np.degrees(np.arcsin(u[inside]))
    centroid, wanted = (np.average(angle, weights=y) for y in (row[inside], expected))
    # Half a degree is a little over one pixel (0.4 degrees here). The window is fixed: a wrong sign or period could
    # move light out of it without changing the centroid, so the peaks are compared as well.
    assert abs(centroid - wanted) < 0.5
    assert abs(angle[np.argmax(row[inside])] - angle[np.argmax(expected)]) < 0.5


def test_the_blaze_throws_its_light_to_minus_u(bakes, picture):
    blazed = bakes("blazed")
    row = middle_row(picture(blazed.path)) @ LUMINANCE
    u = middle_row(view_of((0, 0, 1)).half)[:, 0]
    minus, plus = (row[(sign * u > 0.15) & (sign * u < 0.3)].sum() for sign in (-1, 1))
    # sinc^2(-1 + 0.9) against sinc^2(1 + 0.9): 0.97 to 0.003 in the green.
    assert minus > 100 * plus


REGION = Needs(Region((-0.5, 0.3), (-0.1, 0.2)), w=(1.2, 1.9))


@pytest.mark.parametrize(
    ("to_sun", "turn_deg", "needs"),
    [((0, 0, 1), 0.0, EVERYTHING), ((0.3, -0.15, 1), 20.0, EVERYTHING), ((0.3, -0.15, 1), 0.0, REGION)],
)
def test_cycles_renders_what_the_table_says(bakes, picture, to_sun, turn_deg, needs):
    # Pixels above 1 % of the first order's peak, against the table sampled in software. A wrong axis, level or filter
    # exceeds the bounds; single precision gives a tenth of them. Outside the region of a bake both are black.
    blazed = bakes("blazed", needs)
    rendered = picture(blazed.path, to_sun, turn_deg=turn_deg)
    turn = np.radians(turn_deg)
    frame = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    view = view_of(to_sun)
    turned = type(view)(view.wi @ frame.T, view.wr @ frame.T)
    expected = turned.software_rgb(blazed.bake) @ LUMINANCE
    rendered = rendered @ LUMINANCE
    first = np.hypot(*np.moveaxis(turned.half[..., :2], -1, 0)) > 0.1
    counted = expected > 0.01 * expected[first].max()
    assert counted.sum() > 100
    error = np.abs(rendered - expected)[counted] / expected[counted]
    assert np.median(error) <= 0.005
    assert np.percentile(error, 95) <= 0.02
    if needs is REGION:
        (u_low, u_high), (v_low, v_high), (w_low, w_high) = *blazed.bake.region, blazed.bake.w_range
        u, v, w = np.moveaxis(turned.half, -1, 0)
        beyond = np.max([u_low - u, u - u_high, v_low - v, v - v_high, w_low - w, w - w_high], axis=0)
        black = beyond > 1e-4  # a hundredth of a pixel
        assert black.sum() > 100
        np.testing.assert_allclose(rendered[black], expected[black], rtol=0.02, atol=1e-6 * expected.max())


@pytest.mark.short("cycles")
@pytest.mark.parametrize("engine", ["cycles", "eevee"])
def test_a_mesh_shows_the_same_from_behind(bakes, picture, engine):
    # Both sides reflect; Blender's Fresnel node alone would treat the back as the inside. EEVEE has half floats.
    blazed = bakes("blazed")
    to_sun = (0.3, -0.15, 1)
    front, back = (picture(blazed.path, to_sun, engine, behind=behind) @ LUMINANCE for behind in (False, True))
    assert front.max() > 0
    np.testing.assert_allclose(back, front, rtol=2e-3, atol=1e-3 * front.max())


def test_eevee_renders_the_tables_energy(bakes, picture):
    # EEVEE samples each pixel slightly off centre, which changes these steep lobes by 4 % (median). So the sum over all
    # pixels is compared. Single precision, half-float texels and 8-bit filter weights each change it by well under 1 %.
    blazed = bakes("blazed")
    to_sun = (0.3, -0.15, 1)
    rendered = picture(blazed.path, to_sun, "eevee", angle=WIDE_SUN_ANGLE) @ LUMINANCE
    expected = view_of(to_sun).software_rgb(blazed.bake, WIDE_SUN_ANGLE) @ LUMINANCE
    assert rendered.sum() == pytest.approx(expected.sum(), rel=0.02)


def test_a_flat_mirror_has_no_colour_and_all_its_energy(bakes, picture):
    flat = bakes("flat")
    image = picture(flat.path, angle=WIDE_SUN_ANGLE)
    lit = image[..., 1] > 1e-3 * image.max()
    assert lit.sum() > 20
    # Half floats hold XYZ of the white to 5e-4 each, and the matrix's largest entry is 3.2: 2e-3 of the green.
    assert np.ptp(image[lit], axis=-1).max() <= 3e-3 * image[lit].max()
    spread = np.ptp(image[lit], axis=-1) / image[lit].mean(axis=-1)
    assert spread.max() <= 3e-3
    # Light at the normal: the kernel's integral over dOmega is 1, so the sum is R = 0.0479; cos(tr) is 0.999 and more.
    view = view_of((0, 0, 1))
    energy = np.sum((image @ LUMINANCE) * solid_angle_cosine(view))
    assert energy == pytest.approx((0.56 / 2.56) ** 2, rel=0.02)


def solid_angle_cosine(view) -> np.ndarray:
    """cos(tr) dOmega of each pixel: a pixel of area a on the plane one metre below covers a cos^3(tr)."""
    n = view.wr.shape[0]
    pixel = 2 * np.tan(np.radians(45)) / n
    return pixel**2 * view.wr[..., 2] ** 4


def test_rendered_lobes_hold_the_cores_energy(bakes, picture):
    blazed = bakes("blazed")
    image = picture(blazed.path)
    view = view_of((0, 0, 1))
    first = np.abs(view.half[..., 0] + 0.22) < 0.1
    rendered = np.sum((image @ LUMINANCE * solid_angle_cosine(view))[first])
    # Gaussians summed in steps of 1.6 standard deviations, along v, and of half a standard deviation, along u for 10
    # nm, are flat to 2 exp(-2 pi^2 / 1.6^2) = 1e-3.
    size = 200
    assert 2 / size < 1.6 * blazed.bake.sigma_b
    wi, seen = brdf_map.light_from(0.0), brdf_map.seen_colour(10e-9)
    core = np.nan_to_num(brdf_map.from_reference(blazed.relief, blazed.bake.sigma_b, size, wi=wi, seen=seen))
    axis = (np.arange(size) + 0.5) * 2 / size - 1
    luminance = core[..., 1]
    truth = luminance[:, np.abs(axis + 0.22) < 0.1].sum() * (2 / size) ** 2
    assert rendered == pytest.approx(truth, rel=0.05)


@pytest.mark.night("test_cycles_renders_what_the_table_says")
def test_twice_the_sun_is_twice_the_light_and_none_is_none(bakes, picture):
    blazed = bakes("blazed")
    once, twice, none = (picture(blazed.path, energy=e) for e in (1.0, 2.0, 0.0))
    np.testing.assert_allclose(twice, 2 * once, rtol=1e-5, atol=1e-7)
    assert none.max() == 0

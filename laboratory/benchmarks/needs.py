# SPDX-License-Identifier: GPL-3.0-or-later
"""What *Bake for This Scene* saves: the needs of three sample scenes, and their bakes before and after.

    ./dev bench needs [--scene hero|macro|cd ...] [--width 192] [--samples 16] [--json FILE|-]

Each scene's grating is baked whole, then for the scene, with lamps alone and with light from everywhere. `MiB`, `terms`
and `look-ups` are given for both bakes. `held` is the share of the light inside the needs, for an even spectrum and for
the grating's own. `errors` compares both tables with a whole bake of dE 0.3, by CIEDE2000 at the scene's own directions
(99th percentile at the worst of four exposures), over the places and lamps inside the needs. `pixels` compares renders
with both bakes by Cycles with the same random numbers. Then the camera moves by 20 degrees around its target, to the
side and upwards; the last figures are what the add-on notices and how long this takes.
"""

import argparse
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from precompute.bake.levels_and_basis import with_levels
from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.colour.observer import white_xyz
from precompute.measure.errors import worst_exposure
from precompute.surface.readers.reader_registry import read_height_map
from precompute.table import atlas
from precompute.table.radiance import reflected_xyz
from precompute.table.table import Spacing, Table, cell_for

from . import report
from .osl import colour_differences, start_blender

# Sample and object of each scene.
SCENES = {"hero": ("xenopeltis", "Snake"), "macro": ("xenopeltis", "Snake"), "cd": ("cd", "CD")}
LIGHTS = ("LAMPS", "REST")
TURN_DEG = 20.0
_EXACT, _EXACT_RATIO = 0.3, 1.2
_FACES, _RAYS = 60_000, 4000


def main(argv: list[str] | None = None) -> int:
    """Print the figures and return the exit status."""
    parser = OneLineParser(prog="./dev bench needs", description=__doc__.splitlines()[0])
    parser.add_argument("--scene", action="append", choices=list(SCENES))
    parser.add_argument("--width", type=count(16, 4096), default=192)
    parser.add_argument("--samples", type=count(1, 1 << 16), default=16)
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="keep the renders here")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    facts = []
    with tempfile.TemporaryDirectory() as folder:
        addon = start_blender(Path(folder))
        for name in arguments.scene or SCENES:
            pictures = arguments.pictures or Path(folder)
            pictures.mkdir(parents=True, exist_ok=True)
            facts += measure(Scene.built(addon, name, arguments, pictures), arguments)
    report.write({"scenes": facts}, arguments.json)
    return 0


@dataclass
class Scene:
    """A sample scene whose grating is baked whole and shown."""

    addon: SimpleNamespace
    name: str
    pictures: Path
    samples: int

    @classmethod
    def built(
        cls,
        addon: SimpleNamespace,
        name: str,
        arguments: argparse.Namespace,
        pictures: Path,
        *,
        ground: str | None = None,
    ) -> "Scene":
        """Build a scene, bake its sample and assign it. The denoiser is off, so that renders can be compared. A snake
        lies on the set `ground`, by default the scene's own."""
        import bpy

        from sample_scenes import animal, discs, stage

        sample, shown = SCENES[name]
        stage.clean_scene()
        scene = bpy.context.scene
        scene.natural_gratings.items.clear()
        if name == "cd":
            discs.build_discs(scene, ["cd"])
        else:
            animal.build(scene, animal.VIEWS[name], "XENOPELTIS", faces=_FACES, panorama=None, ground=ground)
        grating = addon.importing.add_grating(scene, f"sample:{sample}")
        addon.baking.bake_and_wait(grating)
        addon.assigning.add_to_meshes(scene, [bpy.data.objects[shown]])
        render = scene.render
        render.engine, scene.cycles.shading_system = "CYCLES", False
        render.resolution_x, render.resolution_y = arguments.width, arguments.width * 9 // 16
        render.resolution_percentage = 100
        scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
        render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
        bpy.context.view_layer.update()
        return cls(addon, name, pictures, arguments.samples)

    @property
    def scene(self):
        """The open scene."""
        import bpy

        return bpy.context.scene

    @property
    def grating(self):
        """The scene's only grating."""
        return self.scene.natural_gratings.items[0]

    def table(self) -> tuple[Table, dict]:
        """The grating's current table, and its mebibytes in Blender, terms and look-ups."""
        table, _ = atlas.read(self.grating.baked_file())
        layout, _ = atlas.read_header(self.grating.baked_file())
        held = {"MiB": layout.width * layout.height * 16 / 2**20, "terms": layout.terms}
        return table, held | {"look_ups": layout.terms * min(layout.levels, 2)}

    def render(self, what: str) -> np.ndarray:
        """Render a linear picture (rows, columns, 3)."""
        import bpy
        import OpenEXR

        path = self.pictures / f"{self.name}_{what}.exr"
        self.scene.render.filepath, self.scene.cycles.samples = str(path), self.samples
        bpy.ops.render.render(write_still=True)
        with OpenEXR.File(str(path)) as file:
            return np.asarray(next(iter(file.channels().values())).pixels[..., :3], float)

    def pairs(self) -> SimpleNamespace:
        """What the camera sees under each lamp: unit vectors wi, wr (n, 3), irradiances and variances (n,)."""
        import bpy

        depsgraph = bpy.context.evaluated_depsgraph_get()
        found = []
        for places in self.addon.camera_look.look(self.scene, depsgraph, rays=_RAYS).places:
            wr = np.einsum("nij,nj->ni", places.frames, places.to_view)
            for sent in self.addon.irradiance.lamps_sent(self.scene, places.thing, places.points):
                wi = np.einsum("nij,nj->ni", places.frames, sent.direction)
                lit = (wi[:, 2] > 0) & (wr[:, 2] > 0) & (sent.irradiance > 0)
                found.append((wi[lit], wr[lit], sent.irradiance[lit], sent.variance[lit]))
        wi, wr, irradiance, variance = (np.concatenate(each) for each in zip(*found, strict=True))
        return SimpleNamespace(wi=wi, wr=wr, irradiance=irradiance, variance=variance)

    def exact(self) -> Table:
        """A whole bake of the same kernel whose error is small beside the errors that are compared. Its levels are so
        close that a lamp's disc is read with the right width."""
        folder = self.pictures / f"{self.name}_exact"
        surface = read_height_map(f"sample:{SCENES[self.name][0]}")
        request = BakeRequest(delta_e=_EXACT, coherence_length_m=self.table()[0].coherence_length_m)
        facts = bake_to_folder([surface], request, folder)
        table = replace(atlas.read(Path(facts["files"][0]))[0], wider=())
        cell = cell_for(len(table.terms), table.inner, table.sigma_b, spacings=(Spacing(_EXACT_RATIO, 0.0),))
        return with_levels(table, cell)

    def move(self, *, upwards: bool) -> None:
        """Move the camera around the middle of the object."""
        import bpy
        from mathutils import Matrix

        camera = self.scene.camera
        middle = bpy.data.objects[SCENES[self.name][1]].matrix_world.translation
        axis = -camera.matrix_world.col[0].to_3d() if upwards else "Z"
        about = Matrix.Translation(middle) @ Matrix.Rotation(np.radians(TURN_DEG), 4, axis)
        camera.matrix_world = about @ Matrix.Translation(-middle) @ camera.matrix_world
        bpy.context.view_layer.update()


def measure(of: Scene, arguments: argparse.Namespace) -> list[dict]:
    """The figures of a scene with each choice of lights."""
    import bpy

    facts = []
    camera, exact = of.scene.camera.matrix_world.copy(), of.exact()
    for lights in LIGHTS:
        of.addon.making_materials.choose_lights(of.grating, lights)
        (whole, before), first = of.table(), of.render(f"{lights.lower()}_whole")
        start = time.perf_counter()
        measured = of.addon.measuring_needs.measure_needs(of.scene, of.grating)
        seconds = time.perf_counter() - start
        request = of.addon.measuring_needs.request_with(of.grating, measured.needs)
        of.addon.baking.bake_and_wait(of.grating, request=request)
        (part, after), second = of.table(), of.render(f"{lights.lower()}_needs")
        row = {
            "scene": of.name, "lights": lights, "before": before, "after": after, "measured_s": seconds,
            "needs": measured.as_dict(), **errors(exact, (whole, part), of.pairs()),
            "pixels": pixels(first, second), "still": of.addon.finding_bakes.notice_outside(of.scene),
        }  # fmt: skip
        for way, upwards in (("aside", False), ("up", True)):
            of.move(upwards=upwards)
            start = time.perf_counter()
            row[way] = of.addon.finding_bakes.notice_outside(of.scene)
            row["noticed_s"] = time.perf_counter() - start
            of.scene.camera.matrix_world = camera
        facts.append(row)
        tell(row, arguments.json)
        bpy.context.view_layer.update()
        whole_again = of.addon.measuring_needs.request_with(of.grating, of.addon.measuring_needs.EVERYTHING)
        of.addon.baking.bake_and_wait(of.grating, request=whole_again)
    return facts


def errors(exact: Table, tables: tuple[Table, Table], pairs: SimpleNamespace) -> dict:
    """The share of the light held by the second table, which is a part of the first, and the errors of both there."""
    light = pairs.irradiance[:, None]
    held = tables[1].holds(*(pairs.wi + pairs.wr).T)
    xyz = [reflected_xyz(t, pairs.wi, pairs.wr, variance=pairs.variance) * light for t in (exact, *tables)]
    counted, white = np.ones(held.sum(), bool), white_xyz(exact.illuminant)
    found = [worst_exposure(xyz[0][held], each[held], counted, white=white)["p99"] for each in xyz[1:]]
    return {"pairs": len(held), "held": float(xyz[0][held, 1].sum() / xyz[0][:, 1].sum()), "errors": found}


def pixels(first: np.ndarray, second: np.ndarray) -> dict:
    """CIEDE2000 between two pictures over their lit pixels, and the relative difference of their light."""
    differences = colour_differences(second, first)
    p50, p95, p99 = np.percentile(differences, [50, 95, 99])
    light = abs(second.mean() / first.mean() - 1)
    return {"p50": float(p50), "p95": float(p95), "p99": float(p99), "light": float(light)}


def tell(row: dict, target: str | None) -> None:
    """Print a scene's figures."""
    before, after, needs = row["before"], row["after"], row["needs"]
    ranges = ", ".join(f"{name} {needs[name][0]:.2f} to {needs[name][1]:.2f}" for name in "uvw")
    report.say(
        f"{row['scene']}, {row['lights']}: {ranges}; lamp {needs['light_radius_deg']:.3g} deg, footprint "
        f"{needs['footprint']:.2g}; measured in {row['measured_s']:.1f} s\n"
        f"  MiB {before['MiB']:.1f} -> {after['MiB']:.1f}, terms {before['terms']} -> {after['terms']}, look-ups "
        f"{before['look_ups']} -> {after['look_ups']}; held {needs['measured']['light_share']:.2%} of an even "
        f"spectrum, {row['held']:.2%} of its own\n"
        f"  errors at {row['pairs']} pairs: dE00 p99 {row['errors'][0]:.2f} -> {row['errors'][1]:.2f}; pixels: dE00 "
        f"{row['pixels']['p50']:.2f} (median), {row['pixels']['p95']:.2f} (95 %), light {row['pixels']['light']:.2%}\n"
        f"  noticed as it stands: {'; '.join(row['still']) or 'nothing'}; moved by {TURN_DEG:.0f} degrees to the side: "
        f"{'; '.join(row['aside']) or 'nothing'}; upwards, in {row['noticed_s']:.2f} s: "
        f"{'; '.join(row['up']) or 'nothing'}",
        target,
    )

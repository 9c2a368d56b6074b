# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample scenes: `./dev scenes`. Each is a .blend that opens and renders without the extension, and its picture.

A scene is a script of this folder, bakes of shipped samples, and verbs of the command line that join them. Except in
`hero` and `macro`, the snakes use the real scan if its file is present, else the sample that imitates it."""

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path

from devtools.environments import ALL
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.surface.samples.catalogue import matter_of
from sample_scenes.demo import LASER, Stopwatch, render_scene, scan_or_sample

# Scenes without sun lamps; what a snake can lie on (sets.py); and the lights of relight.py, which replace sun lamps.
# sets.py and relight.py themselves run only in Blender.
PRODUCTS = ("disc", "bottle", "beetle")
WITHOUT_SUNS = {"room", "shed", *PRODUCTS}
SETS = ("soil", "turntable")
WORLDS = ("studio", "sky", "overcast", "room", "area")


@dataclass(frozen=True)
class SampleScene:
    """A scene: the script that writes it and its options; the FILE to bake for each object; more arguments of `assign`;
    verbs to run afterwards; whether a real scan takes the place of the sample that imitates it; Cycles samples at which
    the picture is clean; the illuminant and the matter of its bakes."""

    script: str
    bakes: dict[str, str]
    options: tuple[str, ...] = ()
    assign: tuple[str, ...] = ()
    verbs: tuple[tuple[str, ...], ...] = ()
    scan: bool = True
    samples: int = 64
    illuminant: str = "D65"
    matter: str = "dielectric"


def _animal(view: str, species: str = "XENOPELTIS", **settings) -> SampleScene:
    bakes = {"Snake": f"sample:{species.lower()}"}
    return SampleScene("animal.py", bakes, ("--view", view, "--species", species), ("--over",), **settings)


SCENES = {
    "hero": _animal("hero", scan=False),
    "corn_snake": _animal("hero", "ELAPHE"),
    "room": _animal("room", samples=128),
    "macro": _animal("macro", scan=False),
    "close_xenopeltis": _animal("close"),
    "close_elaphe": _animal("close", "ELAPHE"),
    "turntable": _animal("turntable"),
    **{name: SampleScene("products.py", {}, ("--product", name)) for name in PRODUCTS},
    "cd": SampleScene("discs.py", {"CD": "sample:cd"}, matter=matter_of("sample:cd")),
    "shed": SampleScene(
        "wall.py", {"Carrier": "sample:elaphe"}, assign=("--lights", "lamps"),
        verbs=(("diffraction-lamp", "--object", "Carrier"),), samples=16, illuminant=LASER,
    ),
}  # fmt: skip


def main(argv: list[str] | None = None) -> int:
    """Write and render scenes. Returns the exit status."""
    parser = OneLineParser(prog="./dev scenes", description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--scene", action="append", choices=list(SCENES), help="which; default all")
    parser.add_argument("--engine", choices=("cycles", "eevee"), default="cycles")
    parser.add_argument(
        "--lights",
        choices=("rest", "lamps", "all"),
        help="which lights the diffraction answers to; default: the scene's",
    )
    parser.add_argument(
        "--world", choices=WORLDS, help="light the scene by this world, or by a large area lamp, in place of its suns"
    )
    parser.add_argument("--no-shadows", action="store_true", help="let nothing shade the diffraction")
    parser.add_argument("--samples", type=count(1, 1 << 20), help="of a pixel; default: the scene's own, 16 to 128")
    parser.add_argument("--width", type=count(4, 8192), default=960)
    parser.add_argument("--faces", type=count(11_000, 1_000_000), help="of a snake; default: 200000")
    parser.add_argument("--set", choices=SETS, help="what a snake lies on; default: the scene's")
    parser.add_argument("--bpy", choices=[e.blender_version for e in ALL], help="the bpy wheel to render with")
    parser.add_argument("--blender", type=Path, help="the Blender binary to render with")
    arguments = parser.parse_args(argv)
    names = arguments.scene or [name for name in SCENES if not (arguments.world and name in WITHOUT_SUNS)]
    if arguments.world and WITHOUT_SUNS.intersection(names):
        parser.error(f"--world takes the place of suns, which {', '.join(sorted(WITHOUT_SUNS))} have not")
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    watch = Stopwatch()
    for name in names:
        print(make(name, SCENES[name], output, arguments=arguments, watch=watch), flush=True)
    return 0


def make(name: str, scene: SampleScene, output: Path, *, arguments: argparse.Namespace, watch: Stopwatch) -> Path:
    """Bake, build, assign and render one scene. Returns the path of its picture; the .blend is beside it."""
    options = list(scene.options)
    if name == "room":
        panorama = output / "room.exr"
        watch.run("room: panorama", [sys.executable, "-m", "sample_scenes.room", "--output", panorama])
        options += ["--panorama", panorama]
    if scene.script == "animal.py":
        options += ["--faces", arguments.faces] if arguments.faces else []
        options += ["--set", arguments.set] if arguments.set else []
    edits = []
    lights = ["--lights", arguments.lights] if arguments.lights else []
    lights += ["--no-shadows"] if arguments.no_shadows else []

    for shown, file in scene.bakes.items():
        height_map = scan_or_sample(file.removeprefix("sample:")) if scene.scan else [file]
        folder = output / "bakes" / f"{Path(height_map[0]).name.replace(':', '_')}_{scene.illuminant}_{scene.matter}"
        folder.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, "-m", "precompute", "bake", *height_map, "-o", folder, "--json", "-"]
        command += ["--illuminant", scene.illuminant, "--matter", scene.matter]
        baked = json.loads(watch.run(f"{name}: bake", command))["files"][0]
        edits.append(["assign", baked, "--object", shown, *scene.assign, *lights])
    edits += [list(verb) for verb in scene.verbs]
    stages = [[scene.script, *options]]
    if arguments.world:
        stages.append(["relight.py", "--world", arguments.world])
    picture = output / f"{'_'.join(filter(None, (name, arguments.world, arguments.engine)))}.png"
    samples = arguments.samples or scene.samples
    render_scene(name, picture, stages, edits=edits, samples=samples, arguments=arguments, watch=watch)
    return picture


if __name__ == "__main__":
    sys.exit(main())

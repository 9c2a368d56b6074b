# SPDX-License-Identifier: GPL-3.0-or-later
"""Frame rates and seconds to the first picture on a graphics card, in EEVEE and in Cycles.

    ./dev bench card [--device CUDA|OPTIX|CPU|...] [--engine eevee] [--lamps N ...] [--scene hero|cd ...] [--width 1920]
        [--height 1080] [--files DIR] [--output DIR] [--json FILE|-]

The scenes are the samples `hero` and `cd` under 1, 3 and 8 suns. Their object has its own material with a grating
(Lamps and World), the same without shadow rays, without the grating, or a Principled metal. EEVEE renders on what
draws the windows. Cycles renders on the device without Open Shading Language.

- `first` is the time from opening a file to its first picture. For EEVEE each grating has its own process, and the
  driver keeps no shaders of an earlier one, so all of EEVEE's shaders are compiled in it. Materials without a grating
  share a process for all numbers of suns, and so do all files in Cycles: only the first of them compiles EEVEE's
  shaders, or loads Cycles' kernels.
- `again` is a picture of one sample. Then come the pictures of each number of samples, and `ms/sample`, what each
  further sample takes.
- `median` and `p99` are of the difference to the processor's picture with the same random numbers, over its mean.

--files keeps the scenes' files, or uses the files that are there: they render on a machine without the extension. The
snake of `hero` lies on a grey plate: its soil's 150,000 grains would take more time than anything that is measured.
--output keeps the pictures, as OpenEXR.
"""

import argparse
import json
import os
import runpy
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from devtools import ROOT
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.table.atlas import read_header

from . import report
from .card_pictures import MARK, Job, picture_of

# Where the suns stand.
_AZIMUTHS_DEG, _ELEVATION_DEG = (128, 218, 328, 148, 238, 348, 168, 258), 30
SCENES = ("hero", "cd")
# A Principled metal; the object's own material without diffraction; with it; and with it but without shadow rays.
MATERIALS = ("metal", "plain", "grating", "unshadowed")


def file_of(folder: Path, scene: str, material: str, lamps: int) -> Path:
    """Where the file of a row is."""
    return folder / scene / f"{material}_{lamps}.blend"


def material_of(file: Path) -> str:
    """The material of a row's file."""
    return file.stem.split("_")[0]


def write_files(folder: Path, names: Sequence[str], lamps: Sequence[int]) -> None:
    """Write the files of these scenes, one for each material and number of suns."""
    from .blender import start_blender

    with tempfile.TemporaryDirectory() as user_folder:
        addon = start_blender(Path(user_folder))
        for name in names:
            _write_scene(addon, name, folder, lamps)


def _write_scene(addon, name: str, folder: Path, lamps: Sequence[int]) -> None:
    import bpy

    from sample_scenes.sets import stops_for_grey

    from .studio import Scene

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)  # drops the pictures of the scene before
    built = Scene.built(addon, name, argparse.Namespace(width=1920, samples=16), folder, ground="turntable")
    scene = built.scene
    scene.render.engine = addon.compat.eevee_engine()
    slots = [
        slot
        for thing in bpy.data.objects
        for slot in thing.material_slots
        if slot.material and addon.material.diffraction_nodes(slot.material)
    ]
    dressed = [slot.material for slot in slots]
    plain = [material.copy() for material in dressed]
    for material in plain:
        addon.material.remove_diffraction(material)
    materials = {"metal": [_metal(addon, built.grating.baked_file())] * len(slots), "plain": plain}
    for suns in lamps:
        _light(addon, scene, suns)
        scene.view_settings.exposure = stops_for_grey(scene)
        for material in MATERIALS:
            for slot, put in zip(slots, materials.get(material, dressed), strict=True):
                slot.material = put
            built.grating.shadows = material != "unshadowed"
            addon.lighting.update_lamps(scene)
            path = file_of(folder, name, material, suns)
            path.parent.mkdir(parents=True, exist_ok=True)
            bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)
            bpy.ops.file.unpack_all(method="WRITE_LOCAL")
            bpy.ops.wm.save_mainfile(compress=False)
            path.with_suffix(".blend1").unlink(missing_ok=True)


def _light(addon, scene, count: int) -> None:
    """Light the scene with a number of suns, which the add-on follows."""
    import bpy

    from sample_scenes.studio import Towards, add_key

    bpy.data.batch_remove([o for o in bpy.data.objects if o.type == "LIGHT"])
    for azimuth_deg in _AZIMUTHS_DEG[:count]:
        at = Towards(azimuth_deg, _ELEVATION_DEG, 1.0)
        add_key(scene, "Sun", at, target=(0.0, 0.0, 0.0), strength=12.0, angle_deg=0.53)
    addon.follow.follow_lamps(scene)


def _metal(addon, bake: Path):
    """A Principled metal as rough as the kernel is wide at normal incidence: alpha is sigma_b over sqrt(2)."""
    import bpy

    sigma_b = read_header(bake)[0].sigma_b
    material = bpy.data.materials.new("Metal")
    addon.compat.enable_nodes(material)
    principled = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    principled.inputs["Metallic"].default_value = 1.0
    principled.inputs["Roughness"].default_value = (sigma_b / 2**0.5) ** 0.5
    return material


WITHOUT_GRATING = MATERIALS[:2]
DEVICES = ("CPU", "CUDA", "OPTIX", "HIP", "ONEAPI", "METAL")
# A cache of shaders would hide what compiling takes.
_UNCACHED = {"__GL_SHADER_DISK_CACHE": "0", "MESA_SHADER_CACHE_DISABLE": "true"}


def main(argv: list[str] | None = None) -> int:
    """Print the table and return the exit status."""
    parser = OneLineParser(prog="./dev bench card", description=__doc__.splitlines()[0])
    parser.add_argument("--device", choices=DEVICES, default="CPU", help="what Cycles renders on; default: CPU")
    parser.add_argument("--engine", action="append", choices=("eevee", "cycles"))
    parser.add_argument("--backend", choices=("OPENGL", "VULKAN", "METAL"), default="OPENGL", help="of EEVEE")
    parser.add_argument("--scene", action="append", choices=SCENES)
    parser.add_argument("--material", action="append", choices=MATERIALS)
    parser.add_argument("--lamps", type=count(1, 8), action="append", help="default: 1, 3 and 8")
    parser.add_argument("--samples", type=count(1, 4096), action="append", help="default: 16 and 64")
    parser.add_argument("--repeat", type=count(1, 1000), default=2, help="renders of each; default: 2")
    parser.add_argument("--width", type=count(4, 8192), default=1920)
    parser.add_argument("--height", type=count(4, 8192), default=1080)
    parser.add_argument("--limit", type=count(1, 36000), default=900, help="seconds after which a process is ended")
    parser.add_argument("--files", type=Path, metavar="DIR", help="the scenes' files, written if missing")
    parser.add_argument("--output", type=Path, metavar="DIR", help="keep the pictures here")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    os.environ.update(_UNCACHED)
    runpy.run_path(str(ROOT / "addon" / "blender" / "mesa.py"))["filter_as_cards_do"]()
    with tempfile.TemporaryDirectory() as folder:
        arguments.files = (arguments.files or Path(folder, "files")).resolve()
        arguments.output = (arguments.output or Path(folder, "pictures")).resolve()
        arguments.output.mkdir(parents=True, exist_ok=True)
        rows = list(measured(arguments, Path(folder)))
    report.write({"width": arguments.width, "height": arguments.height, "rows": rows}, arguments.json)
    return int(any("failed" in row for row in rows))


def measured(arguments: argparse.Namespace, folder: Path) -> Iterator[dict]:
    """The rows, each printed as soon as it is known."""
    scenes, lamps = arguments.scene or SCENES, arguments.lamps or [1, 3, 8]
    samples, materials = arguments.samples or [16, 64], arguments.material or MATERIALS
    missing = [
        s for s in scenes if not all(file_of(arguments.files, s, m, n).is_file() for m in materials for n in lamps)
    ]
    if missing:
        write_files(arguments.files, missing, lamps)
    files = [[[file_of(arguments.files, s, m, n) for n in lamps] for m in MATERIALS if m in materials] for s in scenes]
    counts = "".join(f"{f'{n}, s':>9}" for n in samples)
    report.say(
        f"{'':9}{'scene':7}{'material':11}{'suns':>4}{'first, s':>10}{'again, s':>10}{counts}{'ms/sample':>11}"
        f"{'median':>10}{'p99':>10}", arguments.json,
    )  # fmt: skip
    cards = set()
    for job in _jobs(arguments, files, samples):
        for facts in _run(job, folder, arguments.limit):
            if facts.get("card", "") not in {"", *cards}:
                cards.add(facts["card"])
                report.say(f"{job.device}: {facts['card']}", arguments.json)
            row = _row(facts, job)
            report.say(_line(row, samples), arguments.json)
            yield row


def _jobs(arguments: argparse.Namespace, files: list[list[list[Path]]], samples: list[int]) -> Iterator[Job]:
    """What each process renders, of files by scene, material and number of suns. The processor's pictures come before
    the pictures that are compared with them."""

    def job(device: str, paths: list[Path], numbers: list[int], repeat: int = arguments.repeat) -> Job:
        return Job(
            device,
            [str(path) for path in paths],
            (arguments.width, arguments.height),
            samples=numbers,
            output=str(arguments.output),
            repeat=repeat,
            backend=arguments.backend,
        )

    engines = arguments.engine or ("eevee", "cycles")
    rows = [row for scene in files for row in scene]
    if "eevee" in engines:
        for row in rows:
            alike = material_of(row[0]) in WITHOUT_GRATING
            yield from (job("EEVEE", paths, samples) for paths in ([row] if alike else [[path] for path in row]))
    if "cycles" in engines:
        every = [path for row in rows for path in row]
        left = [path for path in every if not picture_of(arguments.output, path, "CPU", samples[0]).is_file()]
        if arguments.device != "CPU" and left:
            yield job("CPU", left, samples[:1], repeat=1)
        yield job(arguments.device, every, samples)


def _run(job: Job, folder: Path, limit: int) -> Iterator[dict]:
    """The facts of each file of a job, from its process. A process that fails gives a last row that says why."""
    environment = os.environ | {"BLENDER_USER_RESOURCES": str(folder / "user")}
    command = [sys.executable, "-m", f"{__package__}.card_pictures", job.as_text()]
    done, last = 0, ""
    with subprocess.Popen(
        command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        timer = threading.Timer(limit, process.kill)
        timer.start()
        for line in process.stdout or ():
            if line.startswith(MARK):
                done += 1
                yield json.loads(line.removeprefix(MARK))
            last = line.strip() or last
        timer.cancel()
    if done < len(job.files):
        why = last if process.returncode >= 0 else f"ended by signal {-process.returncode}; {last}"
        yield {"file": job.files[done], "failed": why}


def _row(facts: dict, job: Job) -> dict:
    """A row of the table: what was rendered on what, the facts, and the difference to the processor's picture."""
    file, output = Path(facts["file"]), Path(job.output)
    lamps = int(file.stem.split("_")[1])
    row = {"device": job.device, "scene": file.parent.name, "material": material_of(file), "lamps": lamps, **facts}
    row.pop("file")
    seconds = sorted((int(samples), spent) for samples, spent in facts.get("seconds", {}).items())
    if len(seconds) > 1:
        row["sample"] = (seconds[-1][1] - seconds[0][1]) / (seconds[-1][0] - seconds[0][0])
    if seconds and job.device not in ("EEVEE", "CPU"):
        pictures = [picture_of(output, file, device, seconds[0][0]) for device in (job.device, "CPU")]
        if pictures[1].is_file():
            row["median"], row["p99"] = differences(*map(read, pictures))
    return row


def differences(picture: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    """Median and 99th percentile of the difference of two pictures, over the mean of the second."""
    median, p99 = np.percentile(np.abs(picture - truth), [50, 99]) / truth.mean()
    return float(median), float(p99)


def read(path: Path) -> np.ndarray:
    """A picture (rows, columns, 3)."""
    import OpenEXR

    with OpenEXR.File(str(path)) as file:
        return np.asarray(next(iter(file.channels().values())).pixels[..., :3], float)


def _line(row: dict, samples: list[int]) -> str:
    """A row for people."""
    begin = f"{row['device']:9}{row['scene']:7}{row['material']:11}{row['lamps']:4}"
    if "failed" in row:
        return f"{begin}  failed: {row['failed']}"
    spent = (row["seconds"].get(str(number)) for number in samples)
    numbers = [(row["first"], 10, ".1f"), (row["again"], 10, ".3f"), *((each, 9, ".3f") for each in spent)]
    numbers.append((1e3 * row["sample"] if "sample" in row else None, 11, ".2f"))
    numbers += [(row.get(key), 10, ".1e") for key in ("median", "p99")]
    return begin + "".join(" " * width if value is None else f"{value:{width}{form}}" for value, width, form in numbers)

# SPDX-License-Identifier: GPL-3.0-or-later
"""`blender --background [FILE] --command grating VERB ...`: the buttons' own operators, for batches.

Each verb works on the file that Blender has open. What changes it saves it: to --save, else in place.
"""

import sys
from pathlib import Path

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.cli.arguments import add_bake_options, add_input, existing_bake
from ...precompute.cli.bake import bake_summary
from ...precompute.cli.output import emit
from ...precompute.cli.parser import OneLineParser
from ..actions.assign import assign_to_meshes
from ..actions.bake import bake_and_wait
from ..actions.import_height_map import add_grating
from ..scene import compat
from ..scene.gratings import Grating


def execute(argv: list[str]) -> int:
    """Run one verb; Blender's exit status."""
    try:
        arguments = build_parser().parse_args(argv)
    except SystemExit as stop:
        return stop.code or 0
    try:
        arguments.run(arguments)
    except GratingError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except RuntimeError as error:  # Blender's own operators: save, render
        print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
        return 1
    return 0


def build_parser() -> OneLineParser:
    """The verbs of the command line inside Blender."""
    parser = OneLineParser(prog="blender --command grating", description="Diffraction gratings in batch.")
    verbs = parser.add_subparsers(required=True, metavar="VERB", parser_class=OneLineParser)

    bring = verbs.add_parser("import", help="add a height map to the scene")
    add_input(bring)
    add_save(bring)
    bring.set_defaults(run=run_import)

    bake = verbs.add_parser("bake", help="import a height map and bake it")
    add_input(bake)
    bake.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder for the bake; default the cache")
    add_bake_options(bake)
    add_save(bake)
    bake.set_defaults(run=run_bake)

    assign = verbs.add_parser("assign", help="put a bake's material on meshes and save the file")
    assign.add_argument("bake", type=Path, metavar="BAKE", help="the .exr that `bake` wrote, or its folder")
    assign.add_argument("--object", action="append", metavar="NAME", help="a mesh (repeatable); default: the selected")
    add_save(assign)
    assign.set_defaults(run=run_assign)

    render = verbs.add_parser("render", help="render the open file's scene to a picture")
    render.add_argument("-o", "--output", required=True, type=Path, metavar="PNG|EXR")
    render.add_argument("--engine", choices=("cycles", "eevee"), help="default: the file's own")
    render.add_argument("--samples", type=int, metavar="N")
    render.add_argument("--width", type=int, metavar="PIXELS")
    render.add_argument("--height", type=int, metavar="PIXELS")
    render.set_defaults(run=run_render)
    return parser


def add_save(parser) -> None:
    """Where a changed file goes."""
    parser.add_argument("--save", type=Path, metavar="BLEND", help="save the file here; default: where it came from")


def run_import(arguments) -> None:
    """The `import` verb."""
    grating = import_into_scene(arguments)
    save(arguments.save)
    emit({"name": grating.name, "summary": grating.summary}, arguments.json, lambda: grating.summary)


def run_bake(arguments) -> None:
    """The `bake` verb: also without a file open."""
    grating = import_into_scene(arguments)
    grating.delta_e = arguments.delta_e
    grating.coherence_um = arguments.coherence_um or 0.0
    options = ["--illuminant", arguments.illuminant, "--model", arguments.model]
    options += ["--no-cache"] if arguments.no_cache else []
    options += ["--needs", str(arguments.needs.resolve())] if arguments.needs else []
    facts = bake_and_wait(grating, str(arguments.output.resolve()) if arguments.output else "", options)
    if bpy.data.filepath or arguments.save:
        save(arguments.save)
    emit(facts, arguments.json, lambda: bake_summary(facts))


def run_assign(arguments) -> None:
    """The `assign` verb."""
    file = existing_bake(str(arguments.bake))
    if file is None:
        raise GratingError(f"{arguments.bake}: no bake there; give the .exr that `bake` wrote, or its folder")
    select_meshes(arguments.object)
    gratings = bpy.context.scene.natural_gratings
    path = str(file.resolve())
    index = next((i for i, g in enumerate(gratings.items) if g.bake_path == path), None)
    if index is None:
        grating = gratings.items.add()
        grating.name, grating.bake_path = file.stem, path
        index = len(gratings.items) - 1
    gratings.active_index = index
    selected = [o for o in bpy.context.view_layer.objects if o.select_get()]
    report = assign_to_meshes(bpy.context.scene, selected)
    save(arguments.save)
    print(report)


def run_render(arguments) -> None:
    """The `render` verb."""
    scene = bpy.context.scene
    if scene.camera is None:
        raise GratingError(f"scene {scene.name}: no camera; add one and make it the scene's camera")
    kinds = {".png": "PNG", ".exr": "OPEN_EXR"}
    kind = kinds.get(arguments.output.suffix.lower())
    if kind is None:
        raise GratingError(f"{arguments.output}: neither PNG nor EXR; name the picture .png or .exr")
    render = scene.render
    if arguments.engine:
        render.engine = "CYCLES" if arguments.engine == "cycles" else compat.eevee_engine()
    if arguments.samples:
        scene.cycles.samples = scene.eevee.taa_render_samples = arguments.samples
    render.resolution_x = arguments.width or render.resolution_x
    render.resolution_y = arguments.height or render.resolution_y
    render.image_settings.file_format = kind
    if kind == "OPEN_EXR":
        render.image_settings.color_depth = "32"
    render.filepath = str(arguments.output.resolve())
    bpy.ops.render.render(write_still=True)
    if not arguments.output.is_file():
        raise GratingError(f"{arguments.output}: not written; check the folder and its permissions")


def import_into_scene(arguments) -> Grating:
    """What the import button does, with the command line's arguments."""
    source = arguments.file if arguments.file.startswith("sample:") else str(Path(arguments.file).resolve())
    size_um, height_nm = arguments.size_um or 0.0, arguments.height_nm or 0.0
    return add_grating(bpy.context.scene, source, size_um, height_nm, arguments.channel or "")


def select_meshes(names: list[str] | None) -> None:
    """Select just the named objects. Raises GratingError if one is missing."""
    if not names:
        return
    objects = bpy.context.view_layer.objects
    for name in names:
        if name not in objects:
            raise GratingError(f"{name}: no such object in the scene; there are {', '.join(o.name for o in objects)}")
    for candidate in objects:
        candidate.select_set(candidate.name in names)


def save(path: Path | None) -> None:
    """Save the open file, to a path or where it came from."""
    target = str(path.resolve()) if path else bpy.data.filepath
    if not target:
        raise GratingError("the scene has no file yet; give --save FILE.blend")
    bpy.ops.wm.save_as_mainfile(filepath=target)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The verbs that leave the open file as it is: `render`, `assets` and `cache`."""

import argparse
from pathlib import Path

from ...precompute.cli import cache_verb
from ...precompute.cli.arguments import add_json, add_progress, count, frames_argument, path_argument
from ...precompute.cli.printing import Progress, emit
from ...precompute.presets.presets import preset_names
from ..assets.library import make_and_wait, summary_of
from ..gratings.cache_folder import cache_folder
from ..rendering.worker import progress_lines
from ..workflow.rendering_pictures import render_picture


def render_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `render`."""
    parser.add_argument(
        "-o", "--output", required=True, type=path_argument, metavar="PNG|EXR",
        help="the picture; of several frames, each gets its number before the ending, or in place of #### in the name",
    )  # fmt: skip
    parser.add_argument("--engine", choices=("cycles", "eevee"), help="default: the file's own")
    parser.add_argument("--samples", type=count(1, 1 << 24), metavar="N")
    parser.add_argument("--width", type=count(4, 65536), metavar="PIXELS")
    parser.add_argument("--height", type=count(4, 65536), metavar="PIXELS")
    parser.add_argument(
        "--frames", type=frames_argument, metavar="RANGES", help="such as 1-24:2,30; default: the present frame"
    )
    parser.add_argument("--resume", action="store_true", help="skip frames whose pictures are there")
    parser.set_defaults(output_is_file=True)


def run_render(arguments: argparse.Namespace) -> None:
    """The `render` verb."""
    settings = {name: getattr(arguments, name) for name in ("engine", "samples", "width", "height")}
    if arguments.frames is None:
        if not (arguments.resume and arguments.output.is_file()):
            render_picture(arguments.output, **settings)
        return
    tell = progress_lines(False)
    paths = {frame: _of_frame(arguments.output, frame) for frame in arguments.frames}
    todo = {frame: path for frame, path in paths.items() if not (arguments.resume and path.is_file())}
    for done, (frame, path) in enumerate(todo.items(), 1):
        render_picture(path, frame=frame, **settings)
        tell(path.name, done, len(todo))
    print(f"{len(todo)} rendered, {len(paths) - len(todo)} there already")


def _of_frame(path: Path, frame: int) -> Path:
    """The path of a frame's picture."""
    head, marks, tail = path.stem.partition("#")
    if not marks:
        return path.with_stem(f"{path.stem}_{frame:04d}")
    width = len(marks + tail) - len(tail.lstrip("#"))
    return path.with_stem(f"{head}{frame:0{width}d}{tail.lstrip('#')}")


def assets_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `assets`."""
    parser.add_argument(
        "-o", "--output", type=path_argument, metavar="DIR", required=True, help="folder of the asset library"
    )
    parser.add_argument(
        "--preset", action="append", choices=preset_names(), metavar="NAME", help="only this preset; repeatable"
    )
    add_json(parser)
    add_progress(parser)


def run_assets(arguments: argparse.Namespace) -> None:
    """The `assets` verb. The open file and Blender's preferences stay as they are."""
    folder = arguments.output.resolve()
    files = make_and_wait(folder, arguments.preset or (), progress=Progress(arguments.progress))
    facts = {"files": [str(file) for file in files], "bytes": sum(file.stat().st_size for file in files)}
    emit(facts, arguments.json, lambda: [f"{folder}: {summary_of(files)}; add it in Preferences > File Paths"])


def cache_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `cache`."""
    cache_verb.add_arguments(parser)


def run_cache(arguments: argparse.Namespace) -> None:
    """The `cache` verb, on the cache of the extension. The files that scenes refer to are no part of it."""
    cache_verb.run_in(cache_folder(), arguments)

# SPDX-License-Identifier: GPL-3.0-or-later
"""`render`: render the open file's scene to a picture."""

import argparse

from ...precompute.cli.option_types import count, path_argument
from ..workflow.rendering_pictures import render_picture


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `render`."""
    parser.add_argument("-o", "--output", required=True, type=path_argument, metavar="PNG|EXR")
    parser.add_argument("--engine", choices=("cycles", "eevee"), help="default: the file's own")
    parser.add_argument("--samples", type=count(1, 1 << 24), metavar="N")
    parser.add_argument("--width", type=count(4, 65536), metavar="PIXELS")
    parser.add_argument("--height", type=count(4, 65536), metavar="PIXELS")
    parser.set_defaults(output_is_file=True)


def run(arguments: argparse.Namespace) -> None:
    """The `render` verb."""
    size = {"width": arguments.width, "height": arguments.height}
    render_picture(arguments.output, engine=arguments.engine, samples=arguments.samples, **size)

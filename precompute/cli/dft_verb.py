# SPDX-License-Identifier: GPL-3.0-or-later
"""`dft`: the images that the OSL shaders of the thesis's algorithms read."""

import argparse

from ..methods import dft_images
from ..methods.dft_layout import TEXELS_MAX
from ..methods.method_registry import SHADER_METHODS
from ..surface.steps.pipeline import DEFAULT
from .arguments import (
    PERIOD_NM,
    STEP_NM,
    TERMS,
    add_input,
    add_level,
    coherence_argument,
    count,
    height_map_of,
    path_argument,
    period_of,
)
from .printing import Progress, emit


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dft`."""
    add_input(parser)
    parser.add_argument(
        "-o", "--output", required=True, type=path_argument, metavar="DIR", help="folder for the images"
    )
    parser.add_argument(
        "--method", choices=SHADER_METHODS, default="flss",
        help="the method that will read the images; chebyshev is FLSS for reliefs too deep for Taylor's series; "
        "default flss",
    )  # fmt: skip
    parser.add_argument("--terms", type=TERMS, metavar="N", help="terms of the expansion; default: by error bound")
    parser.add_argument("--step-nm", type=STEP_NM, default=5.0, metavar="NM", help="wavelength step; default 5")
    parser.add_argument(
        "--texels", type=count(0, TEXELS_MAX), choices=(0, *range(1, TEXELS_MAX + 1, 2)), default=3, metavar="N",
        help="texels that the shader reads along each axis, odd; 0: all that the window reaches; default 3",
    )  # fmt: skip
    parser.add_argument("--coherence-um", type=coherence_argument, default=65.0, metavar="UM", help="default 65")
    parser.add_argument(
        "--period-nm", type=PERIOD_NM, metavar="NM", help="period of the grating (nmm); default: it is found"
    )
    add_level(parser, "plane", DEFAULT)


def run(arguments: argparse.Namespace) -> None:
    """Run the verb `dft`: transform the terms and write their images."""
    settings = dft_images.settings_for(
        coherence_length_m=None if arguments.coherence_um is None else arguments.coherence_um * 1e-6,
        terms=arguments.terms,
        step_m=arguments.step_nm * 1e-9,
        texels=arguments.texels,
        period_m=period_of(arguments),
    )
    written = dft_images.images_to_folder(
        height_map_of(arguments), arguments.method, settings, folder=arguments.output,
        levelling=arguments.level, progress=Progress(arguments.progress),
    )  # fmt: skip
    size = written.image_bytes / 2**20
    summary = f"{written.files[0]}: {written.layout.terms} terms, {size:.0f} MiB"
    emit(written.as_dict(), arguments.json, lambda: [summary])

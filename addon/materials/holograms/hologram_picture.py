# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a hologram: data that the pattern reads as it is in the file."""

from pathlib import Path

import bpy

from ....precompute.base.failure import GratingError
from ..pictures import content_of, note_content, picture_of


def load_picture(path: str) -> bpy.types.Image:
    """Load a picture for a hologram, or take the one that was loaded from the same content. It is packed: Cycles may
    read other pictures at a reduced size, and the cells would have edges of wrong colours.

    Its values stay those of the file, so that a hue is the one that a paint program shows. Raises GratingError, with
    nothing loaded, if the file is missing or is no picture."""
    if not path:
        raise GratingError("", "From Picture needs a picture", "choose a file, such as a .png")
    file = Path(bpy.path.abspath(path))
    if not file.is_file():
        raise GratingError(path, "no such file", "choose a picture, such as a .png")
    content = f"hologram {content_of(file)}"
    image = picture_of(content)
    return image if image is not None else _loaded(file, content)


def _loaded(file: Path, content: str) -> bpy.types.Image:
    remedy = "choose a picture that Blender reads, such as a .png, .jpg or .exr"
    try:
        image = bpy.data.images.load(str(file), check_existing=False)
    except RuntimeError as error:
        raise GratingError(file, "not a picture that Blender reads", remedy) from error
    image.colorspace_settings.is_data = True
    image.alpha_mode = "CHANNEL_PACKED"
    if image.source != "FILE" or not all(image.size):
        bpy.data.images.remove(image)
        raise GratingError(file, "not a picture that Blender reads", remedy)
    image.pack()
    note_content(image, content)
    return image

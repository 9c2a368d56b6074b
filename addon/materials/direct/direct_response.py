# SPDX-License-Identifier: GPL-3.0-or-later
"""The response of a bake's files: packs their pictures into the .blend and builds the Direct and World groups."""

from pathlib import Path

import bpy

from ....precompute.base.failure import GratingError
from ....precompute.colour.spaces import rgb_from_xyz
from ....precompute.reflectance.matter import Matter
from ....precompute.surface.generated.parameters import title_of_stem
from ....precompute.table.atlas import Layout, matter_in, read_sound_header
from ....precompute.table.sample_set import SampleSetLayout, path_beside
from ....precompute.table.sample_set import read_sound_header as read_sound_set_header
from ...blender.working_space import working_space
from ..atlas_nodes import lamp_table_image
from ..lamp_errors import note_lamp_errors
from ..lobes.lobes_group import SampleSetNodes, build_world_group, reflectance_image, wavelengths_image
from ..matter_nodes import note_matter
from ..pictures import content_of, note_content, note_pictures, picture_of
from ..response import Response, note_working_space
from .direct_group import build_direct_group

# Header entries that are equal in the two files of a bake, and differ between bakes.
_OF_A_BAKE = ("heights_sha256", "request")


def direct_response(path: Path) -> Response:
    """The response of a bake's file and of the sample set beside it. Without a sample set, only lamps light it.

    Raises GratingError, and leaves nothing behind, if a file is damaged or the two do not belong together."""
    layout, record = read_sound_header(path)
    draws_path = path_beside(path)
    draws_layout = None
    if draws_path.is_file():
        draws_layout, draws_record = read_sound_set_header(draws_path)
        if any(record[key] != draws_record[key] for key in _OF_A_BAKE if key in record and key in draws_record):
            raise GratingError(draws_path, f"of another bake than {path.name}", "bake again, or delete it")
    image, draws = load_atlas(path, half=record.get("precision") != "float32"), None
    if draws_layout is not None:
        draws = load_atlas(draws_path, half=True, alpha="CHANNEL_PACKED"), (draws_layout,)
    name, matter = title_of_stem(path.stem), matter_in(layout, record, path)
    response = response_of_pictures(name, image, layout, matter=matter, draws=draws)
    note_lamp_errors(response.group, layout.illuminant, record.get("delta_e", {}).get("lamps", {}))
    return response


def response_of_pictures(
    name: str, image: bpy.types.Image, layout: Layout, *, matter: Matter,
    draws: tuple[bpy.types.Image, tuple[SampleSetLayout, ...]] | None, layers: int = 1,
) -> Response:  # fmt: skip
    """The response of the pictures of one bake, or of several bakes as layers. `draws` is the picture of their sample
    sets and the layout of each; without it, only lamps light the surface."""
    light = layout.illuminant
    matrix = rgb_from_xyz(working_space(), light)
    lamps = lamp_table_image(light) if layout.triples > 1 else None
    response = build_direct_group(name, image, layout, rgb_from_xyz=matrix, lamp_table=lamps, layers=layers)
    note_working_space(response)
    note_matter(response.group, matter, light)
    note_pictures(response.group)
    if draws is None:
        return response
    picture, layouts = draws
    reflectance = reflectance_image(matter, light) if matter.baked else None
    nodes = SampleSetNodes(picture, layouts, wavelengths_image(light, layouts[0].wavelength), reflectance)
    world = build_world_group(name, image, layout, draws=nodes, rgb_from_xyz=matrix, lamp_table=lamps)
    note_pictures(world)
    return response._replace(world=world)


def load_atlas(path: Path, *, half: bool, alpha: str = "NONE") -> bpy.types.Image:
    """The bake's image, packed into the .blend. Gratings with the same bake share it. `half`: graphics cards may store
    it in half precision, as the file does. Raises GratingError if Blender cannot open the file."""
    content = content_of(path)
    if (present := picture_of(content)) is not None:
        return present
    try:
        image = bpy.data.images.load(str(path), check_existing=False)
    except RuntimeError as error:  # Blender reads a backslash as a slash
        raise GratingError(path, "Blender cannot open it", "give it a name of plain letters") from error
    image.name = title_of_stem(path.stem)
    image.colorspace_settings.is_data = True  # independent of the colour configuration's names
    image.alpha_mode = alpha  # type: ignore[assignment]  # the stubs list the names
    image.use_half_precision = half
    image.pack()
    note_content(image, content)
    return image

# SPDX-License-Identifier: GPL-3.0-or-later
"""What a grating's new material begins with: its base, and values of its Diffraction node."""

from typing import TYPE_CHECKING

import bpy
from bpy.props import FloatProperty, FloatVectorProperty, StringProperty

if TYPE_CHECKING:
    from ...precompute.presets.presets import PresetHologram

# A dark skin.
BASE_COLOR, BASE_ROUGHNESS = (0.012, 0.010, 0.009), 0.6


class MaterialLook(bpy.types.PropertyGroup):
    """What a grating's new material begins with. The defaults are those of a material made without a preset."""

    base_color: FloatVectorProperty(
        name="Base Color", description="Colour of a new material under the relief", subtype="COLOR",
        default=BASE_COLOR, min=0.0, max=1.0,
    )  # fmt: skip
    base_roughness: FloatProperty(
        name="Base Roughness",
        description="Roughness of a new material under the relief",
        default=BASE_ROUGHNESS,
        min=0.0,
        max=1.0,
    )
    inputs: StringProperty(
        name="Inputs",
        description="Values that a new material's Diffraction node begins with, as JSON; empty for the defaults",
        options={"HIDDEN"},
    )
    hologram: StringProperty(
        name="Hologram", description="Pattern that a new material begins with, as JSON; empty for none",
        options={"HIDDEN"},
    )  # fmt: skip

    def inputs_for(self, name: str) -> dict[str, float]:
        """The values that the Diffraction node of a grating's new material begins with. Raises GratingError, with the
        grating's name, if the file's values are damaged."""
        from ...precompute.base.strict import parse_json
        from ...precompute.presets.presets import inputs_of

        if not self.inputs:
            return {}
        return inputs_of(parse_json(self.inputs, name, "add the preset again", part="its inputs: "), name)

    def hologram_for(self, name: str) -> "PresetHologram | None":
        """The hologram that a grating's new material begins with, or None. Raises GratingError, with the grating's
        name, if the file's values are damaged."""
        from ...precompute.base.strict import parse_json
        from ...precompute.presets.presets import hologram_from

        if not self.hologram:
            return None
        return hologram_from(parse_json(self.hologram, name, "add the preset again", part="its hologram: "), name)

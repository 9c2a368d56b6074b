# SPDX-License-Identifier: GPL-3.0-or-later
"""How far off a grating's colours are under the lamps of a scene, as its bake states it."""

import json
import math
from collections.abc import Mapping
from typing import Any

import bpy

from ..blender import stored
from ..lamps.follow import followed_lamps
from ..lamps.lamp_spectrum import fault_of, seen_spectrum
from .response import responses_in

# Custom properties of a response's node group, saved in files: the light of its bake, and the mean and the 95th
# percentile of dE00 by lamp, as JSON.
_LIGHT, _ERRORS = "ng_light", "ng_lamp_errors"
# A lamp is reported if the 95th percentile exceeds this: twice what a bake keeps under its own light.
_TOLD = 2.0


def note_lamp_errors(group: bpy.types.NodeTree, light: str, errors: Mapping[str, Any]) -> None:
    """Store on a response's node group what its bake's header states by lamp."""
    group[_LIGHT], group[_ERRORS] = light, json.dumps(errors)


def _stated(group: bpy.types.NodeTree) -> dict[str, tuple[float, float]]:
    """The errors by lamp; empty if there are none, or if they were edited."""
    try:
        record = json.loads(stored.text(group, _ERRORS, "{}"))
        return {str(lamp): (float(mean), float(p95)) for lamp, (mean, p95) in record.items() if math.isfinite(p95)}
    except (ValueError, TypeError, AttributeError):
        return {}


def far_lamps(group: bpy.types.NodeTree | None, scene: bpy.types.Scene) -> list[str]:
    """One line for the lamps of a scene under which a Diffraction group's colours are clearly off; empty if there are
    none. The field of a lamp tells what is wrong with its text, so lamps with such a fault are left out."""
    spectra = {
        lamp.name: spectrum
        for lamp in followed_lamps(scene)
        if (spectrum := seen_spectrum(lamp.data)) and fault_of(lamp.data) is None
    }
    if group is None or not spectra:
        return []
    from ...precompute.colour.channels import stated_error

    worst: dict[str, float] = {}
    for response in responses_in(group):
        light, stated = stored.text(response.group, _LIGHT), _stated(response.group)
        for name, spectrum in spectra.items():
            error = stated_error(spectrum, light, stated)
            if error is not None and error[1] > max(_TOLD, worst.get(name, 0.0)):
                worst[name] = error[1]
    if not worst:
        return []
    farthest = max(worst, key=lambda name: worst[name])
    more = f" and {len(worst) - 1} more" if len(worst) > 1 else ""
    return [f"{farthest}{more}: the colours under this light are visibly off; bake for it"]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Values for inputs of a node, as NAME=VALUE on the command line."""

import math
from collections.abc import Mapping

from ...precompute.base.failure import GratingError
from ..nodes.interface import Socket


def setting(text: str, inputs: Mapping[str, Socket]) -> tuple[str, float]:
    """Parse NAME=VALUE, angles in degrees. Raises GratingError for an unknown input and for a value outside its
    range."""
    name, _, given = text.partition("=")
    socket = inputs.get(name)
    if socket is None:
        raise GratingError(f"--set {text}", "no such input", f"there are {', '.join(inputs)}")
    try:
        value = float(given)
    except ValueError:
        value = math.nan
    value = math.radians(value) if socket.subtype == "ANGLE" else value
    assert socket.low is not None and socket.high is not None  # every input with a default has a range
    if not socket.low <= value <= socket.high:
        unit = " degrees" if socket.subtype == "ANGLE" else ""
        low, high = (math.degrees(x) if unit else x for x in (socket.low, socket.high))
        raise GratingError(f"--set {text}", "", f"{name} is a number from {low:g} to {high:g}{unit}")
    return name, value

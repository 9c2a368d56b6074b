# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks the inputs of the Diffraction nodes, and the grating's period."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import bpy

from ..materials.group_users import listed
from ..materials.holograms.hologram_nodes import input_set_by_artist
from ..materials.material import diffraction_nodes
from ..materials.response import HEIGHT_SCALE, PERIOD_SCALE, ROUGHNESS
from ..materials.skin import SETTABLE
from .cause import Cause, mend
from .subject import Subject

# The period in a grating's summary (workflow/importing.py), in nanometres.
_PERIOD = re.compile(r"^period ([0-9.]+) nm\b", re.MULTILINE)
# A first order needs |u| = wavelength / period, and |u| is at most 2, so a finer period sends no violet (400 nm).
_FINEST_NM = 200.0
# Here the orders of 550 nm are 1.6 degrees apart. The next order of violet lies on the former order of red, so the
# colours mix to white.
_COARSEST_NM = 20e3


@dataclass(frozen=True)
class _Limit:
    """An input of a Diffraction node with the values that hide its colours: those up to `low` or from `high`."""

    name: str
    told: str
    low: float = -1.0
    high: float = float("inf")

    def hides(self, value: float) -> bool:
        """Whether a value of the input hides the colours."""
        return value <= self.low or value >= self.high


# Inputs with the values that hide nearly all colours: 1 % of the strength, a relief of a few nanometres.
_LIMITS = (
    _Limit("Strength", "makes the diffraction black", low=0.01),
    _Limit("Base Blend", "hides the diffraction", high=0.99),
    _Limit(HEIGHT_SCALE.name, "flattens the relief to a mirror", low=0.02),
    _Limit(ROUGHNESS.name, "blurs the colours to white", high=0.5),
)


def hiding_inputs(subject: Subject) -> Iterator[Cause]:
    """Inputs of the Diffraction nodes, or of their holograms, that hide the colours."""
    for limit in _LIMITS:
        found = [material for material in subject.materials if any(map(limit.hides, _values(subject, material, limit)))]
        if found:
            default = SETTABLE[limit.name].default
            value = next(value for value in _values(subject, found[0], limit) if limit.hides(value))
            told = f"{limit.name} is {value:.2g} in {listed(found)}, which {limit.told}."
            action = limit.name.upper().replace(" ", "_")
            yield Cause(action, told, mend(action, f"Set {limit.name} to {default:g}"))


def unsuited_period(subject: Subject) -> Iterator[Cause]:
    """A period so fine that no colour leaves the surface, or so coarse that its colours mix."""
    noted = _PERIOD.search(subject.grating.summary)
    scales = [socket.default_value for node in subject.nodes if (socket := set_number(node, PERIOD_SCALE.name))]
    if noted is None:
        return
    scale = scales[0] if scales else 1.0
    period = float(noted[1]) * scale
    if _FINEST_NM <= period <= _COARSEST_NM:
        return
    why = (
        "finer than half a wavelength of light, so the surface sends no colour"
        if period < _FINEST_NM
        else "so coarse that its rainbows overlap and mix to white"
    )
    scaled = f" with a Period Scale of {scale:.3g}" if scale != 1 else ""
    reset = mend("PERIOD_SCALE", "Set Period Scale to 1") if scale != 1 else None
    told = f"{period:.0f} nm" if period < 10e3 else f"{period / 1e3:.3g} um"
    yield Cause("PERIOD", f"The period of {subject.grating.name}{scaled} is {told}: {why}.", reset)


def set_number(node: bpy.types.Node, name: str) -> bpy.types.NodeSocket | None:
    """The socket that holds the number of a Diffraction node's input, which may be its hologram's; None if links or
    deleted sockets make it unknown."""
    if name not in node.inputs:
        return None
    socket = input_set_by_artist(node, name)
    return socket if not socket.is_linked and isinstance(socket.default_value, float) else None


def _values(subject: Subject, material: bpy.types.Material, limit: _Limit) -> list[float]:
    nodes = [node for node in diffraction_nodes(material) if node.node_tree == subject.group]
    return [socket.default_value for node in nodes if (socket := set_number(node, limit.name)) is not None]

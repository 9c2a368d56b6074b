# SPDX-License-Identifier: GPL-3.0-or-later
"""Choosing the channel of an instrument's file that holds the surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...base.failure import GratingError

# Names that instruments give to the topography. The first name that a file has wins.
_TOPOGRAPHY = ("z-axis", "topography", "height", "z height", "zsensor", "z-axissensor")


@dataclass(frozen=True)
class Channel:
    """One map of values in a file.

    name    the quantity: "Z-Axis"
    frame   the scan of the quantity, where there are several: "forward"; "" where there is one scan
    unit    of the values; "m" for heights over a plane
    """

    name: str
    frame: str
    unit: str

    @property
    def label(self) -> str:
        """Name and frame, as users see and give them: "Z-Axis forward"."""
        return f"{self.name} {self.frame}".strip()


def choose_channel(source: str, channels: Sequence[Channel], wanted: str | None) -> int:
    """Index of the channel whose label is, or begins with, `wanted`; of the topography where `wanted` is None.

    Upper and lower case are the same. `source` is the file's name for messages. Raises GratingError where there is no
    such channel or its values are not in metres.
    """
    listed = ", ".join(f"'{channel.label}'" for channel in channels) or "none"
    found = _topography(channels) if wanted is None else _labelled(channels, wanted)
    if found is None and wanted is None:
        raise GratingError(f"{source}: no channel is plainly the topography; name one by --channel: {listed}")
    if found is None:
        raise GratingError(f"{source}: has no channel '{wanted}'; name one of: {listed}")
    if channels[found].unit != "m":
        raise GratingError(
            f"{source}: channel '{channels[found].label}' is in '{channels[found].unit}', "
            f"not in metres; name a height channel with --channel, of: {listed}"
        )
    return found


def _labelled(channels: Sequence[Channel], wanted: str) -> int | None:
    labels = [channel.label.casefold() for channel in channels]
    wanted = wanted.casefold()
    exact = (i for i, label in enumerate(labels) if label == wanted)
    begun = (i for i, label in enumerate(labels) if label.startswith(wanted))
    return next(exact, next(begun, None))


def _topography(channels: Sequence[Channel]) -> int | None:
    metres = [(i, channel.name.casefold()) for i, channel in enumerate(channels) if channel.unit == "m"]
    exact = (i for known in _TOPOGRAPHY for i, name in metres if name == known)
    begun = (i for known in _TOPOGRAPHY for i, name in metres if name.startswith(known))
    only = metres[0][0] if len(metres) == 1 else None
    return next(exact, next(begun, only))

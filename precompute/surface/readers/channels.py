# SPDX-License-Identifier: GPL-3.0-or-later
"""Choice of the channel of an instrument file that holds the surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...base.failure import GratingError, Setting, Words

# Names of the topography, in order of preference.
_TOPOGRAPHY = ("z-axis", "topography", "height", "z height", "zsensor", "z-axissensor")
# Names that must match as a whole.
_WHOLE_NAMES = ("z",)
# Quantities that some instruments give in metres, but that are never chosen automatically.
_NO_TOPOGRAPHY = ("amplitude", "phase", "deflection", "error", "friction", "distance")
# The retrace of a line, chosen only if there is no trace.
_WAY_BACK = ("retrace", "backward")
# The words for the two scan directions, backward and forward.
_WAYS = tuple(zip(_WAY_BACK, ("trace", "forward"), strict=True))
# The most characters of a file's text that a message quotes, and the most channels that it lists or explains.
_QUOTED, _LISTED, _EXPLAINED = 80, 20, 5


def shortened(text: object) -> str:
    """Prepare text from a file for messages and labels: blanks for unprintable characters, at most _QUOTED in all."""
    printed = "".join(character if character.isprintable() else " " for character in str(text)[: _QUOTED + 1])
    return printed if len(printed) <= _QUOTED else f"{printed[: _QUOTED - 3]}..."


def unit_over(unit: str, across: str) -> str:
    """Return the unit of a channel whose sides are in `across`: "m" only over metres, "" if both are missing."""
    if across == "m":
        return unit
    return f"{unit or 'no unit'} over {across or 'no unit'}" if unit or across else ""


@dataclass(frozen=True)
class Channel:
    """One map of values in a file.

    name      the quantity: "Z-Axis"
    frame     the scan among several of the quantity: "forward"; else ""
    unit      unit of the values; "m" for heights
    is_image  whether the values cover a plane in metres; False for force curves"""

    name: str
    frame: str
    unit: str
    is_image: bool = True

    @property
    def label(self) -> str:
        """Name and frame as users see and type them: "Z-Axis forward"."""
        return shortened(f"{self.name} {self.frame}").strip()

    @property
    def is_surface(self) -> bool:
        """Whether the values are heights over a plane."""
        return self.is_image and self.unit == "m"


def choose_channel(source: str, channels: Sequence[Channel], wanted: str | None) -> int:
    """Return the index of the channel whose label is, or begins with, `wanted` in any case; None is the topography.

    `source` names the file in messages. Raises GratingError if there is no such channel, if its values are no heights
    over a plane, or if the file holds only curves."""
    if channels and not any(channel.is_image for channel in channels):
        raise GratingError(
            source, "holds curves, as of force spectroscopy, and no image", "export the topography scan of that place"
        )
    surfaces = [channel for channel in channels if channel.is_surface]
    if wanted is None:
        # A single channel that is no surface: its own fault is the best message.
        found = 0 if len(channels) == 1 and not surfaces else _topography(channels)
    else:
        found = _labelled(channels, wanted)
    if found is None and wanted is None and surfaces:
        remedy = ("name one by ", Setting.CHANNEL, f": {_list(surfaces)}")
        raise GratingError(source, "no channel is plainly the topography", remedy)
    if found is None and wanted is None:
        faults = ", ".join(f"'{channel.label}' {_fault_of(channel)}" for channel in channels[:_EXPLAINED])
        raise GratingError(source, f"no channel holds heights ({faults or 'there is none'})", _other_than(surfaces))
    if found is None:
        raise GratingError(source, f"has no channel '{shortened(wanted)}'", f"name one of: {_list(channels)}")
    chosen = channels[found]
    if not chosen.is_surface:
        raise GratingError(source, f"channel '{chosen.label}' {_fault_of(chosen)}", _other_than(surfaces))
    return found


def other_way(label: str, labels: Sequence[str]) -> str | None:
    """Find the label of the same quantity's opposite scan direction: "Height retrace" for "Height trace", "Z-Axis
    forward" for "Z-Axis backward". None if there is none. Gwyddion files join the words: "HeightTrace"."""
    for words in _WAYS:
        # "retrace" ends with "trace".
        old, new = words if words[0] in label.casefold() else words[::-1]
        head, found, tail = label.casefold().rpartition(old)
        if found:
            return next((each for each in labels if each.casefold() == head + new + tail), None)
    return None


def _fault_of(channel: Channel) -> str:
    """Explain why a channel's values are no heights."""
    if not channel.is_image:
        return "holds curves and no image"
    if not channel.unit:
        return "carries no unit of height"
    return f"is in '{shortened(channel.unit)}', not in metres"


def _other_than(surfaces: Sequence[Channel]) -> Words:
    """Return the remedy if the requested channel is no surface."""
    if surfaces:
        return "name a height channel with ", Setting.CHANNEL, f", of: {_list(surfaces)}"
    return (
        "export the height channel, or give it its units in Gwyddion (Data Process, Basic Operations, Dimensions and "
        "Units) and save it as .gwy"
    )


def _list(channels: Sequence[Channel]) -> str:
    """List the channels' labels for a message."""
    named = ", ".join(f"'{channel.label}'" for channel in channels[:_LISTED])
    more = f" and {len(channels) - _LISTED} more" if len(channels) > _LISTED else ""
    return f"{named}{more}" or "none"


def _labelled(channels: Sequence[Channel], wanted: str) -> int | None:
    labels = [channel.label.casefold() for channel in channels]
    wanted = wanted.casefold()
    exact = (i for i, label in enumerate(labels) if label == wanted)
    begun = (i for i, label in enumerate(labels) if label.startswith(wanted))
    return next(exact, next(begun, None))


def _topography(channels: Sequence[Channel]) -> int | None:
    """Find the clear topography channel: trace before retrace, then by name."""
    surfaces = [(i, channel.name.casefold()) for i, channel in enumerate(channels) if _may_be_topography(channel)]
    forth = [(i, name) for i, name in surfaces if not channels[i].frame.casefold().startswith(_WAY_BACK)]
    for found in (forth, surfaces):
        exact = (i for known in (*_TOPOGRAPHY, *_WHOLE_NAMES) for i, name in found if name == known)
        begun = (i for known in _TOPOGRAPHY for i, name in found if name.startswith(known))
        if (first := next(exact, next(begun, None))) is not None:
            return first
    return surfaces[0][0] if len(surfaces) == 1 else None


def _may_be_topography(channel: Channel) -> bool:
    return channel.is_surface and not any(word in channel.name.casefold() for word in _NO_TOPOGRAPHY)

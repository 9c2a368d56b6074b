# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of microscopes' HDF5 files: Nanosurf .nhf and JPK .h5-jpk.

Nanosurf's file is of the software Studio, in its versions 1 and 2. A group is a measurement, a group in it a segment
("Forward" or "Backward"), and a dataset in a segment a channel. Points are stored line by line from the scan's bottom
up. A channel's calibration gives the values of the lowest and highest integer of its type. Version 2 reserves one
integer for missing points. (Format: Nanosurf's open-source reader in the package nanosurf-utils.)

JPK's file holds high-speed scans, many frames of one place. Each group "Measurement_N" describes the grid, each group
"Channel_N" in it a quantity and a direction. A channel's dataset has a column for each frame: the grid's points, line
by line from the scan's bottom up, unless the grid is reflected. The attributes "net-encoder.scaling" scale the integers
to the default calibration."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import BinaryIO

import numpy as np

from .hdf5_file import SIGNATURE, Dataset, Hdf5File, Node, Value, number_in
from .scan_file import Channel, ScanReader, StoredMap, in_base_units

_VERSION = "nsf_file_version_major"
# Attribute names by version: of a measurement, a segment and a channel, and the calibration's prefix.
_NAMES = {
    1: ("name", "name", "name", "base_calibration"),
    2: ("measurement_name", "segment_name", "signal_name", "signal_calibration"),
}
_NO_IMAGES = ("spectroscopy", "spectroscopy_grid", "calibration")
_IN_BRACKETS = re.compile(r"\(([^)]+)\)")


@dataclass(frozen=True)
class _Scale:
    """The conversion (integer - lowest) * factor + offset; integers outside [lowest, highest] are missing points."""

    lowest: float
    highest: float
    factor: float
    offset: float


def _nanosurf_maps(root: Node) -> list[StoredMap]:
    """List all channels of all segments. Raises ValueError for another version."""
    version = int(number_in(root.attributes[_VERSION]))
    if version not in _NAMES:
        raise ValueError(f"a .nhf of version {version}")
    measured = [node for node in root.members.values() if _NAMES[version][0] in node.attributes]
    return [
        each
        for number, node in enumerate(measured, 1)
        for each in _nanosurf_channels(node, version, number, len(measured) > 1)
    ]


def _nanosurf_channels(measurement: Node, version: int, number: int, is_one_of_many: bool) -> Iterator[StoredMap]:
    _, segment_name, channel_name, _ = _NAMES[version]
    kind = str(measurement.attributes.get("group_type" if version == 2 else "measurement_type", ""))
    for segment in measurement.members.values():
        if segment.dataset is not None or segment_name not in segment.attributes:
            continue
        facts = measurement.attributes | segment.attributes
        frame = str(segment.attributes[segment_name]).lower() + (f" of {number}" if is_one_of_many else "")
        for node in segment.members.values():
            if (dataset := node.dataset) is not None and channel_name in node.attributes:
                yield _map(facts, dataset, node.attributes, (version, frame, kind not in _NO_IMAGES))


def _map(
    facts: dict[str, Value], dataset: Dataset, channel: dict[str, Value], known: tuple[int, str, bool]
) -> StoredMap:
    version, frame, may_be_image = known
    shape, sides = _grid(facts)
    # A map's dataset holds one value per point; others hold a curve per point.
    is_image = may_be_image and min(shape) > 0 and dataset.shape in (shape, (shape[0] * shape[1],))
    scale, unit = _scale(dataset, channel, version)
    size, base = in_base_units(unit)
    # Version 1 cannot mark missing points.
    acquired = int(number_in(facts.get("image_number_of_lines_acquired", shape[0]))) if version == 1 else shape[0]
    rows, cols = shape if is_image else (1, 1)
    return StoredMap(
        Channel(str(channel[_NAMES[version][2]]), frame, base, is_image),
        (rows, cols),
        (sides[0] / rows, sides[1] / cols),
        partial(_nanosurf_values, dataset, (rows, cols), scale, size)
        if acquired >= rows
        else partial(_broken_off, acquired, rows),
    )


def _grid(facts: dict[str, Value]) -> tuple[tuple[int, int], tuple[float, float]]:
    """Return (rows, cols) and (Ly, Lx), with zeros for missing facts."""
    # Both may be stored with the measurement or the segment, in either spelling.
    rows, cols = _two(facts, "rect_axis_size", ("image_number_of_lines", "image_points_per_line"))
    return (int(rows), int(cols)), _two(facts, "rect_axis_range", ("image_size_y", "image_size_x"))


def _two(facts: dict[str, Value], together: str, apart: tuple[str, str]) -> tuple[float, float]:
    """Read two numbers, from one attribute or else from two; 0 for a missing number."""
    found = facts.get(together) or [number_in(facts.get(name, 0)) for name in apart]
    if not isinstance(found, list):
        raise ValueError(f"{together} is not two numbers")
    first, second = map(float, found)
    return first, second


def _scale(dataset: Dataset, channel: dict[str, Value], version: int) -> tuple[_Scale, str]:
    """Return the calibration of a channel's integers, and its unit; floats run from 0 to 1."""
    prefix = _NAMES[version][3]
    if dataset.kind.kind == "f":
        lowest, highest = 0.0, 1.0
    else:
        limits = np.iinfo(dataset.kind)
        # Version 2 marks missing points by the lowest signed or the highest unsigned integer.
        lowest = float(limits.min) + (version == 2 and limits.min < 0)
        highest = float(limits.max) - (version == 2 and limits.min == 0)
    if channel.get("signal_selected", channel.get("signal_id")) != channel.get("signal_id"):
        return _Scale(lowest, highest, 1.0, 0.0), f"the calibration '{channel['signal_selected']}'"
    low, high = number_in(channel.get(f"{prefix}_min", 0.0)), number_in(channel.get(f"{prefix}_max", 1.0))
    unit = str(channel.get(f"{prefix}_unit", ""))
    named = _IN_BRACKETS.search(unit)
    return _Scale(lowest, highest, (high - low) / (highest - lowest), low), named[1] if named else unit


def _nanosurf_values(
    dataset: Dataset, shape: tuple[int, int], scale: _Scale, size: float, file: BinaryIO
) -> np.ndarray:
    stored = dataset.read(file).reshape(shape)[::-1]
    values = stored.astype(np.float64)
    if dataset.kind.kind != "f":
        values[(values < scale.lowest) | (values > scale.highest)] = np.nan
    values -= scale.lowest
    values *= scale.factor * size
    values += scale.offset * size
    return values


def _broken_off(acquired: int, rows: int, file: BinaryIO) -> np.ndarray:
    raise ValueError(f"{acquired} of {rows} lines were scanned")


_FORMAT = ("file-format-info", "JPK SCAN")
_GRID, _SCALING = "position-pattern.grid", "net-encoder.scaling"
_THUMBNAIL = "thumbnail"
_MAPS_MAX = 1 << 16


def _jpk_maps(root: Node) -> list[StoredMap]:
    """List the frames of all channels, the first frame of each channel before the second."""
    measured = [node for name, node in root.members.items() if name.startswith("Measurement_")]
    channels = [
        (measurement, channel)
        for measurement in measured
        for name, channel in measurement.members.items()
        if name.startswith("Channel_")
    ]
    maps: list[tuple[int, StoredMap]] = []
    for measurement, channel in channels:
        for number, each in enumerate(_frames(measurement.attributes, channel)):
            maps.append((number, each))
            if len(maps) > _MAPS_MAX:
                raise ValueError(f"more than {_MAPS_MAX} frames")
    return [each for _, each in sorted(maps, key=lambda pair: pair[0])]


def _frames(grid: dict[str, Value], channel: Node) -> Iterator[StoredMap]:
    facts = channel.attributes
    datasets = [node.dataset for name, node in channel.members.items() if name != _THUMBNAIL]
    name = str(facts.get("channel.fancy-name") or facts["channel.name"])
    direction = "retrace" if str(facts["retrace"]).lower() == "true" else "trace"
    size, base = in_base_units(str(facts[f"{_SCALING}.unit.unit"]))
    shape = int(number_in(grid[f"{_GRID}.jlength"])), int(number_in(grid[f"{_GRID}.ilength"]))
    length, _ = in_base_units(str(grid[f"{_GRID}.unit.unit"]))
    sides = number_in(grid[f"{_GRID}.vlength"]) * length, number_in(grid[f"{_GRID}.ulength"]) * length
    factor, offset = (number_in(facts[f"{_SCALING}.{each}"]) * size for each in ("multiplier", "offset"))
    reflected = str(grid[f"{_GRID}.reflect"]).lower() == "true"
    for dataset in datasets:
        if dataset is None or len(dataset.shape) != 2 or min(shape) < 1 or dataset.shape[0] != shape[0] * shape[1]:
            raise ValueError(f"{shape[0]} x {shape[1]} points, and a dataset of {dataset and dataset.shape}")
        for frame in range(dataset.shape[1]):
            yield StoredMap(
                Channel(name, direction if dataset.shape[1] == 1 else f"{direction} {frame + 1}", base),
                shape,
                (sides[0] / shape[0], sides[1] / shape[1]),
                partial(_values, dataset, shape, frame, (factor, offset), reflected),
            )


def _values(
    dataset: Dataset,
    shape: tuple[int, int],
    frame: int,
    scaling: tuple[float, float],
    reflected: bool,
    file: BinaryIO,
) -> np.ndarray:
    values = dataset.read(file, frame).reshape(shape) * np.float64(scaling[0])
    values += scaling[1]
    return values if reflected else values[::-1]


def _maps(file: BinaryIO) -> list[StoredMap]:
    root = Hdf5File(file).root
    key, value = _FORMAT
    if root.attributes.get(key) == value:
        return _jpk_maps(root)
    if _VERSION in root.attributes:
        return _nanosurf_maps(root)
    raise ValueError("neither a Nanosurf nor a JPK file")


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(SIGNATURE)


HDF5 = ScanReader("Nanosurf or JPK HDF5", (".nhf", ".h5-jpk"), _begins, _maps)

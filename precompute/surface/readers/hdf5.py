# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of microscopes' HDF5 files: Nanosurf .nhf (nanosurf_hdf5.py) and JPK .h5-jpk.

JPK's file holds high-speed scans, many frames of one place. Each group "Measurement_N" describes the grid, each group
"Channel_N" in it a quantity and a direction. A channel's dataset has a column for each frame: the grid's points, line
by line from the scan's bottom up, unless the grid is reflected. The attributes "net-encoder.scaling" scale the integers
to the default calibration."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import BinaryIO

import numpy as np

from . import nanosurf_hdf5
from .hdf5_file import SIGNATURE, Dataset, Hdf5File, Node, Value, number_in
from .scan_file import Channel, ScanReader, StoredMap, in_base_units

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
    if nanosurf_hdf5.VERSION in root.attributes:
        return nanosurf_hdf5.nanosurf_maps(root)
    raise ValueError("neither a Nanosurf nor a JPK file")


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(SIGNATURE)


HDF5 = ScanReader("Nanosurf or JPK HDF5", (".nhf", ".h5-jpk"), _begins, _maps)

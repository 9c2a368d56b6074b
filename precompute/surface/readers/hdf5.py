# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of microscopes' HDF5 files, .nhf and .h5-jpk, which differ in the attributes of the root."""

from __future__ import annotations

from typing import BinaryIO

from . import jpk_hdf5, nanosurf_hdf5
from .hdf5_file import SIGNATURE, Hdf5File
from .scan_file import ScanReader, StoredMap


def _maps(file: BinaryIO) -> list[StoredMap]:
    root = Hdf5File(file).root
    key, value = jpk_hdf5.FORMAT
    if root.attributes.get(key) == value:
        return jpk_hdf5.jpk_maps(root)
    if nanosurf_hdf5.VERSION in root.attributes:
        return nanosurf_hdf5.nanosurf_maps(root)
    raise ValueError("neither of Nanosurf nor of JPK")


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(SIGNATURE)


HDF5 = ScanReader("Nanosurf or JPK HDF5", (".nhf", ".h5-jpk"), _begins, _maps)

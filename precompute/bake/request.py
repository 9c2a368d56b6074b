# SPDX-License-Identifier: GPL-3.0-or-later
"""The request for a bake: everything that its result depends on.

A request comes from the command line or from Blender's panel. It is stored in the header of the bake's file, from which
`bake --request` repeats the bake, and it is part of the cache's key.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from ..base.failure import GratingError
from ..base.files import can_be_a_path
from ..base.strict import number_in
from ..colour.illuminants import canonical as canonical_illuminant
from ..reflectance.matter import DIELECTRIC, Matter, parse
from ..surface.generated.parameters import canonical
from ..surface.height_map import HeightMap, is_synthetic
from ..surface.readers.reader_registry import read_height_map
from ..surface.steps.pipeline import DEFAULT, steps_of
from ..surface.steps.step import Step
from .needs import EVERYTHING, Needs, needs_of

T = TypeVar("T")
# The names of the models of coherence (make.py).
MODELS = ("ensemble", "patch")
# The limits of a request's numbers. CIEDE2000 of black and white is 100. An error of 1e-3 needs spectra to 2e-7 of
# their light, the limit of single precision. No coherence length is much shorter than the light's wavelength, and no
# scan is as long as 10 mm. Sizes are those of the readers of pictures and of numbers, which may be metres.
DELTA_E = (1e-3, 100.0)
COHERENCE_UM = (0.1, 1e4)
PATCH_UM = (0.0, 1e6)
SPREAD_DEG = (0.1, 45.0)
SIZE_UM = (1e-3, 1e6)
HEIGHT_NM = (1e-3, 1e9)
# The keys that a request has only if they are set, so that a bake from before them keeps its key in the cache.
_LATER_KEYS = ("patch_um", "spread_deg")
# More scans than anyone has made of one skin.
_SCANS_MAX = 1000


@dataclass(frozen=True)
class Scan:
    """A scan, named by its file, by sample:NAME or by grating:KIND?PARAMETERS.

    size_um    width in micrometres, for a picture, which does not hold its width
    height_nm  height of white over black in nanometres, for a picture, or of the number 1, for bare numbers
    channel    the channel of the file, if it is not the topography"""

    source: str
    size_um: float | None = None
    height_nm: float | None = None
    channel: str | None = None

    def read(self) -> HeightMap:
        """Read the scan's height map. Raises GratingError as read_height_map does."""
        return read_height_map(self.source, self.size_um, self.height_nm, channel=self.channel)


@dataclass(frozen=True)
class BakeRequest:
    """The request for a bake.

    delta_e             the 99th percentile of CIEDE2000 that the bake must keep
    coherence_length_m  4 sigma_s in metres, where sigma_s is the standard deviation of the coherence window. None: the
                        longest length that the scans can average, or the thesis's under the patch model
    illuminant          the light on the surface, by its canonical text (precompute/colour/illuminants.py)
    matter              what the surface is made of
    needs               what the scene reaches
    model               the model of coherence, one of MODELS
    patch_um            the centre of the patch model's window: (x, y) in micrometres, to the right and upwards from the
                        scan's lower left corner. None: the scan's middle
    spread_deg          the standard deviation, in degrees, of the directions in which the skin lies; None: one way
    levelling           the steps that level and repair each scan, in order
    scans               scans of one skin; their spectra are averaged

    >>> BakeRequest(delta_e=2, coherence_length_m=4e-6).as_dict()["coherence_um"]
    4.0"""

    delta_e: float = 1.0
    coherence_length_m: float | None = None
    illuminant: str = "D65"
    matter: Matter = Matter(DIELECTRIC)
    needs: Needs = EVERYTHING
    model: str = "ensemble"
    levelling: tuple[Step, ...] = DEFAULT
    scans: tuple[Scan, ...] = ()
    patch_um: tuple[float, float] | None = None
    spread_deg: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Convert the request to JSON, with every key but those of _LATER_KEYS at their defaults.

        The scans' folders are left out, because a bake moves from machine to machine. Gratings by their parameters have
        their canonical texts."""
        scans = [{**asdict(scan), "source": _without_folder(scan.source)} for scan in self.scans]
        place = None if self.patch_um is None else list(self.patch_um)
        later = zip(_LATER_KEYS, (place, self.spread_deg), strict=True)
        return {key: value for key, value in later if value is not None} | {
            "scans": scans,
            "levelling": [step.text for step in self.levelling],
            "model": self.model,
            "delta_e": self.delta_e,
            "coherence_um": None if self.coherence_length_m is None else self.coherence_length_m * 1e6,
            "illuminant": self.illuminant,
            "matter": str(self.matter),
            "needs": self.needs.as_dict(),
        }

    def at(self, folder: Path) -> "BakeRequest":
        """The request with its scans in `folder`. Synthetic surfaces and absolute paths stay as they are."""
        return replace(self, scans=tuple(replace(scan, source=_within(folder, scan.source)) for scan in self.scans))


def request_from(record: object, source: str) -> BakeRequest:
    """Convert a JSON record to a request. Missing keys have their defaults.

    Raises GratingError, with `source` and the key, for a value that no bake can have."""
    known = {*BakeRequest().as_dict(), *_LATER_KEYS}
    if not isinstance(record, Mapping):
        raise GratingError(
            source, "has no request for a bake", "give the .exr that `bake` wrote, or the JSON of a request"
        )
    for key in record:
        if key not in known:
            raise GratingError(source, f"{key:.40}: no such key of a request", f"there are {', '.join(sorted(known))}")
    length_um = _number_or_none(source, record, "coherence_um", COHERENCE_UM)
    levelling = None if "levelling" not in record else _list(source, "levelling", record["levelling"])
    return BakeRequest(
        delta_e=number_in(source, "delta_e", record.get("delta_e", 1.0), limits=DELTA_E),
        coherence_length_m=None if length_um is None else length_um * 1e-6,
        illuminant=_named(source, record, "illuminant", default="D65", read=canonical_illuminant),
        matter=_named(source, record, "matter", default=DIELECTRIC, read=parse),
        needs=needs_of(record["needs"], source) if "needs" in record else EVERYTHING,
        model=_one_of(source, "model", record.get("model", "ensemble"), MODELS),
        levelling=DEFAULT if levelling is None else steps_of(levelling, f"{source}: levelling"),
        scans=_scans(source, _list(source, "scans", record.get("scans", []))),
        patch_um=None if record.get("patch_um") is None else _place(source, record["patch_um"]),
        spread_deg=_number_or_none(source, record, "spread_deg", SPREAD_DEG),
    )


def _scans(source: str, records: list[Any]) -> tuple[Scan, ...]:
    if len(records) > _SCANS_MAX:
        raise GratingError(source, f"scans: {len(records)} of them", f"give at most {_SCANS_MAX}")
    return tuple(_scan(source, each) for each in records)


def _scan(source: str, record: Any) -> Scan:
    if not isinstance(record, Mapping) or not isinstance(record.get("source"), str):
        raise GratingError(source, f"scans: cannot be {record!r:.30}", "give each scan as an object with its `source`")
    channel = record.get("channel")
    if channel is not None and not isinstance(channel, str):
        raise GratingError(source, f"scans: channel: cannot be {channel!r:.30}", "give a name")
    if not can_be_a_path(record["source"]):
        raise GratingError(source, "scans: source: not a file name", "give the name of the scan's file")
    size_um = _number_or_none(source, record, "size_um", SIZE_UM, within="scans: ")
    height_nm = _number_or_none(source, record, "height_nm", HEIGHT_NM, within="scans: ")
    return Scan(record["source"], size_um, height_nm, channel)


def _number_or_none(
    source: str, record: Mapping[str, Any], key: str, limits: tuple[float, float], *, within: str = ""
) -> float | None:
    """The number under a key, or None if it is missing or null. `within`: what errors say before the key."""
    value = record.get(key)
    return None if value is None else number_in(source, f"{within}{key}", value, limits=limits)


def _list(source: str, key: str, value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise GratingError(source, f"{key}: cannot be {value!r:.30}", "give a list")
    return value


def _place(source: str, value: Any) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise GratingError(source, f"patch_um: cannot be {value!r:.30}", "give a list of two numbers, x and y")
    x, y = (number_in(source, "patch_um", one, limits=PATCH_UM) for one in value)
    return x, y


def _named(source: str, record: Mapping[str, Any], key: str, *, default: str, read: Callable[[str], T]) -> T:
    """What the text under a key names, by `read`."""
    value = record.get(key, default)
    if not isinstance(value, str):
        raise GratingError(source, f"{key}: cannot be {value!r:.30}", f"give a text, such as {default}")
    try:
        return read(value)
    except GratingError as error:
        raise error.within(f"{source}: {key}") from error


def _one_of(source: str, key: str, value: Any, known: tuple[str, ...]) -> str:
    if value not in known:
        raise GratingError(source, f"{key}: cannot be {value!r:.30}", f"give one of {', '.join(known)}")
    return value


def _without_folder(source: str) -> str:
    return canonical(source) if is_synthetic(source) else Path(source).name


def _within(folder: Path, source: str) -> str:
    return source if is_synthetic(source) else str(folder / source)

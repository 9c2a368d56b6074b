# SPDX-License-Identifier: GPL-3.0-or-later
"""What the benchmark finds, as the modules here pass it on; `as_dict` is the JSON of the verb."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

from precompute.measure.errors import Errors


@dataclass(frozen=True)
class Machine:
    """What the benchmark ran on; it names no host. `load` is the load average at the start, as text."""

    processor: str
    cores: int
    system: str
    python: str
    numpy: str
    load: str


@dataclass(frozen=True)
class ScanResult:
    """The bake of a scan beside Fourier transforms of its size.

    pixels                 rows and columns of the scan
    transform_seconds      of one complex transform of that size
    bake_to_24_transforms  time of the bake over that of 24 such transforms
    naive_seconds          for one exact transform for every wavelength and tile, `naive_transforms` of them;
                           `naive_timed` were timed and scaled up
    naive_to_bake          naive_seconds over bake_seconds
    peak_bytes             of the process that baked
    table_bytes            of the table in Blender
    tile                   rows and columns of a tile
    delta_e                the bake's own error metrics
    """

    pixels: list[int]
    transform_seconds: float
    bake_seconds: float
    check_seconds: float
    bake_to_24_transforms: float
    naive_seconds: float
    naive_transforms: int
    naive_timed: int
    naive_to_bake: float
    peak_bytes: int | None
    table_bytes: int
    tiles: int
    tile: list[int]
    wavelengths: int
    coherence_um: float
    delta_e: Errors


@dataclass(frozen=True)
class MapResult:
    """A BRDF map of `pixels` x `pixels` by the bake and by FLSS: seconds, and the error metrics of both."""

    pixels: int
    bake_seconds: float
    flss_seconds: float
    flss_preparation_seconds: float
    flss_to_bake: float
    reference_step_nm: float
    bake: Errors
    flss: Errors


@dataclass(frozen=True)
class Row:
    """A candidate on a surface.

    seconds_per_million  of evaluating a million directions
    preparation_seconds  of building the method
    peak_bytes           held at the peak of building and judging
    table_bytes          read for each direction
    peak_angle_deg       between the brightest views of the method and of its reference
    mean and the rest    error metrics as in measure.errors.Errors
    """

    surface: str
    method: str
    label: str
    model: str
    seconds_per_million: float
    preparation_seconds: float
    peak_bytes: int
    table_bytes: int
    peak_angle_deg: float
    mean: float
    p95: float
    p99: float
    max: float
    relative_rms: float
    relative_dy: float

    @property
    def title(self) -> str:
        """The method and what is particular about the candidate."""
        return f"{self.method} {self.label}".strip()

    def beats(self, other: "Row") -> bool:
        """Whether this row is cheaper than another, and no worse."""
        return self.seconds_per_million < other.seconds_per_million and self.p99 <= other.p99


@dataclass(frozen=True)
class Refusal:
    """A candidate that cannot be built for a surface, and why."""

    surface: str
    method: str
    label: str
    reason: str

    @property
    def title(self) -> str:
        """The method and what is particular about the candidate."""
        return f"{self.method} {self.label}".strip()


@dataclass(frozen=True)
class SizeResult:
    """The bake of a synthetic scan of `pixels` x `pixels`: bytes of the heights, seconds of the bake and of its check,
    bytes held beyond the heights at the peak (None where the system does not tell), and the error."""

    pixels: int
    input_bytes: int
    seconds: float
    check_seconds: float
    beyond_input_bytes: int | None
    delta_e_p99: float


@dataclass(frozen=True)
class BenchmarkResult:
    """A run of the benchmark.

    quick         whether it was a trial of small pieces
    surface       name of the scan that was baked
    xenopeltis    name of the scan of Xenopeltis, or of the sample in its place
    front         by surface, the titles of the rows on the Pareto front of seconds and p99, cheapest first
    pairs         by model of coherence, the direction pairs that a surface is judged on
    piece_um      side of the piece that methods of the ensemble model see
    """

    machine: Machine
    quick: bool
    surface: str
    xenopeltis: str
    scan: ScanResult
    map: MapResult
    rows: Sequence[Row]
    refused: Sequence[Refusal]
    front: dict[str, list[str]]
    sizes: Sequence[SizeResult]
    pairs: dict[str, int]
    piece_um: float
    coherence_um: float
    seconds: float

    def as_dict(self) -> dict:
        """Ready for JSON."""
        return asdict(self)

    def rows_of(self, surface: str) -> list[Row]:
        """A surface's rows, cheapest first."""
        return sorted((row for row in self.rows if row.surface == surface), key=lambda row: row.seconds_per_million)

    def cheapest(self, surface: str, methods: Sequence[str], p99: float) -> Row | None:
        """The cheapest row of some methods whose 99th percentile of dE00 is at most p99, if there is one."""
        kept = [row for row in self.rows_of(surface) if row.method in methods and row.p99 <= p99]
        return kept[0] if kept else None

    def bakes_by_budget(self, surface: str) -> list[Row]:
        """The bakes that were asked for by a dE00 alone, the coarsest first."""
        rows = [row for row in self.rows_of(surface) if row.method == "bake" and "," not in row.label]
        return sorted(rows, key=lambda row: -float(row.label.removeprefix("dE ")))

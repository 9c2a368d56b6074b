# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/speed_against_error.md from the result of a run. Every number on the page is filled in from the result, so that
another run keeps the page true."""

import textwrap
from functools import partial

from precompute.methods.baked import ENTRY
from precompute.methods.method_registry import ENTRIES

from ..study.traits import TRAITS
from .pictures import ERROR_PICTURE, TIME_PICTURE
from .result import BenchmarkResult
from .tables import JUST_VISIBLE, NAMES, markdown, mebibytes, n2_log_n, number, table

BAKE = ENTRY.name

_WRAPPED = partial(textwrap.fill, width=120, break_on_hyphens=False, break_long_words=False)


def text(result: BenchmarkResult) -> str:
    """The page in Markdown."""
    parts = [_introduction(result), _setting(result), _method(result), _of_the_scan(result), _of_the_map(result)]
    parts += [_errors(result), _sizes(result), _choice(result), _limits(result)]
    return "\n\n".join(_reflowed(part.strip()) for part in parts) + "\n"


def _reflowed(text: str) -> str:
    """Wrap paragraphs and lists again: the numbers that were filled in leave ragged lines."""
    blocks = []
    for block in text.split("\n\n"):
        if block.startswith("- "):
            items = (" ".join(item.split()) for item in block.removeprefix("- ").split("\n- "))
            block = "\n".join(_WRAPPED(f"- {item}", subsequent_indent="  ") for item in items)
        elif not block.startswith(("|", "#", "!", "    ")):
            block = _WRAPPED(" ".join(block.split()))
        blocks.append(block)
    return "\n\n".join(blocks)


def _introduction(result: BenchmarkResult) -> str:
    command = "./dev grating benchmark" + (" --quick" if result.quick else "") + " --output docs"
    warning = "\n\n*A quick run: small pieces, few directions. Its ratios are no result.*" if result.quick else ""
    return f"""# Speed against error

How much time does each way to shade a diffraction grating take, and how far are its colours from the exact ones? One
command measures every method of the core on the same surfaces and writes this page, its numbers and its pictures:

    {command}

All figures are of one run of {number(result.seconds / 60, 2)} minutes. Read the ratios: seconds belong to the
machine, ratios mostly to the methods.{warning}"""


def _setting(result: BenchmarkResult) -> str:
    machine = result.machine
    return f"""## Setting

**Machine.** {machine.processor}, {machine.cores} cores, {machine.system}, Python {machine.python}, NumPy
{machine.numpy}; no GPU. Everything is NumPy, so that a ratio compares algorithms and not compilers. Load average
when the run began: {machine.load}; times are the fastest of some repeats wherever a repeat is affordable.

**Surfaces.** The blaze of the thesis (`sample:blazed`, 2.5 um, 246 nm); Elaphe ({result.surface});
and Xenopeltis ({result.xenopeltis}), turned so that the period along its fingers lies along T.

**Coherence.** {result.coherence_um:g} um at 550 nm, for all: the length that a bake holds at every error from 3 to
0.1. Methods of the ensemble model see a piece of {result.piece_um:g} um a side, those of the patch model one as long
as its coherence, as in the thesis. The two models differ by speckle that no method is to blame for, so each method is
judged against the exact reference of its own (docs/data_flow.md)."""


def _method(result: BenchmarkResult) -> str:
    pairs = result.pairs
    return f"""## Method

**Error** is the project's one metric (precompute/measure): direction pairs in groups of equal w, half cosine
weighted, half drawn from the reference's own spectrum; radiance with Fresnel and obliquity; CIEDE2000 at four
exposures, of which the worst counts. {pairs["ensemble"]:,} pairs a surface in the ensemble model and
{pairs["patch"]:,} in the patch model, whose direct sums are slow. Pairs within 8 sigma of the zero order are left out
for every method alike: patch methods have the zero order inside their density, and the bake carries it apart.

**References.** Exact phasor, float64, 1 nm. The ensemble's spectra are interpolated in s to 1e-10, which turns
401 transforms for each w into some thirty for all (a test holds it against the direct sums). The patch's are direct.

**Cost** is seconds per million directions, each of its own w as in a picture, preparation apart; R and O, the same for
all, are left out. *Peak* is the most that preparing and judging had allocated; *table* what is read per direction: a
bake as Blender holds it (RGBA, 32 bits), the images of an expansion's terms, or nothing but the heights.

**Angle** is that between the brightest views of the method and of its reference over the first order, light at 75
degrees."""


def _of_the_scan(result: BenchmarkResult) -> str:
    scan = result.scan
    rows, cols = scan.pixels
    tile_rows, tile_cols = scan.tile
    checked = ", ".join(number(value, 2) for value in (scan.delta_e.mean, scan.delta_e.p95, scan.delta_e.p99))
    figures = markdown(
        ["", "measured", "limit"],
        [
            [
                "bake, in 24 complex transforms of its size (`np.fft.fft2`, double precision)",
                f"{number(scan.bake_to_24_transforms)} x", "6 x, aim 3 x",
            ],
            ["self-check, as a share of the bake", number(scan.check_seconds / scan.bake_seconds, 2), "1"],
            ["faster than one exact transform a wavelength and tile", f"{number(scan.naive_to_bake)} x", "10 x"],
            ["peak memory of the process", f"{mebibytes(scan.peak_bytes)} MiB", "1024 MiB"],
            ["table in Blender", f"{mebibytes(scan.table_bytes)} MiB", "128 MiB"],
            ["dE00 by its own check: mean, p95, p99", checked, "p99 of 1"],
        ],
    )  # fmt: skip
    return f"""## A bake, counted in Fourier transforms

{result.surface}, {rows} x {cols} pixels, `bake --delta-e 1` in a process of its own: {scan.tiles} tiles of
{tile_cols} x {tile_rows} at {scan.coherence_um:.1f} um of coherence.

{figures}

One transform took {number(scan.transform_seconds * 1e3)} ms, the bake {number(scan.bake_seconds)} s, the check
{number(scan.check_seconds)} s. The naive bake, {scan.naive_transforms} exact transforms resampled to the same
texels ({scan.wavelengths} wavelengths, {scan.tiles} nodes in w), would take {number(scan.naive_seconds)} s:
{scan.naive_timed} of them were timed, evenly over the wavelengths, and scaled up. The bake needs no more transforms
than the relief has Chebyshev nodes in s, whatever the wavelengths; what remains of its time is mostly the resampling,
two banded matrix products for every wavelength and tile. Those run on all cores and the transform on one, so that
whatever else the machine does weighs on the first ratio more than on the others."""


def _of_the_map(result: BenchmarkResult) -> str:
    one = result.map
    by_method = (("bake", one.bake_seconds, one.bake), ("FLSS", one.flss_seconds, one.flss))
    lines = markdown(
        ["", "seconds", "dE00 mean", "p95", "p99", "relative RMS"],
        [
            [label, number(seconds), *(number(value, 2) for value in (it.mean, it.p95, it.p99, it.relative_rms))]
            for label, seconds, it in by_method
        ],
    )
    return f"""## A BRDF map, beside FLSS

{one.pixels} x {one.pixels} pixels, light at 30 degrees, same surface, Stam's form. FLSS as the thesis: 37
terms, 81 wavelengths, 3 x 3 texels.

{lines}

The bake's map takes **{number(one.flss_to_bake)} x** fewer seconds (asked: 500 x), preparation apart: the bake's is
above, FLSS's images take {number(one.flss_preparation_seconds, 2)} s. Colours are of
{one.bake.pairs} and {one.flss.pairs} pairs, references at {one.reference_step_nm:g} nm, each of its own
model: the bake at {result.scan.coherence_um:.1f} um, FLSS at the thesis's 65. FLSS's error is what 3 x 3 texels
leave out of the window."""


def _errors(result: BenchmarkResult) -> str:
    parts = [f"## Error against cost\n\n![Error against cost](images/{ERROR_PICTURE})"]
    lines = []
    for surface in result.front:
        bakes = result.bakes_by_budget(surface)
        reached = ", ".join(f"{row.label}: {number(row.p99, 2)}" for row in bakes)
        lines.append(f"- **{NAMES[surface]}.** Asked and reached (p99): {reached}. {_rivals(result, surface)}")
    parts.append(
        "The grey line is the Pareto front: nothing is both faster and nearer. The dotted line is a dE00 of 1.\n"
        "In the tables below the front is bold.\n\n" + "\n".join(lines)
    )
    for surface in result.front:
        parts.append(f"### {NAMES[surface]}\n\n{table(result, surface)}")
        refused = [one for one in result.refused if one.surface == surface]
        if refused:
            names = ", ".join(dict.fromkeys(one.title for one in refused))
            parts.append(f"Refused: {names}. The reason given, of the first: {refused[0].reason}.")
    return "\n\n".join(parts)


def _rivals(result: BenchmarkResult, surface: str) -> str:
    """A sentence that tells which bakes asked for by a dE00 another method beats.

    Bakes with other terms or texels than their plan's are no rivals: they are bakes too."""
    others = [row for row in result.rows_of(surface) if row.method != BAKE]
    beaten = [row.label for row in result.bakes_by_budget(surface) if any(other.beats(row) for other in others)]
    if beaten:
        return f"Another method is both faster and nearer than {', '.join(beaten)}."
    return "No other method is both faster and nearer than any of these."


def _sizes(result: BenchmarkResult) -> str:
    sizes = result.sizes
    largest = sizes[-1].seconds / n2_log_n(sizes[-1].pixels)
    lines = markdown(
        ["pixels", "bake, s", "per n² log n", "check, s", "MiB beyond the input", "the input, MiB", "dE00 p99"],
        [
            [
                f"{one.pixels}²", number(one.seconds),
                number(one.seconds / n2_log_n(one.pixels) / largest), number(one.check_seconds),
                mebibytes(one.beyond_input_bytes), mebibytes(one.input_bytes), number(one.delta_e_p99, 2),
            ]
            for one in sizes
        ],
    )  # fmt: skip
    return f"""## Larger scans

![Bake time against the size of the scan](images/{TIME_PICTURE})

A rough, skin-like synthetic surface of 48 nm pixels (laboratory/speed/synthetic_scan.py), each size in a
process of its own, `--delta-e 1` and automatic coherence. The third column is the time over n² log n, that of the
largest being 1.

{lines}

A small scan pays for its table and not for its transforms: the table's size is set by the coherence that the scan can
average, up to what 128 MiB hold. Once a scan is larger than that, its bins are blurred and thinned out after each
transform, and only the transforms grow. The limit is 2 GiB beyond the input."""


def _choice(result: BenchmarkResult) -> str:
    rivals = [name for name in ENTRIES if name != BAKE and not TRAITS[name].is_reference]
    lines = []
    for surface in result.front:
        bake = result.cheapest(surface, (BAKE,), JUST_VISIBLE)
        other = result.cheapest(surface, rivals, JUST_VISIBLE)
        if bake and other:
            ratio = other.seconds_per_million / bake.seconds_per_million
            million = bake.preparation_seconds / max(other.seconds_per_million - bake.seconds_per_million, 1e-9)
            lines.append(
                f"- {NAMES[surface]}: the cheapest bake within a dE00 of 1 is {number(ratio)} x faster than the next "
                f"method that is ({other.title}), and has earned its preparation back after "
                f"{number(million * 1e6, 2)} directions."
            )
        elif bake:
            lines.append(f"- {NAMES[surface]}: only the bake and the reference keep to a dE00 of 1.")
    return f"""## What to choose when

{chr(10).join(lines)}

- **To render**: a bake of `--delta-e 1`. Ask for 0.3 where two pictures are compared side by side, for 0.1 where the
  picture is the measurement: the cost per direction rises little (look-ups are few), the table's bytes do.
- **A preview, or a scene far away**: `--delta-e 3`; a smaller table, and nothing faster comes near its error.
- **One patch's speckle, or the thesis's pictures**: Chebyshev's images, not Taylor's: the same colours from a third of
  the images, in float32, at any depth of relief. Past 3 x 3 texels first (7 x 7 take nearly all that is left of the
  error), then finer wavelengths; more terms, or float64, buy nothing once the series has converged.
- **Few directions of a surface seen once**: Chebyshev too, which is ready in a fraction of a second.
- **An ideal line grating**: Stam's form is the cheapest that has wavelengths at all; its orders have no width in u, so
  it wants a coherence much longer than its period.
- **The truth**: the reference, for a handful of directions, or the map's and the metric's interpolation in s.
- NMM, PQ as printed and the rainbow of GPU Gems are here for comparison: each is far from its own model's reference on
  a skin, whatever it costs."""


def _limits(result: BenchmarkResult) -> str:
    return """## Limits

- NumPy on a processor. On a graphics card the counts stay (4 texels for each of K terms, against 9 texels of 37 terms
  at 81 wavelengths), the seconds do not.
- A method of the patch model and one of the ensemble model are compared through their own references; their pictures
  of one scan differ by speckle, which is a choice of model and no error.
- Preparation is timed while its allocations are counted, which costs some of the shortest a few percent. The bakes of
  one table differ among each other by less than a busy machine's noise: read their errors, and their cost as one.
- The zero order is not judged here: the bake's own check does (docs/data_flow.md).
- 37 Taylor terms do not hold every relief; where float32 cannot, the method refuses and is missing from that table.
- The gain of GPU Gems' rainbow, which has no units, was fitted to the reference's light.
- The reference's cost is that of two directions at five wavelengths, scaled up; its error at coarser steps is that of
  the same sums."""

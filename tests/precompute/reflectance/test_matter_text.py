# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts that name matters: what they mean, their canonical form, and what is refused."""

import contextlib
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from precompute.base.failure import GratingError
from precompute.reflectance import matter as matter_text
from precompute.reflectance.films import METALS
from precompute.reflectance.matter import LONGEST, MOST_LAYERS, Layer, Matter, Repeat, parse


def test_a_stack():
    matter = parse("Chitin 1.56/120nm, aluminum/0.005um, 2x(1.7 + 0.02i / 80 nm, air/1e2nm), silver")
    first = Repeat((Layer(1.56 + 0j, 120), Layer("aluminium", 5)))
    second = Repeat((Layer(1.7 + 0.02j, 80), Layer(1 + 0j, 100)), 2)
    assert matter == Matter("silver", (first, second))
    assert matter.text.startswith("Chitin 1.56")
    assert matter.layers == (*first.layers, *second.layers, *second.layers)


@pytest.mark.parametrize(
    "text, canonical",
    [
        ("  GOLD ", "gold"),
        ("1.560", "1.56"),
        ("dielectric", "dielectric"),
        ("mirror", "mirror"),
        ("keratin 1.56", "1.56"),
        ("1.7+.02i", "1.7+0.02i"),
        ("chitin 1.56/0.12um,air", "1.56/120nm, air"),
        ("1/130nm, 1.5", "air/130nm, 1.5"),
        ("1.5/1µm, 1.6", "1.5/1000nm, 1.6"),
        ("6 x ( 1.68/80nm ,1.56/90nm ), 1.56", "6x(1.68/80nm, 1.56/90nm), 1.56"),
        (" Plate  1.50 , GOLD", "plate 1.5, gold"),
        ("plate 1.585, mirror", "plate 1.585, mirror"),
        ("plate 1.5, 1/1um, 1.6", "plate 1.5, air/1000nm, 1.6"),
        ("1.4/5nm, 1x(1.5/6nm), 1.6/7nm, gold", "1.4/5nm, 1.5/6nm, 1.6/7nm, gold"),
    ],
)
def test_the_canonical_text(text, canonical):
    assert str(parse(text)) == canonical
    assert parse(canonical) == parse(text)


def test_names_make_no_other_matter():
    assert parse("chitin 1.56/120nm, air") == parse("1.56/120nm, air")
    assert hash(parse("chitin 1.56/120nm, air")) == hash(parse("1.56/120nm, air"))


NUMBERS = st.floats(0.01, 10).map(lambda n: complex(n, 0))
INDICES = st.one_of(NUMBERS, st.builds(complex, st.floats(0.01, 10), st.floats(0, 10)), st.sampled_from(METALS))
SOME_LAYERS = st.lists(
    st.builds(Layer, INDICES, st.floats(0, 10_000, exclude_min=True)), min_size=1, max_size=3
).map(tuple)  # fmt: skip
SUBSTRATES = INDICES.filter(lambda index: index != 1)


@given(SOME_LAYERS, SOME_LAYERS, st.integers(2, 30), SUBSTRATES, st.floats(1, 3))
def test_the_canonical_text_is_read_back(plain, repeated, count, substrate, plate_ior):
    matter = Matter(substrate, (Repeat(plain), Repeat(repeated, count)), plate_ior)
    assert parse(str(matter)) == matter
    assert str(parse(str(matter))) == str(matter)


BAD = {
    "": "is empty; give dielectric",
    " \n ": "is empty; give dielectric",
    "unobtainium": "unobtainium: is not a known matter; give dielectric, mirror, aluminium",
    "nan": "nan: is not a known matter",
    "1_5": "1_5: is not a known matter",
    "١.٥": "is not a known matter",
    "1.7+0.02": "1.7+0.02: is not a known matter",
    "0": "0: has the index 0; give an index from 0.01 to 10",
    "-1.5": "-1.5: has the index -1.5",
    "1e999": "has the index 1e999",
    "9" * 1500: "has the index 999",
    "1.7-0.02i": "has the extinction coefficient -0.02; give a number from 0 to 10",
    "1.7+11i": "has the extinction coefficient 11",
    "air": "air: reflects nothing; put a layer before it",
    "gold 1.5": "gold 1.5: names two matters; put a comma",
    "1.5 1.6": "1.5 1.6: names two matters",
    "1.5/0nm, gold": "1.5/0nm: is 0nm thick; give more than 0 and at most 10000nm",
    "1.5/-3nm, gold": "1.5/-3nm: is -3nm thick",
    "1.5/11um, gold": "1.5/11um: is 11um thick",
    "1.5/nannm, gold": "1.5/nannm: has no thickness that is a number",
    "1.5/20nm 1.6/30nm, gold": "has no thickness that is a number",
    "1.5/100, gold": "1.5/100: has a thickness without a unit; give nm or um",
    "1.5/100mm, gold": "1.5/100mm: has the unknown unit mm",
    "/100nm, gold": "/100nm: has no index; write layers as INDEX/THICKNESS",
    "0/100nm, gold": "0: has the index 0",
    "gold, silver": "gold: has no thickness; write layers as INDEX/THICKNESS",
    "1.5/100nm": "1.5/100nm: has no substrate; end with an index",
    "1.5/100nm,": "1.5/100nm,: has no substrate",
    "plate 0.5, gold": "plate 0.5: is not a plate; give an index above 1 and at most 3, such as plate 1.585",
    "plate 1, gold": "plate 1: is not a plate",
    "plate 3.1, gold": "plate 3.1: is not a plate",
    "plate -1.5, gold": "plate -1.5: is not a plate",
    "plate 1.5+0.1i, gold": "plate 1.5+0.1i: is not a plate",
    "plate gold, gold": "plate gold: is not a plate",
    "plate, gold": "plate: is not a plate",
    "plate 1.5/120nm, gold": "plate 1.5/120nm: is not a plate",
    "plate 1.5, plate 1.4, gold": "plate 1.4: has no thickness",
    "plate 1.5": "plate 1.5: has no substrate",
    "plate 1.5, dielectric": "dielectric: must stand alone",
    "plate 1.5, 1.5": "plate 1.5, 1.5: reflects nothing; put a layer before it",
    "2x(plate 1.5), gold": "plate 1.5: has no thickness",
    "6x(1.5/100nm)": "6x(1.5/100nm): has no substrate",
    "1.5/100nm,, gold": "has an empty layer; write layers as",
    "6x(), gold": "has an empty layer; write layers as",
    "1.5/100nm, mirror": "mirror: must stand alone",
    "dielectric/100nm, 1.5": "dielectric: must stand alone",
    "6x(1.5/100nm, gold": "6x(1.5/100nm, gold: has brackets that do not match; write repeats as 6x(",
    "6x1.5/100nm), gold": "has brackets that do not match",
    "2x(2x(1.5/100nm)), gold": "has brackets that do not match",
    "(1.5/100nm), gold": "has brackets that do not match",
    "0x(1.5/100nm), gold": "repeats 0 times; repeat 1 to 200 times",
    "10000x(1.5/100nm), gold": "repeats 10000 times",
    "9" * 1500 + "x(1.5/100nm), gold": "repeats 9999999999 times",
    "150x(1.5/100nm, 1.6/90nm), gold": "makes more than 200 layers",
    "1.5/1nm," * 201 + "gold": "makes more than 200 layers",
    "1.5/1nm, " * 9999 + "gold": "is longer than 2000 characters",
    "a\x1b[31m\u202e": r"a\x1b[31m\u202e: is not a known matter",
}


@pytest.mark.parametrize("text", BAD, ids=lambda text: f"{text:.30}")
def test_what_is_refused_in_one_line(text):
    with pytest.raises(GratingError) as failure:
        parse(text)
    line = failure.value.line()
    assert BAD[text] in line
    assert "; " in line and line.isprintable() and len(line) < 400


def test_the_limits_themselves_are_allowed():
    assert len(parse(f"{MOST_LAYERS}x(10+10i/10um), 0.01").layers) == MOST_LAYERS


def test_what_would_not_be_read_back_is_refused():
    """The canonical text has spaces that the given text lacks."""
    layers = ["1.51/1.1nm"] * 170
    assert len(",".join([*layers, "gold"])) <= LONGEST < len(", ".join([*layers, "gold"]))
    with pytest.raises(GratingError, match="longer than"):
        parse(",".join([*layers, "gold"]))


@pytest.mark.parametrize("unit", ["(", "1", "1.", "1 ", "+", ",", "1x(", "1x(1/1nm),", "a ", "1/", "1e", "1/1", ".1"])
@pytest.mark.parametrize("end", ["", "!", ")", "!/1nm, 1.5", "i"])
@pytest.mark.parametrize("begin", ["", "1/"])
def test_time_grows_as_the_length(begin, unit, end, monkeypatch):
    monkeypatch.setattr(matter_text, "LONGEST", 10**9)
    text = begin + unit * (50_000 // len(unit)) + end
    start = time.process_time()
    with contextlib.suppress(GratingError):
        parse(text)
    # A text takes up to 0.1 s. A pattern that tries each pair of characters takes 10 s.
    assert time.process_time() - start < 1


@given(st.text(alphabet="0123456789.+-i/nmux(), goldair", max_size=60))
def test_any_text_is_read_or_refused(text):
    try:
        matter = parse(text)
    except GratingError:
        return
    assert parse(str(matter)) == matter

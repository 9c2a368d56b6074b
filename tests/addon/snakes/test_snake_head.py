# SPDX-License-Identifier: GPL-3.0-or-later
"""A snake's head: its plates, lips and eyes."""

import numpy as np
import pytest

SPECIES = ("XENOPELTIS", "ELAPHE")


def test_a_head_has_plates_a_mouth_and_nostrils(room):
    share, angle = (k.ravel() for k in np.meshgrid(np.linspace(0, 1, 200), np.linspace(-np.pi, np.pi, 201)))
    for species, on_midline in (("XENOPELTIS", 3), ("ELAPHE", 2)):
        head = room["head"].head_of(room["body"].SPECIES[species])
        relief = room["head"].relief(share, angle, head, length=2.9)
        # Rostral, frontal and the interparietal of Xenopeltis; ten pairs on the top and sides, eight pairs of lips.
        outlines = len(head.plates.outlines)
        assert outlines == on_midline + 10 + 8
        plates = np.unique(relief.plate)
        assert set(range(outlines)) < set(plates) and 60 < len(plates) < 90
        assert relief.rise.max() < 0.021 and relief.rise.min() < -0.03
        # Both sides are equal. A plate on the midline is one, another has a twin.
        twin = room["head"].relief(share, -angle, head, length=2.9)
        np.testing.assert_allclose(relief.rise, twin.rise, atol=1e-9)
        right = angle > 0.1
        same = relief.plate[right] == twin.plate[right]
        np.testing.assert_array_equal(same, head.plates.lie_on_midline[relief.plate[right]])


def test_the_outlines_of_a_heads_plates_leave_no_gaps(room):
    """From the rostral to the parietals, every place over the lips lies in one outline: those of neighbours share their
    corners."""
    head = room["head"]
    share, angle = (k.ravel() for k in np.meshgrid(np.linspace(0.03, 0.65, 100), np.radians(np.linspace(1, 103, 100))))
    x, y = head._flat(share, angle, 2.9)
    for species in SPECIES:
        plates = head.head_of(room["body"].SPECIES[species]).plates
        held = sum(
            head._outline(x, y, outline, 2.9, open_at_midline=False)[0].astype(int) for outline in plates.outlines
        )
        # An edge is straight; a neighbour's edge beside it with one more corner is not quite.
        assert (held == 1).mean() > 0.99


def test_lips_are_pale_along_the_mouth_and_nowhere_else(room):
    head = room["head"].head_of(room["body"].SPECIES["XENOPELTIS"])
    share, degrees = np.array(((0.3, 98), (0.45, 96), (0.3, 60), (0.3, 0), (0.95, 100), (0.3, 180)), float).T
    lip = room["head"].relief(share, np.radians(degrees), head, length=2.9).lip
    assert lip[:2] == pytest.approx(1, abs=0.2) and (lip[2:] == 0).all()


@pytest.mark.parametrize("species", SPECIES)
def test_eyes_look_away_from_each_other(make, species):
    shape = make(species)
    each = int((shape.s == shape.s[-1]).sum()) // 2
    eyes, gaze = shape.points[-2 * each :], shape.of_points["gaze"][-2 * each :]
    assert (shape.of_points["gaze"][: -2 * each] == 0).all()
    first, second = eyes[:each][gaze[:each].argmax()], eyes[each:][gaze[each:].argmax()]
    middles = eyes[:each].mean(axis=0), eyes[each:].mean(axis=0)
    away = middles[0] - middles[1]
    away = away / np.linalg.norm(away)
    for pupil, middle, sign in ((first, middles[0], 1), (second, middles[1], -1)):
        out = pupil - middle
        # 0.25 back and 0.2 ahead: cos = 1 / sqrt(1 + 0.25^2 + 0.2^2) = 0.95, and half a segment.
        assert sign * (out @ away) / np.linalg.norm(out) > 0.9

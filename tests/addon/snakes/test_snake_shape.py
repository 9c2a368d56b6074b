# SPDX-License-Identifier: GPL-3.0-or-later
"""A snake's arrays: closed, as dense as requested, right-handed, flush on the back, and reproducible from a seed."""

import numpy as np
import pytest


def following(shape):
    """For each corner the next corner (c,) of its face."""
    after = np.arange(1, len(shape.corners) + 1)
    ends = np.append(shape.starts[1:], len(shape.corners))
    after[ends - 1] = shape.starts
    return after


def face_areas(shape):
    """Vector areas (f, 3) of the faces, m2."""
    p = shape.points[shape.corners]
    middle = np.repeat(
        np.add.reduceat(p, shape.starts) / face_sizes(shape)[:, None], face_sizes(shape), axis=0
    )  # fmt: skip
    return np.add.reduceat(np.cross(p - middle, p[following(shape)] - middle) / 2, shape.starts)


def face_sizes(shape):
    return np.diff(np.append(shape.starts, len(shape.corners)))


SPECIES = ("XENOPELTIS", "ELAPHE")
POSES = ("COILED", "S", "RESTING", "REARING")


@pytest.mark.short("11000", "200000")
@pytest.mark.parametrize("species", SPECIES)
@pytest.mark.parametrize("faces", [11_000, 50_000, 200_000, 1_000_000])
def test_the_number_of_faces_is_near_the_one_asked_for(make, species, faces):
    assert len(make(species, faces=faces).starts) == pytest.approx(faces, rel=0.05)


@pytest.mark.night("test_the_number_of_faces_is_near_the_one_asked_for")
@pytest.mark.parametrize("species", SPECIES)
@pytest.mark.parametrize("pose", POSES)
def test_the_mesh_is_closed_and_every_face_has_an_area(make, species, pose):
    shape = make(species, pose)
    one, other = shape.corners, shape.corners[following(shape)]
    size = len(shape.points)
    # Each edge occurs once in each direction: no edge is open, has three faces, or has faces of opposite orientation.
    there = one.astype(np.int64) * size + other
    assert len(np.unique(there)) == len(there)
    assert np.array_equal(np.sort(there), np.sort(other.astype(np.int64) * size + one))
    # A body and two eyes are spheres: the Euler characteristic of each is 2.
    assert size - len(there) // 2 + len(shape.starts) == 6
    assert np.array_equal(np.unique(shape.corners), np.arange(size))
    # The smallest faces are in the grooves at the tail's tip, some micrometres wide.
    assert np.linalg.norm(face_areas(shape), axis=1).min() > 1e-14


@pytest.mark.night("test_the_same_seed_makes_the_same_snake_and_another_seed_turns_its_plates")
@pytest.mark.parametrize("faces", [11_000, 1_000_000])
def test_no_face_is_without_area_at_the_fewest_and_the_most_faces(make, faces):
    shape = make(faces=faces)
    assert len(shape.starts) == pytest.approx(faces, rel=0.05)
    assert np.linalg.norm(face_areas(shape), axis=1).min() > 1e-14


@pytest.mark.parametrize("species", SPECIES)
@pytest.mark.parametrize("faces", [11_000, 200_000])
def test_uvs_run_along_the_body_and_are_right_handed(make, species, faces):
    shape = make(species, faces=faces)
    uv = shape.uv
    # Seen from outside, a positive area in the UV map means that T, B and N are right-handed.
    (u, v), (next_u, next_v) = uv.T, uv[following(shape)].T
    area = np.add.reduceat(u * next_v - v * next_u, shape.starts) / 2
    assert area.min() > 0
    middle = np.add.reduceat(uv, shape.starts) / face_sizes(shape)[:, None]
    # No face at the seam spans the whole map.
    assert np.ptp(uv[:, 1]) <= 1 + 1e-9 and uv[:, 1].min() >= 0
    widths = np.maximum.reduceat(uv[:, 1], shape.starts) - np.minimum.reduceat(uv[:, 1], shape.starts)
    assert widths.max() < 0.3
    # U is in girths of the thickest place: a snake 80 (92) half widths long has 80 / 2 pi of them.
    skin = np.repeat(shape.material == 0, face_sizes(shape))
    longest = {"XENOPELTIS": 80, "ELAPHE": 92}[species] / (2 * np.pi)
    assert (uv[skin, 0].min(), uv[skin, 0].max()) == pytest.approx((0, longest), abs=1e-6)
    assert middle[:, 1].min() > 0 and middle[:, 1].max() < 1


@pytest.mark.parametrize("pose", POSES)
def test_t_points_to_the_tail_and_the_faces_outwards(room, make, pose):
    """On the plates; their edges are too steep."""
    shape = make(pose=pose, faces=200_000)
    spine = room["body"].spine_along(room["body"].POSES[pose], 1.0)
    p, uv, after = shape.points[shape.corners], shape.uv, following(shape)
    first = shape.starts
    edge_p, edge_uv = p[after] - p, uv[after] - uv
    a, b = edge_p[first], edge_p[after[first]]
    (u1, v1), (u2, v2) = edge_uv[first].T, edge_uv[after[first]].T
    determinant = u1 * v2 - u2 * v1
    on_rim = np.maximum.reduceat(shape.of_points["scale_rim"][shape.corners], first) > 0
    s = shape.s[shape.corners[first]]
    seen = ~on_rim & (s > 0.1) & (s < 0.9)
    tangent = (a * v2[:, None] - b * v1[:, None])[seen] / determinant[seen, None]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    s = s[seen]
    tail = np.stack([np.interp(s, spine.s, spine.tail[:, k]) for k in range(3)], axis=1)
    # The other faces lie on the slopes of the tapering tail and of a neck that leaves the floor.
    assert np.mean((tangent * tail).sum(1) > 0.95) > 0.97
    axis = np.stack([np.interp(s, spine.s, (spine.points + 0.008 * spine.back)[:, k]) for k in range(3)], axis=1)
    outwards = ((p[first][seen] - axis) * face_areas(shape)[seen]).sum(1)
    assert np.mean(outwards > 0) > 0.98


def plate_normals(shape):
    """Unit normals (k, 3) of the faces inside plates on the back of the stout half of the body, and their mask (f,)."""
    areas, first = face_areas(shape), shape.starts
    rim = np.maximum.reduceat(shape.of_points["scale_rim"][shape.corners], first)
    around = np.maximum.reduceat(shape.of_points["around"][shape.corners], first)
    s = shape.s[shape.corners[first]]
    keep = (rim == 0) & (around < 0.2) & (s > 0.25) & (s < 0.5)
    return areas[keep] / np.linalg.norm(areas[keep], axis=1, keepdims=True), keep


@pytest.mark.parametrize(("species", "least", "most"), [("XENOPELTIS", 0.5, 5.0), ("ELAPHE", 1.0, 14.0)])
def test_plates_are_nearly_flush_on_the_back(room, make, species, least, most):
    """The plates' normals differ from the smooth body's by a few degrees: by dome, lift, turn and keel."""
    shape = make(species, "S", faces=200_000)
    normals, keep = plate_normals(shape)
    spine = room["body"].spine_along(room["body"].POSES["S"], 1.0)
    body = room["body"].body_along(spine, room["body"].SPECIES[species])
    first = shape.starts
    s = np.add.reduceat(shape.s[shape.corners], first) / face_sizes(shape)
    v = np.add.reduceat(shape.uv[:, 1], first) / face_sizes(shape)
    s, angle = s[keep], (v[keep] - 0.5) * 2 * np.pi
    step = 1e-5
    along = body.points(s + step, angle, 0 * s) - body.points(s - step, angle, 0 * s)
    across = body.points(s, angle + step, 0 * s) - body.points(s, angle - step, 0 * s)
    smooth = np.cross(along, across)
    smooth /= np.linalg.norm(smooth, axis=1, keepdims=True)
    off = np.degrees(np.arccos(np.clip((normals * smooth).sum(axis=1), -1, 1)))
    assert least < np.median(off)
    assert np.quantile(off, 0.95) < most


def turns_within_plates(room, shape):
    """For each plate (n,) on the back of the stout half of the body: by how much its normals turn across the body, over
    the angle around the body that they lie apart. Least squares."""
    normals, keep = plate_normals(shape)
    spine = room["body"].spine_along(room["body"].POSES["S"], 1.0)
    s = (np.add.reduceat(shape.s[shape.corners], shape.starts) / face_sizes(shape))[keep]
    angle = (np.add.reduceat(shape.uv[:, 1], shape.starts) / face_sizes(shape))[keep] * 2 * np.pi
    side, back = (np.stack([np.interp(s, spine.s, part[:, k]) for k in range(3)], axis=1) for part in spine[3:])
    roll = np.arctan2((normals * side).sum(axis=1), (normals * back).sum(axis=1))
    _, plate, faces = np.unique(shape.of_faces["scale_random"][keep], return_inverse=True, return_counts=True)
    angle, roll = (values - (np.bincount(plate, values) / faces)[plate] for values in (angle, roll))
    # A plate at the edge of what is kept is cut off. Only whole ones have the most faces.
    return (np.bincount(plate, angle * roll) / np.bincount(plate, angle**2))[faces == faces.max()]


def test_scatter_multiplies_the_tilts_of_plates_which_are_larger_in_bends(room, make):
    """Heights of points over a snake without tilts, in the species' own unit."""
    level, own, twice = (make(scatter=scatter).points for scatter in (0.0, 1.0, 2.0))
    np.testing.assert_allclose(twice - level, 2 * (own - level), rtol=0.01, atol=1e-8)
    snake = make()
    spine = room["body"].spine_along(room["body"].POSES["RESTING"], 1.0)
    bend = np.abs(room["body"].body_along(spine, room["body"].SPECIES["XENOPELTIS"]).bends(snake.s))
    moved = np.linalg.norm(own - level, axis=1)
    stout = (snake.s > 0.25) & (snake.s < 0.6)
    straight, bent = (moved[stout & where].mean() for where in (bend < 0.05, bend > 0.25))
    assert bent > 1.5 * straight


@pytest.mark.night("test_the_same_seed_makes_the_same_snake_and_another_seed_turns_its_plates")
@pytest.mark.parametrize("flatness", [0.3, 1.0])
def test_flat_plates_take_away_their_share_of_the_bodys_roundness(room, make, flatness):
    round_plates, flat = (
        turns_within_plates(room, make("XENOPELTIS", "S", 500_000, flatness=value)) for value in (0.0, flatness)
    )
    assert len(flat) > 50
    # A plate takes away the mean turn under its inner part; the outer parts of the body are a little rounder.
    assert np.median(flat) / np.median(round_plates) == pytest.approx(1 - flatness, abs=0.06)


def test_the_same_seed_makes_the_same_snake_and_another_seed_turns_its_plates(make, room):
    spine = room["body"].spine_along(room["body"].POSES["RESTING"], 1.0)
    again = room["shape"].snake_shape(spine, "XENOPELTIS", room["shape"].Detail(50_000))
    other = make(seed=1)
    np.testing.assert_array_equal(make().points, again.points)
    np.testing.assert_array_equal(make().of_faces["scale_random"], again.of_faces["scale_random"])
    assert not np.array_equal(make().points, other.points)
    # By at most two degrees over half a scale of some millimetres.
    assert np.abs(make().points - other.points).max() < 5e-4


def test_attributes_are_from_0_to_1_and_a_scale_has_one_random_number(make):
    shape = make(faces=200_000)
    for values in (*shape.of_points.values(), *shape.of_faces.values()):
        assert (values.min(), values.max()) == pytest.approx((0, 1), abs=2e-3)
    # 15 rows of 198 scales, one belly plate per row, and the head's plates.
    assert len(np.unique(shape.of_faces["scale_random"])) == pytest.approx(16 * 198, rel=0.05)
    # Rims of 0.13 of a side, linear from their inner edge, are above 0.4 on 1 - 0.84^2 = 0.29 of a plate; rounded
    # corners and the head's plates add to this.
    rim = np.add.reduceat(shape.of_points["scale_rim"][shape.corners], shape.starts) / face_sizes(shape)
    area = np.linalg.norm(face_areas(shape), axis=1)
    assert 0.3 < (area * (rim > 0.4)).sum() / area.sum() < 0.5
    belly = np.repeat(shape.of_faces["belly"] > 0, face_sizes(shape))
    # Except the very tip of the tail, which is both below and above.
    assert np.quantile(shape.of_points["around"][shape.corners[belly]], 0.01) > 0.6


def test_a_body_does_not_cut_itself(room):
    for name in POSES:
        for species in room["body"].SPECIES.values():
            spine = room["body"].spine_along(room["body"].POSES[name], 1.0)
            body = room["body"].body_along(spine, species)
            sizes = body.sizes(spine.s)
            axis = (spine.points + sizes.axis[:, None] * spine.back)[::4]
            width, s = sizes.width[::4], spine.s[::4]
            distance = np.linalg.norm(axis[:, None] - axis[None], axis=-1) - width[:, None] - width
            # Places nearer than a half-turn along the body are neighbours; the bend, checked below, separates them.
            apart = np.abs(s[:, None] - s[None]) > np.pi * 1.7 * body.radius
            assert distance[apart].min() > 0, name
            bend = np.linalg.norm(np.gradient(spine.tail, spine.s, axis=0), axis=1) * sizes.width
            # The inside of a bend folds where curvature times half width reaches 1.
            assert bend.max() < 0.6, name


def test_a_spine_has_the_length_asked_for_and_its_back_up(room):
    for name in POSES:
        spine = room["body"].spine_along(room["body"].POSES[name], 0.7)
        steps = np.linalg.norm(np.diff(spine.points, axis=0), axis=1)
        assert spine.length == pytest.approx(0.7)
        assert steps.sum() == pytest.approx(0.7, rel=1e-4)
        frame = np.stack([spine.tail, spine.side, spine.back], axis=1)
        np.testing.assert_allclose(frame @ frame.transpose(0, 2, 1), np.tile(np.eye(3), (len(frame), 1, 1)), atol=1e-9)
        np.testing.assert_allclose(np.linalg.det(frame), 1, atol=1e-9)
        lying = np.abs(spine.tail[:, 2]) < 0.05
        if name == "REARING":  # the head that looks ahead also has its back up
            assert spine.back[0, 2] > 0.9
        assert (spine.back[lying, 2] > 0.99).all()


def test_a_spine_along_no_line_is_refused(room):
    with pytest.raises(Exception, match="its line has no length; give a curve of two or more different points"):
        room["body"].spine_along(np.ones((5, 3)))


def test_a_spine_follows_a_polygon_of_two_points(room):
    spine = room["body"].spine_along(np.array([(0, 0, 0), (0, 0, 2.0)]))
    assert spine.length == pytest.approx(2)
    np.testing.assert_allclose(spine.tail, np.tile((0, 0, 1.0), (len(spine.s), 1)), atol=1e-9)


@pytest.mark.parametrize("faces", [10_999, 1_000_001, -1])
def test_too_few_and_too_many_faces_are_refused(room, faces):
    spine = room["body"].spine_along(room["body"].POSES["S"], 1.0)
    with pytest.raises(Exception, match=f"snake: {faces} faces; give 11000 to 1000000"):
        room["shape"].snake_shape(spine, "XENOPELTIS", room["shape"].Detail(faces))


def test_samples_of_a_side_rise_from_the_groove_to_the_next(room):
    for n in range(2, 30):
        at = room["scales"].samples(n)
        assert len(at) == n and at[0] == 0 and (np.diff(np.append(at, 1)) > 0).all()
        # Both ends are alike: the groove's side and the rim are equally wide at the head edge and the tail edge.
        np.testing.assert_allclose(at[1:], 1 - at[1:][::-1], atol=1e-12)


def test_angles_at_the_seam_and_at_tips_are_those_of_their_face(room):
    angles = np.array([(3.1, 3.2, -3.1, 3.1), (3.2, 3.3, 9.4, 3.2), (0.1, 0.2, 0.0, 0.1)])
    tips = np.array([(0, 0, 0, 0), (0, 0, 0, 0), (0, 0, 1, 0)], bool)
    found = room["ends"].unwrapped(angles, tips)
    assert np.ptp(found, axis=1).max() < 0.4
    assert np.abs((found.min(axis=1) + found.max(axis=1)) / 2).max() <= np.pi
    assert found[2] == pytest.approx((0.1, 0.2, 0.15, 0.1))


@pytest.mark.night("test_a_shed_skin_repeats_with_its_seed")
@pytest.mark.parametrize("species", SPECIES)
@pytest.mark.parametrize("faces", [11_000, 200_000, 1_000_000])
def test_a_shed_skin_is_one_sheet_with_one_edge(room, species, faces):
    shape = room["mesh"].shed_shape(species, size=0.06, faces=faces, seed=3)
    assert len(shape.starts) == pytest.approx(faces, rel=0.05)
    size = len(shape.points)
    one, other = shape.corners.astype(np.int64), shape.corners[following(shape)]
    there, back = one * size + other, other * size + one
    assert len(np.unique(there)) == len(there)
    open_edges = ~np.isin(there, back)
    # Every point on the edge has one incoming and one outgoing edge; the Euler characteristic of a disc is 1.
    assert len(np.unique(one[open_edges])) == open_edges.sum()
    assert size - (len(there) + open_edges.sum()) // 2 + len(shape.starts) == 1
    areas = face_areas(shape)
    assert np.linalg.norm(areas, axis=1).min() > 1e-14
    (u, v), (next_u, next_v) = shape.uv.T, shape.uv[following(shape)].T
    assert np.add.reduceat(u * next_v - v * next_u, shape.starts).min() > 0
    # It faces up, except for overhanging parts.
    assert (areas[:, 2] > 0).mean() > 0.8


def test_a_shed_skin_repeats_with_its_seed(room):
    one, again, other = (room["mesh"].shed_shape("ELAPHE", size=0.06, faces=11_000, seed=k) for k in (1, 1, 2))
    np.testing.assert_array_equal(one.points, again.points)
    assert not np.array_equal(one.points, other.points)


@pytest.mark.parametrize("faces", [10_999, 1_000_001])
def test_too_few_and_too_many_faces_of_shed_skin_are_refused(room, faces):
    with pytest.raises(Exception, match=f"shed skin: {faces} faces; give 11000 to 1000000"):
        room["mesh"].shed_shape("ELAPHE", size=0.06, faces=faces)

"""The polygon splitter: what a split must hold for any face, and known shapes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from curvify import dissect
from curvify.convex import Split, split_at_corners, split_polygons, whole_faces
from curvify.errors import OptionError
from curvify.mesh import Bools, Floats, Ints
from curvify.polygons import judge, newell_normals, next_corners, previous_corners, surely_convex

Faces = list[list[int]]
Points = list[tuple[float, float]]
Keyhole = tuple[Points, list[int]]

L_SHAPE: Points = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
U_SHAPE: Points = [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)]
COMB: Points = [
    (0, 0), (7, 0), (7, 2), (6, 2), (6, 1), (5, 1), (5, 2), (4, 2),
    (4, 1), (3, 1), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2),
]  # fmt: skip
SPIRAL: Points = [
    (0, 0), (6, 0), (6, 6), (1, 6), (1, 2), (4, 2), (4, 4),
    (3, 4), (3, 3), (2, 3), (2, 5), (5, 5), (5, 1), (0, 1),
]  # fmt: skip
ARROW: Points = [(0, 0), (2, 1), (0, 2), (0.7, 1)]
ONE_HOLE: Keyhole = (
    [(0, 0), (4, 0), (4, 4), (0, 4), (1, 1), (1, 3), (3, 3), (3, 1)],
    [0, 1, 2, 3, 0, 4, 5, 6, 7, 4],
)
TWO_HOLES: Keyhole = (
    [(0, 0), (8, 0), (8, 4), (0, 4), (1, 1), (1, 3), (3, 3), (3, 1), (5, 1), (5, 3), (7, 3), (7, 1)],
    [0, 1, 11, 8, 9, 10, 11, 1, 2, 3, 0, 4, 5, 6, 7, 4],
)


def corner_crosses(positions: np.ndarray, face_offsets: np.ndarray, face_vertices: np.ndarray) -> np.ndarray:
    """Cross of the side to the next and the side to the previous vertex at each corner ``(C,3)``."""
    points = positions[face_vertices]
    sides = points[next_corners(face_offsets)] - points
    return np.cross(sides[previous_corners(face_offsets)], sides)


def star(points: int) -> Points:
    angles = np.arange(2 * points) * np.pi / points
    radii = np.where(np.arange(2 * points) % 2, 0.4, 1)
    return list(zip(radii * np.cos(angles), radii * np.sin(angles), strict=True))


SHAPES: dict[str, Points] = {
    "L": L_SHAPE, "U": U_SHAPE, "comb": COMB, "spiral": SPIRAL, "arrow": ARROW,
    "star": star(5), "large star": star(20), "huge star": star(45),
}  # fmt: skip


def space(points: object) -> Floats:
    """Points of the plane, or of space, as ``(V,3)``."""
    array = np.asarray(points, dtype=np.float64)
    return np.pad(array, ((0, 0), (0, 3 - array.shape[1])))


def rows(faces: Sequence[Sequence[int]]) -> tuple[Ints, Ints]:
    offsets = np.cumsum([0, *(len(face) for face in faces)])
    return offsets, np.array([v for face in faces for v in face], dtype=int)


def split_faces(positions: object, faces: Sequence[Sequence[int]], **options: object) -> Split:
    return split_polygons(space(positions), *rows(faces), **options)  # type: ignore[arg-type]


def pieces_of(split: Split) -> Faces:
    return [part.tolist() for part in np.split(split.face_vertices, split.face_offsets[1:-1])]


def diagonal_pairs(split: Split) -> list[tuple[int, int]]:
    """Vertex pairs of the diagonals, with repeats."""
    inner = split.diagonals >= 0
    heads = split.face_vertices[next_corners(split.face_offsets)]
    pairs = np.stack([split.face_vertices, heads], axis=1)[inner]
    return sorted((int(a), int(b)) for a, b in pairs if a < b)


def check(positions: object, faces: Sequence[Sequence[int]], split: Split, convex: bool = True) -> None:
    """All that holds for every split: partition, sides and diagonals, corners; and convex pieces."""
    points = space(positions)
    offsets, vertices = rows(faces)
    assert np.array_equal(vertices[split.source_corners], split.face_vertices)
    assert (np.diff(split.source_faces) >= 0).all() and (np.diff(split.diagonal_faces) >= 0).all()
    owner = np.repeat(np.arange(len(faces)), np.diff(offsets))
    corner_piece = np.repeat(np.arange(len(split.source_faces)), np.diff(split.face_offsets))
    assert np.array_equal(owner[split.source_corners], split.source_faces[corner_piece])

    heads = split.source_corners[next_corners(split.face_offsets)]
    outer = split.diagonals < 0
    assert sorted(split.source_corners[outer]) == list(range(len(vertices)))
    assert np.array_equal(heads[outer], next_corners(offsets)[split.source_corners[outer]])
    runs: dict[int, list[tuple[int, int, int]]] = {}
    for k in np.flatnonzero(~outer):
        run = int(split.source_corners[k]), int(heads[k]), int(corner_piece[k])
        runs.setdefault(int(split.diagonals[k]), []).append(run)
    assert sorted(runs) == list(range(len(split.diagonal_faces)))
    for name, (one, other) in runs.items():
        assert one[:2] == other[1::-1] and one[2] != other[2]
        assert owner[one[0]] == split.diagonal_faces[name]

    whole = newell_normals(points, offsets, vertices)
    parts = newell_normals(points, split.face_offsets, split.face_vertices)
    total = np.zeros_like(whole)
    np.add.at(total, split.source_faces, parts)
    assert np.allclose(total, whole, rtol=0, atol=1e-12 * np.abs(points).max() ** 2)
    if convex:
        for piece, face in zip(pieces_of(split), split.source_faces, strict=True):
            assert len(set(piece)) == len(piece)
            assert is_convex(points[piece], whole[face])


def is_convex(points: Floats, up: Floats) -> bool:
    """The rule written out plainly, corner by corner."""
    area, mean, turned = np.zeros(3), np.zeros(3), 0.0
    count = len(points)
    crosses = []
    for k in range(count):
        arrive, leave = points[k] - points[k - 1], points[(k + 1) % count] - points[k]
        area = area + np.cross(points[k] - points[0], points[(k + 1) % count] - points[0])
        lengths = float(np.linalg.norm(arrive) * np.linalg.norm(leave))
        crosses.append((np.cross(arrive, leave), lengths, arrive, leave))
    for corner, lengths, _, _ in crosses:
        if np.linalg.norm(corner) > 1e-6 * lengths:
            mean = mean + corner / np.linalg.norm(corner)
    area_unit = area / np.linalg.norm(area)
    mean_unit = mean / np.linalg.norm(mean) if np.linalg.norm(mean) > 1e-6 else area_unit
    for corner, lengths, arrive, leave in crosses:
        if min(corner @ area_unit, corner @ mean_unit) < -1.0001e-3 * lengths:
            return False
        along = leave @ arrive - (leave @ area_unit) * (arrive @ area_unit)
        turned += float(np.arctan2(corner @ area_unit, along))
    return abs(turned - 2 * np.pi) < 1e-6 and float(area_unit @ up) > 0.2 * float(np.linalg.norm(up))


@pytest.mark.parametrize("rule", ["best", "closest"])
@pytest.mark.parametrize("name", SHAPES)
def test_concave_shapes_become_convex_pieces(name: str, rule: str) -> None:
    shape = SHAPES[name]
    faces = [list(range(len(shape)))]
    split = split_faces(shape, faces, rule=rule)
    check(shape, faces, split)
    assert split.counts["concave"] == 1 and split.first == {"concave": 0}


def test_known_shapes_need_few_pieces() -> None:
    for name, pieces in {"L": 2, "U": 3, "arrow": 2, "comb": 5, "spiral": 6, "star": 4}.items():
        assert len(split_faces(SHAPES[name], [range(len(SHAPES[name]))]).source_faces) <= pieces


@pytest.mark.parametrize("rule", ["best", "closest"])
@pytest.mark.parametrize("shape", [ONE_HOLE, TWO_HOLES], ids=["one", "two"])
def test_keyholes_become_pieces_with_distinct_vertices(shape: Keyhole, rule: str) -> None:
    points, face = shape
    split = split_faces(points, [face], rule=rule)
    check(points, [face], split)
    assert split.counts["keyhole"] == 1
    # Also where the bridge has vertices of its own that lie in the same places.
    points, face = [points[v] for v in face], list(range(len(face)))
    check(points, [face], split_faces(points, [face], rule=rule))


def test_faces_fit_for_patches_stay_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("curvify.dissect.cut_group", None)
    angles = np.arange(7) * 2 * np.pi / 7
    points = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    points = np.concatenate([points, [[3, 0, 1], [2, -3, 0.5]]])
    faces = [[0, 1, 2, 3, 4, 5, 6], [0, 7, 1], [0, 6, 8, 7], []]
    split = split_faces(points, faces)
    assert pieces_of(split) == faces
    assert split.source_corners.tolist() == list(range(14)) and (split.diagonals == -1).all()
    assert not any(split.counts.values()) and split.first == {}
    assert pieces_of(whole_faces(*rows(faces))) == faces


def test_straight_corners_are_fine() -> None:
    points = [(0, 0), (1, 0), (2, 0), (2, 2), (0, 2)]
    assert len(split_faces(points, [[0, 1, 2, 3, 4]]).source_faces) == 1


def test_empty_mesh() -> None:
    split = split_polygons(np.zeros((0, 3)), np.array([0]), np.zeros(0, dtype=int))
    assert split.face_offsets.tolist() == [0] and len(split.diagonal_faces) == 0


def test_faces_without_area_are_left_alone() -> None:
    points = [(0, 0), (1, 0), (2, 0), (3, 0), (1, 1)]
    for face in ([0, 1, 2, 3], [0, 1, 4, 1], [0, 2, 1, 3]):
        split = split_faces(points, [face])
        assert pieces_of(split) == [face] and not any(split.counts.values())


def test_crossing_sides_stay_unsplit() -> None:
    points = [(0, 0), (2, 0), (0.3, 1.5), (2, 1), (5, 5)]
    split = split_faces(points, [[4, 3, 1], [0, 1, 2, 3]])
    assert pieces_of(split) == [[4, 3, 1], [0, 1, 2, 3]]
    assert split.counts["unsplit"] == 1 and split.counts["concave"] == 0 and split.first == {"unsplit": 1}


def test_crossing_sides_are_cut_where_they_must_be() -> None:
    points = [(0, 0), (2, 0), (0.3, 1.5), (2, 1), (2.5, 0.2)]
    split = split_faces(points, [[0, 1, 2, 3, 4]], max_sides=4)
    check(points, [[0, 1, 2, 3, 4]], split, convex=False)
    assert np.diff(split.face_offsets).max() <= 4 and split.counts["concave"] == 1


def test_warped_concave_hexagon() -> None:
    points = [(0, 0, 0.2), (2, 0, -0.2), (2, 1, 0.1), (1, 1, 0), (1, 2, -0.2), (0, 2, 0.2)]
    split = split_faces(points, [[0, 1, 2, 3, 4, 5]])
    check(points, [[0, 1, 2, 3, 4, 5]], split)
    assert len(split.source_faces) == 2


@pytest.mark.parametrize("rule", ["best", "closest"])
@pytest.mark.parametrize("name", ["L", "arrow", "large star"])
def test_sides_with_many_vertices(name: str, rule: str) -> None:
    ends = np.array(SHAPES[name], dtype=np.float64)
    steps = np.arange(3)[None, :, None] / 3
    points = (ends[:, None] + (np.roll(ends, -1, axis=0) - ends)[:, None] * steps).reshape(-1, 2)
    faces = [list(range(len(points)))]
    split = split_faces(points, faces, rule=rule)
    check(points, faces, split)
    areas = newell_normals(space(points), split.face_offsets, split.face_vertices)[:, 2]
    assert areas.min() > 1e-6


@pytest.mark.parametrize("sides", [65, 200, 1000])
@pytest.mark.parametrize("stretch", [1, 4])
def test_many_sided_convex_faces_become_few_upright_pieces(sides: int, stretch: int) -> None:
    angles = np.arange(sides) * 2 * np.pi / sides
    points = np.stack([stretch * np.cos(angles), np.sin(angles)], axis=1)
    faces = [list(range(sides))]
    split = split_faces(points, faces)
    check(points, faces, split)
    assert np.diff(split.face_offsets).max() <= 64
    assert split.counts["many_sided"] == 1
    assert len(split.source_faces) == -(-(sides - 2) // 62)
    cosines = judge_pieces(space(points), split)
    assert np.degrees(np.arccos(cosines.max())) > 3


def judge_pieces(points: Floats, split: Split) -> Floats:
    return np.array([judge(points[piece].T[:, :, None]).sharpest[0] for piece in pieces_of(split)])


@pytest.mark.parametrize("sides", [41, 300])
def test_large_concave_faces(sides: int) -> None:
    rng = np.random.default_rng(5)
    angles = np.arange(sides) * 2 * np.pi / sides
    radii = rng.uniform(0.5, 1, sides)
    points = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    faces = [list(range(sides))]
    split = split_faces(points, faces)
    check(points, faces, split)
    reflex = (corner_crosses(space(points), *rows(faces))[:, 2] < 0).sum()
    assert len(split.source_faces) <= 1.4 * (reflex + 1)


def test_large_winding_face() -> None:
    turn = np.linspace(0.5, 6 * np.pi, 80)
    inner = np.stack([turn * np.cos(turn), turn * np.sin(turn)], axis=1)
    points = np.concatenate([1.15 * inner, inner[::-1]])
    faces = [list(range(160))]
    if newell_normals(space(points), *rows(faces))[0, 2] < 0:
        points = points[::-1]
    check(points, faces, split_faces(points, faces))


# Random simple polygons


@st.composite
def star_shaped(draw: st.DrawFn) -> Floats:
    count = draw(st.integers(4, 14))
    steps = draw(st.lists(st.floats(0.2, 1), min_size=count, max_size=count))
    radii = draw(st.lists(st.floats(0.1, 1), min_size=count, max_size=count))
    angles = np.cumsum(steps) * 2 * np.pi / sum(steps)
    return space(np.stack([np.array(radii) * np.cos(angles), np.array(radii) * np.sin(angles)], axis=1))


@st.composite
def monotone(draw: st.DrawFn) -> Floats:
    heights = st.lists(st.floats(0.05, 1), min_size=1, max_size=6)
    below, above = draw(heights), draw(heights)
    lower = [((k + 1) / (len(below) + 1), -h) for k, h in enumerate(below)]
    upper = [((k + 1) / (len(above) + 1), h) for k, h in enumerate(above)]
    return space([(0, 0), *lower, (1, 0), *upper[::-1]])


simple_polygons = star_shaped() | monotone()


def is_forward_simple(points: Floats) -> bool:
    """Whether the star really goes around its center: a step of half a turn or more may not."""
    return bool(newell_normals(points, *rows([range(len(points))]))[0, 2] > 1e-6) and no_crossing(points)


def no_crossing(points: Floats) -> bool:
    count = len(points)
    sides = [(i, i + 1) for i in range(count)]

    def side(a: int, b: int, c: int) -> float:
        u, v = points[b % count] - points[a % count], points[c % count] - points[a % count]
        return float(u[0] * v[1] - u[1] * v[0])

    def meet(a: int, b: int, c: int, d: int) -> bool:
        return side(a, b, c) * side(a, b, d) <= 0 and side(c, d, a) * side(c, d, b) <= 0

    pairs = ((i, j) for i in range(count) for j in range(i + 2, count - (i == 0)))
    return not any(meet(*sides[i], *sides[j]) for i, j in pairs)


@settings(max_examples=120, deadline=None)
@given(simple_polygons, st.sampled_from(["best", "closest"]))
def test_any_simple_polygon_is_split_into_convex_pieces(points: Floats, rule: str) -> None:
    if not is_forward_simple(points):
        return
    faces = [list(range(len(points)))]
    split = split_faces(points, faces, rule=rule)
    check(points, faces, split)
    assert split.counts["unsplit"] == split.counts["doubled"] == 0


@settings(max_examples=60, deadline=None)
@given(simple_polygons, st.integers(1, 13), st.integers(0, 2**32 - 1))
def test_first_corner_does_not_matter(points: Floats, turn: int, seed: int) -> None:
    count = len(points)
    bumps = np.random.default_rng(seed).uniform(-0.02, 0.02, points.shape)
    points = points + bumps
    order = [(k + turn) % count for k in range(count)]
    split, turned = split_faces(points, [list(range(count))]), split_faces(points, [order])
    assert diagonal_pairs(split) == diagonal_pairs(turned)


def many_faces(count: int, sides: int, seed: int = 0) -> tuple[Floats, Faces]:
    """Faces apart from each other, each with one or two reflex corners."""
    rng = np.random.default_rng(seed)
    angles = np.arange(sides) * 2 * np.pi / sides + rng.uniform(-0.1, 0.1, (count, sides))
    radii = rng.uniform(0.8, 1, (count, sides))
    radii[np.arange(count), rng.integers(sides, size=count)] = 0.2 if sides > 4 else -0.3
    x, y = radii * np.cos(angles) + 3 * np.arange(count)[:, None], radii * np.sin(angles)
    points = np.stack([x, y, rng.uniform(-0.02, 0.02, (count, sides))], axis=-1)
    return points.reshape(-1, 3), np.arange(count * sides).reshape(count, sides).tolist()


def test_order_of_faces_does_not_matter() -> None:
    points, faces = many_faces(20, 7)
    more, others = many_faces(20, 5, seed=1)
    points = np.concatenate([points, more])
    faces += [[v + 140 for v in face] for face in others]
    order = np.random.default_rng(3).permutation(len(faces))
    shuffled = split_faces(points, [faces[k] for k in order])
    split = split_faces(points, faces)
    assert diagonal_pairs(split) == diagonal_pairs(shuffled)
    assert np.array_equal(np.sort(order[shuffled.source_faces]), split.source_faces)


def test_scale_and_motion_do_not_matter() -> None:
    points, faces = many_faces(30, 8)
    expected = diagonal_pairs(split_faces(points, faces))
    axes, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    axes *= np.sign(np.linalg.det(axes))
    for moved in (points * 1e-6, points * 1e6, points @ axes.T, points @ axes.T + 100):
        assert diagonal_pairs(split_faces(moved, faces)) == expected


def test_quads_that_are_surely_convex_are_acceptable() -> None:
    points = np.random.default_rng(3).normal(size=(3, 4, 4000)) * [[[1.0]], [[1.0]], [[0.3]]]
    points += np.array([[1, 0, -1, 0], [0, 1, 0, -1], [0, 0, 0, 0]])[:, :, None]
    sure = surely_convex(points)
    assert 0.1 < sure.mean() < 0.9
    assert judge(points).acceptable[sure].all()



@pytest.mark.parametrize("sides", [4, 6])
def test_faces_of_one_size_are_split_together(sides: int, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = {"triangulate": 0, "judge": 0}

    def counted(name: str) -> None:
        inner = getattr(dissect, name)

        def call(*args: object, **options: object) -> object:
            calls[name] += 1
            return inner(*args, **options)

        monkeypatch.setattr(dissect, name, call)

    for name in calls:
        counted(name)
    points, faces = many_faces(20_000, sides)
    split = split_faces(points, faces)
    assert len(split.source_faces) >= 40_000 and split.counts["concave"] == 20_000
    assert calls["triangulate"] <= 5 and calls["judge"] <= 5 * (sides - 3)


# How few pieces


def fewest_pieces(points: Floats) -> int:
    """The minimum over all ways to cut a polygon by diagonals, by trying them."""
    up = newell_normals(points, *rows([range(len(points))]))[0]

    @cache
    def best(loop: tuple[int, ...]) -> float:
        if is_convex(points[list(loop)], up):
            return 1
        least = np.inf
        for i in range(len(loop)):
            for j in range(i + 2, len(loop) - (i == 0)):
                least = min(least, best(loop[i : j + 1]) + best(loop[: i + 1] + loop[j:]))
        return least

    return int(best(tuple(range(len(points)))))


def test_pieces_are_near_the_fewest() -> None:
    rng = np.random.default_rng(2)
    extra, tried = 0, 0
    while tried < 40:
        count = int(rng.integers(5, 8))
        angles = np.sort(rng.uniform(0, 2 * np.pi, count))
        if np.diff(angles, append=angles[0] + 2 * np.pi).max() > 3 or np.diff(angles).min() < 0.1:
            continue
        radii = rng.uniform(0.15, 1, count)
        points = space(np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1))
        more = len(split_faces(points, [range(count)]).source_faces) - fewest_pieces(points)
        assert 0 <= more <= 1
        extra, tried = extra + more, tried + 1
    assert extra <= 2


# Diagonals and edges of the mesh


def test_no_diagonal_along_an_edge() -> None:
    # The best diagonal of the L, 0-3, is an edge of a face behind it.
    points = space([*L_SHAPE, (0, 0)])
    points[6] = (0.5, 0.5, -1)
    alone = split_faces(points, [[0, 1, 2, 3, 4, 5]])
    assert diagonal_pairs(alone) == [(0, 3)]
    for rule in ("best", "closest"):
        faces = [[0, 1, 2, 3, 4, 5], [0, 3, 6]]
        split = split_faces(points, faces, rule=rule)
        check(points, faces, split)
        assert (0, 3) not in diagonal_pairs(split) and split.counts["doubled"] == 0


def test_two_faces_do_not_share_a_diagonal() -> None:
    points = space(L_SHAPE)
    faces = [[0, 1, 2, 3, 4, 5], [5, 4, 3, 2, 1, 0]]
    for rule in ("best", "closest"):
        split = split_faces(points, faces, rule=rule)
        check(points, faces, split)
        pairs = diagonal_pairs(split)
        assert len(set(pairs)) == len(pairs) >= 2 and split.counts["doubled"] == 0


def test_a_diagonal_along_an_edge_is_reported_where_there_is_no_other() -> None:
    points = space([*ARROW, (1, 1)])
    points[4, 2] = -1
    split = split_faces(points, [[0, 1, 2, 3], [1, 3, 4]])
    assert split.counts["doubled"] == 1 and diagonal_pairs(split) == [(1, 3)]


def test_closest_rule_takes_the_closest_vertex_in_sight() -> None:
    points = [(0, 0), (10, 0), (10, 4), (6, 4), (5, 1), (4.5, 4), (0, 4)]
    split = split_faces(points, [list(range(7))], rule="closest")
    # 3 and 5 are neighbors of the reflex corner 4; of the others 0 and 1 are as far, 2 is a bit further.
    assert diagonal_pairs(split) in ([(0, 4), (1, 4)], [(1, 4)], [(0, 4)])
    blocked = [(0, 0), (4, 0), (4, 3), (2.2, 3), (2.1, 1), (2, 3), (1.9, 1), (1.8, 3), (0, 3)]
    split = split_faces(blocked, [list(range(9))], rule="closest")
    check(blocked, [list(range(9))], split)
    assert (4, 6) in diagonal_pairs(split)


def test_unknown_rule_and_too_few_sides_are_refused() -> None:
    with pytest.raises(OptionError, match="closest"):
        split_faces(L_SHAPE, [list(range(6))], rule="worst")
    with pytest.raises(OptionError, match="3 sides"):
        split_faces(L_SHAPE, [list(range(6))], max_sides=2)


def test_max_sides_three_triangulates() -> None:
    split = split_faces(U_SHAPE, [list(range(8))], max_sides=3)
    check(U_SHAPE, [list(range(8))], split)
    assert np.diff(split.face_offsets).tolist() == [3] * 6


# Folding


def upward(split: Split) -> Floats:
    return np.tile([0.0, 0.0, 1.0], (len(split.face_vertices), 1))


def corners_at(split: Split, vertex: int) -> Bools:
    return np.asarray(split.face_vertices == vertex)


def test_a_bad_corner_gets_the_diagonal_with_the_largest_smallest_sine() -> None:
    points = space([(0, 0), (1, 0), (2, 0), (2, 2), (0, 2)])
    split = whole_faces(*rows([[0, 1, 2, 3, 4]]))
    cut = split_at_corners(points, split, corners_at(split, 1), upward(split))
    check(points, [[0, 1, 2, 3, 4]], cut)
    assert len(diagonal_pairs(cut)) == 1 and 1 in diagonal_pairs(cut)[0]
    assert cut.counts["folding"] == 1 and cut.counts["unsplit"] == 0


def test_folding_never_cuts_along_an_edge() -> None:
    points = space([(0, 0), (2, 0), (2, 2), (0, 2), (1, 1)])
    points[4, 2] = -1
    split = whole_faces(*rows([[0, 1, 2, 3], [2, 0, 4]]))
    cut = split_at_corners(points, split, corners_at(split, 0) & (split.source_corners < 4), upward(split))
    assert len(cut.source_faces) == 2 and cut.counts["unsplit"] == 1 and cut.first == {"unsplit": 0}


def test_triangles_cannot_be_split_at_corners() -> None:
    split = whole_faces(*rows([[0, 1, 2]]))
    cut = split_at_corners(space([(0, 0), (1, 0), (0, 1)]), split, corners_at(split, 0), upward(split))
    assert pieces_of(cut) == [[0, 1, 2]] and cut.counts["unsplit"] == 1


def test_folding_stays_where_a_diagonal_would_make_it_worse() -> None:
    points = space([(0, 0), (2, 0), (2, 2), (0, 2)])
    split = whole_faces(*rows([[0, 1, 2, 3]]))
    normals = upward(split)
    normals[1] = (0, 0, -1)
    cut = split_at_corners(points, split, corners_at(split, 0), normals)
    assert len(cut.source_faces) == 1 and cut.counts["unsplit"] == 1


def test_folding_after_a_split_keeps_the_earlier_diagonals() -> None:
    points = space(U_SHAPE)
    faces = [[0, 1, 2, 3, 4, 5, 6, 7]]
    split = split_polygons(points, *rows(faces))
    bad = np.zeros(len(split.face_vertices), dtype=bool)
    bad[split.face_offsets[:-1]] = np.diff(split.face_offsets) > 3
    cut = split_at_corners(points, split, bad, upward(split))
    check(points, faces, cut)
    assert set(diagonal_pairs(split)) < set(diagonal_pairs(cut))
    assert cut.counts == {**split.counts, "folding": 1}
    again = split_at_corners(points, cut, np.zeros(len(cut.face_vertices), dtype=bool), upward(cut))
    assert pieces_of(again) == pieces_of(cut) and np.array_equal(again.diagonals, cut.diagonals)


def test_folding_faces_on_the_same_vertices_take_different_diagonals() -> None:
    points = space([(0, 0), (2, 0), (2, 2.1), (0, 2)])
    split = whole_faces(*rows([[0, 1, 2, 3], [3, 2, 1, 0]]))
    normals = upward(split)
    normals[4:] *= -1
    cut = split_at_corners(points, split, np.asarray(split.face_vertices == 0), normals)
    assert len(cut.source_faces) == 3 and cut.counts["folding"] == 1 and cut.counts["unsplit"] == 1


# Plain geometry


def test_neighbors_of_corners_skip_empty_faces() -> None:
    offsets = np.array([0, 0, 3, 3, 7, 7])
    assert next_corners(offsets).tolist() == [1, 2, 0, 4, 5, 6, 3]
    assert previous_corners(offsets).tolist() == [2, 0, 1, 6, 3, 4, 5]


def test_area_vectors_are_accurate_far_from_the_origin() -> None:
    points = space(L_SHAPE) / 1024 + 2.0**20
    areas = newell_normals(points, *rows([range(6), [], [5, 0, 1]])) * 2.0**20
    assert np.array_equal(areas, [[0, 0, 6], [0, 0, 0], [0, 0, 4]])

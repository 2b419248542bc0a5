"""Sharp features from all their sources: which says what, and which one wins."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import curvify
from curvify.marks import are_bit_flags
from curvify.mesh import Marks, PolygonMesh
from curvify.options import MeshOptions
from curvify.prepare import Coarse, prepare_mesh
from surfaces import cube, diagonal, dodecahedron, mixed_ball, on_sphere, prism, refined, torus

RIMS = [(r * 12 + k, r * 12 + (k + 1) % 12) for r in (0, 1) for k in range(12)]


def creases(pairs: object, sharpness: object = 1.0) -> Marks:
    edges = np.asarray(pairs).reshape(-1, 2)
    ends = np.broadcast_to(np.asarray(sharpness, dtype=float), (len(edges), 2))
    return Marks(crease_edges=edges, crease_sharpness=ends)


def prepared(mesh: PolygonMesh, **options: object) -> Coarse:
    return prepare_mesh(mesh, MeshOptions(**options))  # type: ignore[arg-type]


def sharp_edges(mesh: PolygonMesh, **options: object) -> set[tuple[int, int]]:
    """Edges with a crease at both ends, as sorted pairs."""
    coarse = prepared(mesh, **options)
    edges = np.sort(coarse.topology.edges[(coarse.marks.crease > 0).all(axis=1)], axis=1)
    return {(int(a), int(b)) for a, b in edges}


def ordered(pairs: object) -> set[tuple[int, int]]:
    return {(min(a, b), max(a, b)) for a, b in pairs}  # type: ignore[attr-defined]


def ring(sides: int = 8, tube: int = 6) -> PolygonMesh:
    """A torus without normals whose bands turn by 60 degrees."""
    return torus(sides, tube).with_(corner_normals=None)


def loops(sides: int = 8, tube: int = 6) -> list[tuple[int, int]]:
    return [(r * sides + k, r * sides + (k + 1) % sides) for r in range(tube) for k in range(sides)]


# --- one set of creases, told in four ways ------------------------------------------------------------------------


CASES: dict[str, tuple[Callable[[], PolygonMesh], list[tuple[int, int]], Callable[[int], int], float]] = {
    "cylinder": (lambda: prism(12), RIMS, lambda face: 1 if face < 12 else face - 10, 40.0),
    "ring": (ring, loops(), lambda face: face // 8 + 1, 50.0),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("source", ["marks", "vn", "groups", "flags", "angle"])
def test_the_same_creases_from_any_source_give_the_same_surface(name: str, source: str) -> None:
    make, edges, group, angle = CASES[name]
    mesh = make()
    tagged = curvify.surface(mesh.with_(marks=creases(edges)))
    groups = np.array([group(face) for face in range(mesh.face_count)])
    told: dict[str, tuple[PolygonMesh, dict[str, object]]] = {
        "marks": (mesh, {"marks": creases(edges)}),
        "vn": (mesh.with_(corner_normals=tagged.patches.normals), {}),
        "groups": (mesh.with_(face_smoothing=groups), {}),
        "flags": (mesh.with_(face_smoothing=2 ** (groups + 3)), {}),
        "angle": (mesh, {"sharp_angle": angle}),
    }
    other, options = told[source]
    expected, found = tagged.refine(3), refined(other, 3, **options)
    far = 1e-6 * diagonal(mesh.positions)
    assert np.array_equal(expected.faces, found.faces)
    assert np.abs(expected.positions - found.positions).max() < far
    gap = found.normals[found.face_wedges] - expected.normals[expected.face_wedges]
    assert np.abs(gap).max() < 1e-6


# --- sources ------------------------------------------------------------------------------------------------------


def test_marks_hold_over_tags_edge_by_edge() -> None:
    mesh = prism(12).with_(marks=creases(RIMS))
    first, others = RIMS[0], RIMS[1:]
    assert sharp_edges(mesh) == ordered(RIMS)
    assert sharp_edges(mesh, marks=creases([first], 0.0)) == ordered(others)
    softened = prepared(mesh, marks=creases([first[::-1]], (0.25, 0.75)))
    edge = next(i for i, e in enumerate(softened.topology.edges.tolist()) if sorted(e) == sorted(first))
    at_first = 0 if softened.topology.edges[edge, 0] == first[0] else 1
    assert softened.marks.crease[edge, at_first] == 0.75
    assert softened.marks.crease[edge, 1 - at_first] == 0.25


def test_tags_hold_over_normals_and_normals_over_groups_and_the_angle() -> None:
    mesh = prism(12)
    normals = mesh.positions[mesh.face_vertices] * [1, 1, 0]
    normals[-24:-12], normals[-12:] = [0, 0, -1], [0, 0, 1]
    side = (3, 15)
    told = mesh.with_(
        corner_normals=normals,
        face_smoothing=np.arange(1, 15),
        marks=Marks(
            crease_edges=np.array([side, RIMS[0]]), crease_sharpness=np.array([[1.0, 1.0], [0.0, 0.0]])
        ),
    )
    assert sharp_edges(told) == ordered([*RIMS[1:], side])
    assert sharp_edges(told, sharp_from="normals") == ordered(RIMS)
    assert len(sharp_edges(told, sharp_from="groups")) == 36
    assert sharp_edges(told, sharp_from="tags") == ordered([side])
    assert sharp_edges(told, sharp_from="none") == set()
    assert sharp_edges(told, sharp_from="none", marks=creases([RIMS[4]])) == ordered([RIMS[4]])
    assert sharp_edges(told, sharp_from="angle", sharp_angle=60) == ordered(RIMS)
    counts = prepared(told).marks.counts
    assert counts["tags"] == {"crease": 2}
    assert counts["normals"] == {"crease": 23}
    assert counts["groups"] == {"crease": 0}


def test_an_angle_without_a_say_is_told() -> None:
    mesh = on_sphere(dodecahedron())
    texts = curvify.surface(mesh, sharp_angle=30).warnings
    assert any("--sharp-from angle" in text for text in texts)
    assert not curvify.surface(mesh.with_(corner_normals=None), sharp_angle=30).warnings


def test_a_crease_between_equal_normals_computes_both_sides_anew() -> None:
    mesh = on_sphere(mixed_ball())
    assert mesh.corner_normals is not None
    coarse = prepared(mesh)
    path = [coarse.topology.edges[0].tolist()]
    while len(path) < 6:  # along the edge that turns least, so that the crease is a line
        ends = [e for e in coarse.topology.edges.tolist() if path[-1][1] in e and path[-1][0] not in e]
        far = [sum(e) - path[-1][1] for e in ends]
        direction = mesh.positions[path[-1][1]] - mesh.positions[path[-1][0]]
        ahead = [(mesh.positions[v] - mesh.positions[path[-1][1]]) @ direction for v in far]
        path.append([path[-1][1], far[int(np.argmax(ahead))]])
    surface = curvify.surface(mesh, marks=creases(path))
    on_path = np.unique(np.array(path)[1:-1])
    changed = np.linalg.norm(surface.patches.normals - mesh.corner_normals, axis=1) > 1e-9
    assert set(surface.patches.topology.vertices[changed]) <= set(np.unique(path).tolist())
    assert set(on_path.tolist()) <= set(surface.patches.topology.vertices[changed].tolist())
    assert surface.patches.counts["crease_edges"] == 6


def test_flat_shaded_normals_do_not_silence_other_sources() -> None:
    mesh = cube()
    area = np.array([np.cross(*np.diff(mesh.positions[f][:3], axis=0)) for f in mesh.faces()])
    told = mesh.with_(corner_normals=np.repeat(area, 4, axis=0), face_smoothing=np.array([1, 2, 1, 1, 1, 1]))
    assert len(sharp_edges(told)) == 4


def test_faces_in_no_smoothing_group_are_smooth_with_none() -> None:
    mesh = cube()
    assert sharp_edges(mesh.with_(face_smoothing=np.array([1, 1, 1, 1, 1, 0]))) == sharp_edges(
        mesh.with_(face_smoothing=np.array([1, 1, 1, 1, 1, 2]))
    )
    assert len(sharp_edges(mesh.with_(face_smoothing=np.array([0, 0, 1, 1, 1, 1])))) == 8


@pytest.mark.parametrize(
    ("numbers", "flags"),
    [
        ([1, 2, 3, 4, 5], False),
        ([1, 2, 3, 0], False),
        ([7], False),
        ([1, 2, 4, 8, 16], False),  # one flag each: no different from numbers
        ([1, 2, 4, 5, 16], True),
        ([1, 9, 8, 40, 32], True),
        ([1, 5, 100], False),  # flags of 100 that nothing else has
        ([0, 0], False),
    ],
)
def test_bit_flags_are_told_from_numbers(numbers: list[int], flags: bool) -> None:
    assert are_bit_flags(np.array(numbers)) == flags


def test_a_face_in_two_groups_joins_them_and_that_is_said() -> None:
    mesh = prism(12)
    groups = np.array([64] * 12 + [64 | 128, 128])
    surface = curvify.surface(mesh.with_(face_smoothing=groups))
    assert any("bit flags" in text for text in surface.warnings)
    lower = {(a, b) for a, b in ordered(RIMS) if a < 12}
    assert sharp_edges(mesh.with_(face_smoothing=groups)) == ordered(RIMS) - lower


def test_marks_that_lie_on_no_edge_are_told() -> None:
    surface = curvify.surface(cube(), marks=creases([(0, 7), (0, 1)]))
    assert any("1 mark is on vertices that no edge joins, first: 0-7" in text for text in surface.warnings)


@pytest.mark.parametrize(
    ("marks", "text"),
    [
        (creases([(0, 8)]), "vertex 8, the mesh has 8"),
        (creases([(0, 1)], 1.5), "from 0 to 1"),
        (Marks(crease_edges=np.array([[0, 1]])), r"1 marks need values of shape \(1, 2\)"),
        (Marks(flat_faces=np.array([6])), "face 6, the mesh has 6"),
        (Marks(full_faces=np.array([0]), alphas=np.array([0.0])), "positive"),
        (Marks(bulged_faces=np.array([0]), bulges=np.array([np.nan])), "finite"),
    ],
)
def test_marks_that_cannot_be_are_refused(marks: Marks, text: str) -> None:
    with pytest.raises(curvify.MeshError, match=text):
        curvify.surface(cube(), marks=marks)
    with pytest.raises(curvify.MeshError, match=text):
        curvify.surface(cube().with_(marks=marks))


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"sharp_from": "angle"}, "--sharp-angle"),
        ({"sharp_from": "none", "sharp_angle": 30}, "leave one of them out"),
        ({"sharp_angle": -1}, "from 0 to 180"),
        ({"sharp_angle": float("nan")}, "from 0 to 180"),
        ({"sharp_from": "magic"}, "sharp_from must be one of"),
        ({"weld": "magic"}, "weld must be one of"),
    ],
)
def test_options_that_cannot_be_are_refused(options: dict[str, object], text: str) -> None:
    with pytest.raises(curvify.OptionError, match=text):
        curvify.surface(cube(), **options)


def test_kappa_parts_nothing() -> None:
    mesh = cube()
    coarse = prepared(mesh, marks=Marks(curled_edges=np.array([[1, 0]]), kappas=np.array([-0.1])))
    edge = next(i for i, e in enumerate(coarse.topology.edges.tolist()) if sorted(e) == [0, 1])
    assert coarse.marks.kappa[edge] == -0.1
    assert np.isnan(np.delete(coarse.marks.kappa, edge)).all()
    assert not coarse.features().sharp.any()


# --- what was found -----------------------------------------------------------------------------------------------


def test_what_was_found_makes_the_same_surface_alone() -> None:
    mesh = prism(12).with_(
        face_smoothing=np.array([1] * 12 + [2, 3]),
        marks=Marks(
            crease_edges=np.array([[3, 15], RIMS[0]]),
            crease_sharpness=np.array([[0.5, 0.25], [0.0, 0.0]]),
            straight_edges=np.array([[4, 16]]),
            flat_faces=np.array([12]),
            corner_vertices=np.array([20]),
            corner_sharpness=np.array([0.5]),
        ),
    )
    extra = Marks(
        bent_edges=np.array([[17, 5]]), edge_normals=np.array([[0.1, 0.2, 1.0]]), hole_faces=np.array([7]),
        curled_edges=np.array([[0, 12]]), kappas=np.array([0.0]), bulged_faces=np.array([3]), bulges=np.array([0.1]),
        full_faces=np.array([2]), alphas=np.array([1.5]),
    )  # fmt: skip
    found = prepared(mesh, marks=extra).found_marks()
    # Both tags, and the upper rim but for its edge at the hole; the lower one goes with the flat face.
    assert found.counts() == {
        "crease": 1 + 1 + 11, "straight": 1, "edge normal": 1, "kappa": 1, "corner": 1, "flat": 1, "hole": 1,
        "bulge": 1, "alpha": 1,
    }  # fmt: skip
    expected = refined(mesh, 2, marks=extra)
    again = refined(mesh, 2, marks=found, sharp_from="none")
    assert np.array_equal(expected.faces, again.faces)
    assert np.array_equal(expected.positions, again.positions)
    assert np.array_equal(expected.normals, again.normals)

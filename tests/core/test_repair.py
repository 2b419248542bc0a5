"""Repairs: every defect goes, nothing else changes."""

from __future__ import annotations

import numpy as np
import pytest

import curvify
from bodies import boxes
from curvify.checks import check_mesh
from curvify.mesh import Marks, PolygonMesh
from curvify.prepare import prepare_mesh
from curvify.repair import repair_mesh
from surfaces import soup, torus

SOUND = dict.fromkeys(("watertight", "manifold", "oriented", "positive_volume", "no_degenerate", "no_duplicates"), True)
#: A mesh, how many faces and vertices it has afterwards, how many pieces, what is said.
CASES = {
    "sound": (boxes((0, 0, 0)), 6, 8, 1, []),
    "soup": (soup(boxes((0, 0, 0))), 6, 8, 1, ["16 vertices closed into seams"]),
    "turned face": (boxes((0, 0, 0), turned=[(0, 3)]), 6, 8, 1, ["1 face turned to the side of the others"]),
    "inside out": (
        boxes((0, 0, 0), turned=[(0, k) for k in range(6)]), 6, 8, 1, ["1 closed piece turned outside out"],
    ),
    "touching at a vertex": (boxes((0, 0, 0), (1, 1, 1)), 12, 16, 2, ["1 vertex repeated where surfaces only touch"]),
    "touching at an edge": (
        boxes((0, 0, 0), (1, 1, 0)), 12, 16, 2,
        ["1 edge of more than two faces taken apart", "2 vertices repeated where surfaces only touch"],
    ),
    "wall inside": (boxes((0, 0, 0), (1, 0, 0)), 10, 12, 1, ["2 faces of walls inside removed"]),
    "three in a row": (boxes((0, 0, 0), (1, 0, 0), (2, 0, 0)), 14, 16, 1, ["4 faces of walls inside removed"]),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_every_defect_goes(name):
    mesh, faces, vertices, pieces, said = CASES[name]
    mended, notes = repair_mesh(mesh)
    mended.validate()
    assert (mended.face_count, mended.vertex_count) == (faces, vertices)
    assert notes == said
    assert all(finding.passed for finding in check_mesh(mended, {**SOUND, "max_pieces": pieces}))
    again, notes = repair_mesh(mended)
    assert notes == []
    assert again.faces() == mended.faces()
    np.testing.assert_array_equal(again.positions, mended.positions)


def test_faces_beyond_repair_are_removed():
    points = [*boxes((0, 0, 0)).positions.tolist(), [9, 9, 9]]
    faces = [*boxes((0, 0, 0)).faces(), [0, 1, 1], [0, 1, 0, 1], [3, 1, 0, 2]]
    mended, notes = repair_mesh(PolygonMesh.from_faces(points, faces))
    assert mended.faces() == boxes((0, 0, 0)).faces()
    assert notes == [
        "1 face with fewer than 3 distinct corners removed",
        "1 face without area removed",
        "1 face on the vertices of another removed",
        "1 vertex in no face removed",
    ]


def test_a_sheet_with_two_sides_keeps_one():
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]]
    sheet = PolygonMesh.from_faces(points, [[0, 1, 2, 3], [1, 4, 5, 2], [3, 2, 1, 0], [2, 5, 4, 1]])
    mended, notes = repair_mesh(sheet)
    assert mended.faces() == [[0, 1, 2, 3], [1, 4, 5, 2]]
    assert notes == ["2 faces on others' vertices removed"]


def test_cavities_stay_inside_out():
    inner = boxes((0, 0, 0), turned=[(0, k) for k in range(6)])
    outer = boxes((0, 0, 0))
    points = np.concatenate([3 * outer.positions - 1, inner.positions])
    faces = outer.faces() + [[v + 8 for v in face] for face in inner.faces()]
    mended, notes = repair_mesh(PolygonMesh.from_faces(points, faces))
    assert (mended.faces(), notes) == (faces, [])


def test_most_of_a_piece_decides_its_side():
    mesh = torus(6, 5)
    turned = [face[::-1] if k % 3 == 0 else face for k, face in enumerate(mesh.faces())]
    mended, notes = repair_mesh(PolygonMesh.from_faces(mesh.positions, turned))
    assert notes == ["10 faces turned to the side of the others"]
    assert [set(face) for face in mended.faces()] == [set(face) for face in mesh.faces()]
    assert all(finding.passed for finding in check_mesh(mended, SOUND))


def test_what_corners_and_faces_carry_goes_along():
    mesh = boxes((0, 0, 0), turned=[(0, 3)])
    corners = np.arange(mesh.corner_count, dtype=float)
    rich = mesh.with_(
        corner_normals=np.stack([corners, corners + 1, corners + 2], axis=1),
        corner_uvs=np.stack([corners, corners], axis=1),
        vertex_colors=np.arange(24, dtype=np.uint8).reshape(8, 3),
        face_materials=np.arange(6),
        material_names=tuple("abcdef"),
        marks=Marks(
            crease_edges=np.array([[0, 1]]), crease_sharpness=np.array([[1.0, 0.5]]), flat_faces=np.array([3])
        ),
    )
    mended, _ = repair_mesh(rich)
    for face in range(6):
        before = slice(*rich.face_offsets[face : face + 2])
        after = slice(*mended.face_offsets[face : face + 2])
        sign = -1 if face == 3 else 1
        had = {
            (v, *uv, *n)
            for v, uv, n in zip(
                rich.face_vertices[before].tolist(),
                rich.corner_uvs[before].tolist(),
                (sign * rich.corner_normals[before]).tolist(),
                strict=True,
            )
        }
        has = zip(
            mended.face_vertices[after].tolist(),
            mended.corner_uvs[after].tolist(),
            mended.corner_normals[after].tolist(),
            strict=True,
        )
        assert {(v, *uv, *n) for v, uv, n in has} == had
    np.testing.assert_array_equal(mended.face_materials, np.arange(6))
    np.testing.assert_array_equal(mended.vertex_colors, rich.vertex_colors)
    assert mended.marks.counts() == {"crease": 1, "flat": 1}


def test_marks_follow_their_vertices_and_faces():
    points = [[9, 9, 9], *boxes((0, 0, 0)).positions.tolist()]
    faces = [[1, 2, 2], *([v + 1 for v in face] for face in boxes((0, 0, 0)).faces())]
    marks = Marks(
        crease_edges=np.array([[1, 2], [0, 1]]),
        crease_sharpness=np.ones((2, 2)),
        corner_vertices=np.array([0, 8]),
        corner_sharpness=np.array([1.0, 0.5]),
        flat_faces=np.array([0, 2]),
        hole_faces=np.array([4]),
        bulged_faces=np.array([6]),
        bulges=np.array([0.3]),
    )
    mended, _ = repair_mesh(PolygonMesh.from_faces(points, faces, marks=marks))
    found = mended.marks
    assert found.crease_edges.tolist() == [[0, 1]]
    assert (found.corner_vertices.tolist(), found.corner_sharpness.tolist()) == ([7], [0.5])
    assert (found.flat_faces.tolist(), found.hole_faces.tolist()) == ([1], [3])
    assert (found.bulged_faces.tolist(), found.bulges.tolist()) == ([5], [0.3])
    found.validate(mended.vertex_count, mended.face_count)


@pytest.mark.parametrize(("most", "faces", "closed"), [(0, 27, False), (3, 27, False), (4, 28, False), (6, 29, True)])
def test_small_holes_are_closed(most, faces, closed):
    mesh = torus(6, 5)
    kept = [face for k, face in enumerate(mesh.faces()) if k not in (3, 15, 16)]
    mended, notes = repair_mesh(PolygonMesh.from_faces(mesh.positions, kept), holes=most)
    assert mended.face_count == faces
    assert check_mesh(mended, {"watertight": True})[0].passed == closed
    assert check_mesh(mended, {"oriented": True})[0].passed
    assert len(notes) == (faces > 27)


def test_a_closed_hole_has_its_neighbors_material_and_no_normals():
    mesh = boxes((0, 0, 0), missing=[(0, 0)]).with_(face_materials=np.arange(5), material_names=tuple("abcde"))
    mesh = mesh.with_(corner_normals=np.ones((20, 3)))
    mended, _ = repair_mesh(mesh, holes=4)
    assert mended.face_materials[-1] in range(5)
    assert np.isnan(mended.corner_normals[-4:]).all()
    assert not np.isnan(mended.corner_normals[:-4]).any()
    prepare_mesh(mended)


def test_a_strip_with_one_side_is_cut():
    angles = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    across = np.stack([np.cos(angles) * np.cos(angles / 2), np.sin(angles) * np.cos(angles / 2), np.sin(angles / 2)], 1)
    middle = 3 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    points = np.concatenate([middle - across, middle + across])
    faces = [[k, k + 1, k + 13, k + 12] for k in range(11)] + [[11, 12, 0, 23]]
    mended, notes = repair_mesh(PolygonMesh.from_faces(points, faces))
    assert notes[0] == "1 piece with one side only cut where its ends meet"
    assert all(f.passed for f in check_mesh(mended, {"oriented": True, "manifold": True}))


def test_nothing_to_mend():
    flat = PolygonMesh.from_faces([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    with pytest.raises(curvify.MeshError, match="no face has an area"):
        repair_mesh(flat)

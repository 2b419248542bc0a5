"""What is measured on a mesh, against meshes of which it is known."""

from __future__ import annotations

import numpy as np
import pytest

from bodies import boxes
from curvify import inspection
from curvify.mesh import Marks, PolygonMesh
from curvify.options import MeshOptions
from curvify.prepare import prepare_mesh
from surfaces import cylinder, dodecahedron, flat_grid, soup, torus, vase


def ends(coarse, edges):
    return {tuple(pair) for pair in inspection.edge_ends(coarse, edges).tolist()}


@pytest.mark.parametrize(
    ("mesh", "count", "loops", "genus"),
    [
        (dodecahedron(), 1, 0, 0),
        (torus(), 1, 0, 1),
        (soup(torus()), 1, 0, 1),
        (cylinder(6), 1, 2, 0),
        (vase(), 1, 2, 0),
        (flat_grid(3, 2), 1, 1, 0),
        (boxes((0, 0, 0), (3, 0, 0)), 2, 0, 0),
        (boxes((0, 0, 0), (1, 1, 1)), 2, 0, 0),  # joined at a vertex, which is one of each
        (boxes((0, 0, 0), missing=[(0, 0), (0, 1)]), 1, 2, 0),
        (boxes((0, 0, 0), (1, 1, 0)), 4, 4, None),  # a crowded edge is a boundary for each of its faces
    ],
)
def test_pieces_holes_and_genus(mesh, count, loops, genus):
    found = inspection.pieces(prepare_mesh(mesh))
    if genus is None:
        assert found.genus is None
    else:
        assert (found.count, found.boundary_loops, found.genus) == (count, loops, genus)


def test_a_ring_of_boxes_has_a_hole_through_it():
    places = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 1, 0), (2, 2, 0), (1, 2, 0), (0, 2, 0), (0, 1, 0)]
    from curvify.repair import repair_mesh

    ring, _ = repair_mesh(boxes(*places))
    assert inspection.pieces(prepare_mesh(ring)).genus == 1


def test_edges_by_their_faces():
    open_ = prepare_mesh(boxes((0, 0, 0), missing=[(0, 0)]))
    assert ends(open_, inspection.open_edges(open_)) == {(0, 1), (0, 2), (1, 3), (2, 3)}
    crowded = prepare_mesh(boxes((0, 0, 0), (1, 1, 0)))
    assert len(inspection.crowded_edges(crowded)) == 1
    turned = prepare_mesh(boxes((0, 0, 0), turned=[(0, 0)]))
    assert ends(turned, inspection.reversed_edges(turned)) == {(0, 1), (0, 2), (1, 3), (2, 3)}
    for coarse in (open_, turned, crowded):
        assert len(inspection.pinched_vertices(coarse)) == 0
    pinched = prepare_mesh(boxes((0, 0, 0), (1, 1, 1)))
    assert inspection.pinched_vertices(pinched).tolist() == [7]


def test_bad_faces_and_vertices():
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [5, 5, 5]]
    faces = [[0, 1, 2, 3], [0, 1, 4], [2, 1, 0, 3], [0, 1, 1], [1, 4, 2]]
    coarse = prepare_mesh(PolygonMesh.from_faces(points, faces))
    assert inspection.degenerate_faces(coarse).tolist() == [1, 3]
    assert coarse.loops.source_faces[inspection.repeated_loops(coarse.loops)].tolist() == [2]
    assert inspection.unused_vertices(coarse.mesh).tolist() == [5]


def test_faces_marked_as_holes_are_not_degenerate():
    mesh = boxes((0, 0, 0)).with_(marks=Marks(hole_faces=np.array([2])))
    assert len(inspection.degenerate_faces(prepare_mesh(mesh))) == 0


def test_concave_faces():
    star = PolygonMesh.from_faces([[0, 0, 0], [2, -1, 0], [0, 2, 0], [-2, -1, 0]], [[0, 1, 2, 3]])
    assert inspection.concave_faces(prepare_mesh(star)).tolist() == [0]
    angles = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    disk = PolygonMesh.from_faces(np.stack([np.cos(angles), np.sin(angles), 0 * angles], 1), [list(range(100))])
    assert len(inspection.concave_faces(prepare_mesh(disk))) == 0  # many sides are no defect


def test_tilt_is_the_angle_of_the_sides_with_the_plane():
    rise = 0.1
    mesh = PolygonMesh.from_faces(
        [[0, 0, rise], [1, 0, -rise], [1, 1, rise], [0, 1, -rise]], [[0, 1, 2, 3]]
    )
    expected = np.degrees(np.arcsin(2 * rise / np.hypot(1, 2 * rise)))
    np.testing.assert_allclose(inspection.tilts(prepare_mesh(mesh)), [expected], rtol=1e-12)
    assert inspection.tilts(prepare_mesh(boxes((1e6, 0, 0)))).max() < 1e-9


def test_bends_leave_creases_out():
    coarse = prepare_mesh(boxes((0, 0, 0)))
    edges, angles = inspection.bends(coarse, inspection.sharp_edges(coarse))
    assert len(edges) == 12
    np.testing.assert_allclose(angles, 90)
    coarse = prepare_mesh(boxes((0, 0, 0)), MeshOptions(sharp_angle=45))
    assert len(inspection.bends(coarse, inspection.sharp_edges(coarse))[0]) == 0


def test_bends_of_a_smooth_surface_halve_with_its_cells():
    angles = []
    for around in (24, 48):
        coarse = prepare_mesh(torus(around, around))
        angles.append(inspection.bends(coarse, inspection.sharp_edges(coarse))[1].max())
    assert angles[0] / angles[1] == pytest.approx(2, rel=0.02)


def test_description():
    creases = Marks(crease_edges=np.array([[0, 1], [1, 3], [3, 2], [2, 0]]), crease_sharpness=np.ones((4, 2)))
    box = boxes((0, 0, 0), (2, 0, 0)).with_(marks=creases)
    found = inspection.describe(box)
    assert (found["vertices"], found["faces"], found["polygons"]) == (16, 12, {"4": 12})
    assert found["bounds"] == {"low": [0, 0, 0], "high": [3, 1, 1], "diagonal": pytest.approx(11**0.5)}
    assert found["marks"] == {"tags": {"crease": 4}}
    shape = found["shape"]
    assert (shape["edges"], shape["pieces"], shape["closed"], shape["genus"]) == (24, 2, True, 0)
    assert (shape["area"], shape["volume"], shape["creases"]) == (pytest.approx(12), pytest.approx(2), 4)
    assert inspection.describe(PolygonMesh.from_faces([[0, 0, 0]], []))["shape"] is None

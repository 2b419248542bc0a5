"""What goes to a device: positions, distinct normals, connectivity; vectors for sharp features only."""

from __future__ import annotations

import numpy as np
import pytest

import curvify
from agreement import creased
from curvify.mesh import PolygonMesh
from curvify.schemes.base import BezierEdges
from curvify.schemes.construction import Inputs, distinct_normals
from curvify.sectors import end_normals
from surfaces import mixed_ball, rotation, torus

SCHEMES = ["gregory", "pn", "phong", "png1"]


def inputs_of(surface: curvify.Surface) -> Inputs:
    """Inputs of the construction of a surface."""
    edges = surface.patches.edges
    assert isinstance(edges, BezierEdges)
    assert edges.construction is not None
    return edges.construction.inputs


def test_distinct_normals_are_those_of_each_vertex():
    vertices = np.array([4, 0, 4, 0, 4, 7])
    normals = np.eye(3)[[0, 1, 0, 2, 1, 1]]
    rows, which = distinct_normals(vertices, normals)
    assert len(rows) == 5  # the one of vertex 7 is its own, although vertices 0 and 4 have it too
    assert np.array_equal(rows[which], normals)
    assert which[0] == which[2]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_sides_name_ends_and_normals(scheme):
    surface = curvify.surface(creased(), scheme, sharp_from="normals")
    patches, found = surface.patches, inputs_of(surface)
    topology = patches.topology
    sides, backward = found.corners >> 1, found.corners & 1
    assert np.array_equal(sides, patches.side_field)
    assert np.array_equal(found.sides[sides, backward], topology.vertices)
    assert np.array_equal(found.normals[found.sides[sides, 2 + backward]], patches.normals)
    ends = end_normals(topology, patches.normals, np.arange(len(sides)))
    assert np.array_equal(found.normals[found.sides[sides, 2:]], ends)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("make", [mixed_ball, lambda: torus(8, 5)], ids=["ball", "torus"])
def test_smooth_meshes_need_no_further_vectors(make, scheme):
    found = inputs_of(curvify.surface(make(), scheme))
    assert (found.features == -1).all()
    assert found.vectors.size == 0


@pytest.mark.parametrize("scheme", SCHEMES)
def test_rims_and_creases_do(scheme):
    mesh = torus(8, 5)
    faces = [face.tolist() for face in np.split(mesh.face_vertices, mesh.face_offsets[1:-1])]
    surface = curvify.surface(PolygonMesh.from_faces(mesh.positions, faces[3:]), scheme)
    found, topology = inputs_of(surface), surface.topology
    told = np.zeros(len(topology.edges), dtype=bool)
    told[: len(topology.edges)] = found.features[: len(topology.edges)] >= 0
    at_rim = np.zeros(topology.vertex_count, dtype=bool)
    at_rim[topology.edges[~topology.interior]] = True
    assert told[~topology.interior].any()
    assert at_rim[topology.edges[told]].any(axis=1).all()
    assert np.array_equal(np.sort(found.features[found.features >= 0]), np.arange(len(found.vectors)))
    assert np.allclose(np.linalg.norm(found.vectors[:, :2], axis=2), 1)


def test_inputs_are_made_once_and_not_before_they_are_asked_for(monkeypatch):
    made = []
    surface = curvify.surface(torus(8, 5))
    edges = surface.patches.edges
    assert isinstance(edges, BezierEdges)
    construction = edges.construction
    assert construction is not None
    make = construction._make_inputs
    monkeypatch.setattr(construction, "_make_inputs", lambda: made.append(1) or make())
    surface.refine(2)
    assert made == []
    assert construction.inputs is construction.inputs
    assert made == [1]


def test_turned_meshes_have_the_same_connectivity():
    mesh = mixed_ball()
    faces = [face.tolist() for face in np.split(mesh.face_vertices, mesh.face_offsets[1:-1])]
    turned = PolygonMesh.from_faces(mesh.positions @ rotation(), faces)
    found = [inputs_of(curvify.surface(each)) for each in (mesh, turned)]
    for a, b in zip(*(np.sort(np.sort(inputs.sides[:, :2], axis=1), axis=0) for inputs in found), strict=True):
        assert np.array_equal(a, b)

"""One normal for every vertex of the dense mesh: creases keep their shape and are shaded smoothly."""

from __future__ import annotations

import numpy as np

from curvify.arrays import unit_rows
from curvify.mesh import Floats, Ints
from curvify.normals import sum_by, unit
from curvify.records import record, replaced
from curvify.schemes.base import Edges, Patches

#: Normals whose cosine is below this have no mean worth the name.
OPPOSITE = -0.99


@record
class MeanNormals:
    """Edges whose normals are the means of two fields: their own and ``others (E,)``, which may be the same."""

    edges: Edges
    others: Ints

    def points(self, edges: Ints, t: Floats) -> Floats:
        """Points ``(3,e,m)``."""
        return self.edges.points(edges, t)

    def normals(self, fields: Ints, t: Floats) -> Floats:
        """Unit normals ``(3,e,m)``."""
        result = self.edges.normals(fields, t)
        two = np.flatnonzero(self.others[fields] != fields)
        other = self.edges.normals(self.others[fields[two]], t[two] if t.ndim > 1 else t)
        result[:, two] = unit_rows(result[:, two] + other)
        return result


def weld_normals(patches: Patches) -> Patches:
    """The same surface with the normals of all sides of a vertex or edge averaged.

    At a vertex, the unit mean of its sectors' normals; along an edge, that of its faces' normals. Where two normals are
    opposite, as on the rim of a leaf, the first one stays.
    """
    topology = patches.topology
    first, last = topology.first, topology.last
    fields = np.arange(len(topology.edges))
    others = patches.side_field[last]
    split = np.flatnonzero(patches.side_field[first] != others)
    ends = np.array([0.0, 1.0])
    cosine = np.einsum("cem,cem->em", patches.edges.normals(split, ends), patches.edges.normals(others[split], ends))
    others = fields.copy()
    kept = split[(cosine >= OPPOSITE).all(axis=1)]
    others[kept] = patches.side_field[last[kept]]
    return replaced(
        patches,
        edges=MeanNormals(patches.edges, others),
        side_field=topology.edge.copy(),
        normals=_vertex_normals(patches),
    )


def _vertex_normals(patches: Patches) -> Floats:
    """Mean ``(C,3)`` of the distinct normals at the vertex of each corner."""
    vertices, normals = patches.topology.vertices, patches.normals
    order = np.lexsort((*normals.T, vertices))
    fresh = np.ones(len(order), dtype=bool)
    same = (normals[order][1:] == normals[order][:-1]).all(axis=1) & (vertices[order][1:] == vertices[order][:-1])
    fresh[1:] = ~same
    kept = order[fresh]
    total = sum_by(vertices[kept], normals[kept], patches.topology.vertex_count)
    mean = unit(total)
    lead = np.zeros_like(total)
    lead[vertices[::-1]] = normals[::-1]
    weak = np.linalg.norm(total, axis=1) < 0.1
    mean[weak] = lead[weak]
    alone = np.bincount(vertices[kept], minlength=len(mean)) < 2
    mean[alone] = lead[alone]
    result: Floats = mean[vertices]
    return result

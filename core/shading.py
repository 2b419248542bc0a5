"""One normal for every vertex of the dense mesh: creases keep their shape and are shaded smoothly."""

from __future__ import annotations

import numpy as np

from curvify.mesh import Floats
from curvify.normals import dot, sum_by, unit
from curvify.records import replaced
from curvify.schemes.base import Patches
from curvify.sectors import sides_of_edges

#: Normals whose cosine is below this have no mean worth the name.
OPPOSITE = -0.99


def weld_normals(patches: Patches) -> Patches:
    """The same surface with the normals of all sides of a vertex or edge averaged.

    At a vertex, the unit mean of its sectors' normals; along an edge, the sum of its faces' normal fields, which have
    equal lengths at its ends. Where two normals are opposite, as on the rim of a leaf, the first one stays.
    """
    topology = patches.topology
    first, last = sides_of_edges(topology)
    edges = np.flatnonzero(patches.side_field[first] != patches.side_field[last])
    fields = patches.fields.copy()
    total = fields[:, patches.side_field[first[edges]]] + fields[:, patches.side_field[last[edges]]]
    own = np.moveaxis(fields[:, edges][..., [0, -1]], 0, -1)
    other = np.moveaxis(fields[:, patches.side_field[last[edges]]][..., [0, -1]], 0, -1)
    agreement = dot(unit(own), unit(other)).min(axis=(1, 2))
    fields[:, edges] = np.where((agreement < OPPOSITE)[:, None], fields[:, edges], total)
    normals = _vertex_normals(patches)
    return replaced(patches, fields=fields, side_field=topology.edge.copy(), normals=normals)


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

"""How far patches are from a dense mesh: the residuals of a fit.

*Forward*: from samples of the patches to their nearest points on the dense mesh. *Reverse*: from samples of the dense
mesh to the tessellated patches, along the normals there; half of the way from a triangle to the planes at its corners
takes away most of the tessellation's error (Boubekeur and Alexa, "Phong tessellation", 2008). *Folds*: what patches
lack of opening by 8 degrees at their corners and along their sides, and what corners of polygons lack of turning by one
degree: `refine` cuts polygons that fold or are not convex. Weighted and squared they add up to a mean square distance
over the diagonal's square.
"""

from __future__ import annotations

import numpy as np

from curvify.arrays import cross
from curvify.mesh import Floats, Ints
from curvify.nearest import Nearest, places_on, spread
from curvify.normals import unit
from curvify.polygons import REFLEX
from curvify.records import record
from curvify.simplify.folds import LEAST_SINE
from curvify.simplify.model import Model, Samples
from curvify.simplify.triangles import Triangles

#: Samples of the dense mesh for each patch, the least and the most in all; what all weigh against the patches' samples.
REVERSE_SAMPLES, LEAST_SAMPLES, MOST_SAMPLES = 50, 2_000, 20_000
REVERSE_WEIGHT = 0.5
#: Sine with which patches should open, and the weight of what they lack.
OPEN, BARRIER = float(np.sin(np.radians(8.0))), 0.3
#: Sine with which corners of polygons should turn (1 degree), and the least that is asked for anywhere.
TURN, BARELY = 0.0175, 0.005
#: Closer than this share of the diagonal, the dense face's normal is the direction.
TOUCHING = 1e-9
#: A sample farther than this share of the mean edge, less than so much of it along the normal, lies beyond an edge.
FAR, ALONG_NORMAL = 0.05, 0.7


@record
class Target:
    """The dense mesh: ``nearest`` points on it, ``samples (m,3)`` spread over it."""

    dense: Triangles
    nearest: Nearest
    samples: Floats

    @classmethod
    def of(cls, dense: Triangles, samples: int) -> Target:
        """The target with so many samples."""
        faces, weights = spread(dense.positions, dense.vertices, samples)
        places = places_on(dense.positions, dense.vertices[faces], weights)
        return cls(dense, Nearest.of(dense.positions, dense.vertices), places)

    @classmethod
    def for_patches(cls, dense: Triangles, count: int) -> Target:
        """The target for so many patches."""
        return cls.of(dense, min(max(REVERSE_SAMPLES * count, LEAST_SAMPLES), MOST_SAMPLES))


@record
class Weights:
    """Square roots of the weights of forward ``(M,)``, reverse ``(m,)`` and fold residuals ``(C,)``; the ``least``
    sines ``(C,3)`` that openings should have, and the ``limit (C,3)`` that they must keep.
    """

    forward: Floats
    reverse: Floats
    fold: Floats
    least: Floats
    limit: Floats

    @classmethod
    def of(cls, model: Model, target: Target) -> Weights:
        """Patches count by their area at the start; where nothing may change, folds do not."""
        topology, scale = model.topology, 1 / target.dense.diagonal
        area = face_areas(model)
        share = area / area.sum()
        sizes = 6 * topology.sizes + 1
        forward = (share / sizes)[model.sample_faces]
        reverse = np.full(len(target.samples), REVERSE_WEIGHT / max(len(target.samples), 1))
        fold = BARRIER * model.edge_length * np.sqrt((share / topology.sizes)[topology.faces])
        fold[~model.free_faces[topology.faces]] = 0.0
        least, limit = _openings(model)
        return cls(scale * np.sqrt(forward), scale * np.sqrt(reverse), scale * fold, least, limit)


def _openings(model: Model) -> tuple[Floats, Floats]:
    """The sines ``(C,3)`` with which patches should open and polygons turn, and the limits that steps must keep.

    Corners between two creases or boundaries, sides beside them and corners of polygons may be as straight as they are.
    """
    sines, line = model.openings(model.start).sines, np.empty(len(model.topology.vertices), dtype=bool)
    for group in model.groups:
        sharp = group.apart.sharp.any(axis=2) | ~group.apart.interior
        line[group.apart.corners] = sharp & np.roll(sharp, 1, axis=1)
    line &= sines[:, 0] < OPEN
    beside = line | line[model.topology.next]
    may = np.stack([line, beside, np.ones_like(line)], axis=1)
    most = np.array([OPEN, OPEN, TURN])
    least = np.where(may, np.clip(sines, BARELY, most), most)
    limit = np.zeros_like(least)
    limit[:, 0] = np.where(line, -LEAST_SINE, LEAST_SINE)
    limit[:, 2] = -REFLEX / 2
    return least, limit


def face_areas(model: Model) -> Floats:
    """Area of each piece ``(F,)`` at the start, as triangles about the mean of its corners."""
    topology, points = model.topology, model.start.positions[model.topology.vertices]
    middle = np.add.reduceat(points, topology.offsets[:-1]) / topology.sizes[:, None]
    legs = points - middle[topology.faces]
    return np.add.reduceat(np.linalg.norm(cross(legs, legs[topology.next]), axis=1) / 2, topology.offsets[:-1])


@record
class Residuals:
    """Weighted residuals of a state.

    ``forward (M,)``, which grow as samples move along ``directions (M,3)``; ``reverse (m,)``, which shrink as the
    samples ``corners (m,3)`` of a patch move along ``pulls (m,3,3)``; ``folds (C,3)``, which count where positive, and
    ``fold_weights (C,)``, by which they shrink as sines grow.
    """

    forward: Floats
    directions: Floats
    reverse: Floats
    corners: Ints
    pulls: Floats
    folds: Floats
    fold_weights: Floats

    @property
    def total(self) -> float:
        """Sum of the squares."""
        lack = np.maximum(self.folds, 0.0)
        return float(self.forward @ self.forward + self.reverse @ self.reverse + (lack**2).sum())

    def by_face(self, model: Model) -> Floats:
        """Sum of the squares ``(F,)`` that belong to each piece."""
        total = np.zeros(model.face_count)
        np.add.at(total, model.sample_faces, self.forward**2)
        np.add.at(total, model.sample_faces[self.corners[:, 0]], self.reverse**2)
        np.add.at(total, model.topology.faces, (np.maximum(self.folds, 0.0) ** 2).sum(axis=1))
        return total


def residuals(model: Model, target: Target, weights: Weights, samples: Samples) -> Residuals:
    """Residuals of samples, from where the nearest points are now."""
    distance, face, foot = target.nearest(samples.points)
    away = samples.points - foot
    close = distance < TOUCHING * target.dense.diagonal
    directions = np.where(close[:, None], target.dense.normals[face], away / np.where(close, 1.0, distance)[:, None])
    forward = np.einsum("mi,mi->m", directions, away)
    reverse, corners, pulls = _reverse(model, target, samples)
    return Residuals(
        weights.forward * forward,
        weights.forward[:, None] * directions,
        weights.reverse * reverse,
        corners,
        weights.reverse[:, None, None] * pulls,
        weights.fold[:, None] * (weights.least - samples.openings.sines),
        weights.fold,
    )


def _reverse(model: Model, target: Target, samples: Samples) -> tuple[Floats, Ints, Floats]:
    """From the dense mesh to the patches: residuals ``(m,)``, corners of the triangle hit, and what moves them."""
    if not len(target.samples):
        return np.zeros(0), np.zeros((0, 3), dtype=np.int64), np.zeros((0, 3, 3))
    distance, hit, place = Nearest.of(samples.points, model.triangles)(target.samples)
    corners = model.triangles[hit]
    at, normals = samples.points[corners], samples.normals[corners]
    share = barycentric(place, at)
    middle = unit(np.einsum("mk,mki->mi", share, normals))
    step = target.samples - place
    over = np.einsum("mki,mki->mk", target.samples[:, None] - at, normals)
    found = (np.einsum("mi,mi->m", step, middle) + np.einsum("mk,mk->m", share, over)) / 2
    pulls = share[:, :, None] * (middle[:, None] + normals) / 2
    bare = (distance > FAR * model.edge_length) & (np.abs(found) < ALONG_NORMAL * distance)
    found[bare] = distance[bare]
    pulls[bare] = share[bare, :, None] * (step[bare] / distance[bare, None])[:, None]
    return found, corners, pulls


def barycentric(places: Floats, corners: Floats) -> Floats:
    """Weights ``(m,3)`` of the ``corners (m,3,3)`` of triangles at places on them ``(m,3)``."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = cross(b - a, c - a)
    square = np.maximum(np.einsum("mi,mi->m", normal, normal), 1e-300)
    v = np.einsum("mi,mi->m", cross(places - a, c - a), normal) / square
    w = np.einsum("mi,mi->m", cross(b - a, places - a), normal) / square
    share = np.clip(np.stack([1 - v - w, v, w], axis=1), 0.0, 1.0)
    return share / share.sum(axis=1, keepdims=True)

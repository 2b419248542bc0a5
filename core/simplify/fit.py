"""Fit a coarse mesh to a dense one, so that the refinement of the coarse one comes back to it.

Refining interpolates positions and normals. The fit chooses those for which the refined patches, not the polygons, are
closest to the dense mesh: mode ``normals`` tilts the normals only, ``full`` moves vertices too, which then leave the
dense mesh. Polygons that fold are cut after the first part of it, those that err most are given company, and then all
are fitted on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from curvify.errors import OptionError
from curvify.mesh import Floats, PolygonMesh
from curvify.pieces import pieces_of, split_mesh
from curvify.prepare import prepare_mesh
from curvify.schemes.gregory import Options, patchwork_of
from curvify.simplify.adapt import add_where_worst, face_errors
from curvify.simplify.checks import check_near
from curvify.simplify.folds import unfold
from curvify.simplify.hold import held_back
from curvify.simplify.model import build_model
from curvify.simplify.relax import relax_folded
from curvify.simplify.residuals import Target
from curvify.simplify.slots import Unknowns
from curvify.simplify.solver import solve
from curvify.simplify.triangles import Triangles

MODES = ("none", "normals", "full")
#: Steps at first, and after polygons were cut.
STEPS, LAST_STEPS = 8, 3
#: How often polygons are added until a largest error holds.
ROUNDS = 5

#: Told what is being done, and the share of the fit that is behind.
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Fit:
    """How to fit: ``mode``; with ``budget`` faces may be cut until there are so many; ``max_error`` is the distance
    that patches should keep, as a share of the diagonal. ``options`` are those that the mesh will be refined with.
    """

    mode: str = "full"
    budget: int | None = None
    max_error: float | None = None
    options: Options = field(default_factory=Options)

    def __post_init__(self) -> None:
        if self.mode not in MODES:
            raise OptionError(f"fit must be one of {', '.join(MODES)}, not {self.mode!r}")
        if self.max_error is not None and not self.max_error > 0:
            raise OptionError(f"the largest error must be above 0, not {self.max_error}")
        if self.max_error is not None and self.mode == "none":
            raise OptionError("a largest error needs a fit; choose normals or full")
        if self.options.cross_tangent not in ("precise", "smooth"):
            raise OptionError(f"no fit is made for {self.options.cross_tangent!r} cross tangents")


@dataclass(eq=False)
class Fitted:
    """A fitted mesh; the root mean square residual, as a share of the diagonal, in the ``history`` of each part of the
    fit: before its first step and after every step; ``largest`` the largest error, where that was asked for.
    """

    mesh: PolygonMesh
    history: list[list[float]]
    largest: float | None = None


def fit_mesh(mesh: PolygonMesh, dense: Triangles, fit: Fit, progress: Progress | None = None) -> Fitted:
    """Fit a coarse mesh to a dense one. Without a budget the faces stay as they are.

    Raises MeshError for edges of more than two faces, and for meshes that have nothing to do with each other.
    """
    if fit.mode == "none":
        return Fitted(mesh, [])
    check_near(mesh, dense)
    target = Target.for_patches(dense, mesh.face_count)
    return _Fitting(fit, dense, target, progress or (lambda stage, share: None)).run(mesh)


@dataclass(eq=False)
class _Fitting:
    """A fit while it runs."""

    fit: Fit
    dense: Triangles
    target: Target
    tell: Progress
    history: list[list[float]] = field(default_factory=list)
    steps: int = 0

    def run(self, mesh: PolygonMesh) -> Fitted:
        if self.fit.budget is None:
            return Fitted(self._solved(mesh, STEPS), self.history)
        mesh = self._as_refined(self._whole(self._solved(mesh, STEPS)))
        if self.fit.max_error is None:
            mesh = self._added(mesh, self._errors(mesh), 0.0)
            return Fitted(self._finished(mesh), self.history)
        return self._held(mesh, self.fit.max_error * self.dense.diagonal)

    def _held(self, mesh: PolygonMesh, limit: float) -> Fitted:
        """Add polygons and fit on until the largest error is below the limit or the budget is spent: the best mesh."""
        found = []
        for _ in range(ROUNDS):
            errors = self._errors(mesh)
            found.append((float(errors.max()), mesh))
            more = self._added(mesh, errors, limit)
            if errors.max() <= limit or more is mesh:
                break
            mesh = self._finished(more)
        largest, mesh = min(found, key=lambda pair: pair[0])
        return Fitted(mesh, self.history, largest / self.dense.diagonal)

    def _finished(self, mesh: PolygonMesh) -> PolygonMesh:
        """The mesh after the last steps, with as few folds as can be."""
        return relax_folded(self._whole(self._solved(mesh, LAST_STEPS)), self._errors)

    def _errors(self, mesh: PolygonMesh) -> Floats:
        """The largest distance ``(F,)`` of each polygon's refinement."""
        return face_errors(mesh, self.dense, self.fit.options)

    def _added(self, mesh: PolygonMesh, errors: Floats, limit: float) -> PolygonMesh:
        room = (self.fit.budget or 0) - mesh.face_count
        more = add_where_worst(mesh, errors, limit, room, self.fit.options)
        if self.fit.mode == "normals" and more is not mesh:  # all vertices lie on the dense mesh
            first = mesh.vertex_count
            places = self.target.nearest(more.positions[first:])[2]
            return more.with_(positions=np.concatenate([mesh.positions, places]))
        return more

    def _solved(self, mesh: PolygonMesh, steps: int) -> PolygonMesh:
        """The mesh after some steps."""
        model = build_model(mesh, self.fit.options)
        free = model.free_vertices if self.fit.mode == "full" else np.zeros_like(model.free_vertices)
        solution = solve(model, self.target, Unknowns.of(free, model.free_sectors), steps, self._report)
        self.history.append(solution.history)
        found = model.mesh(solution.state)
        return held_back(mesh, found, self.fit.options.split_rule, cut=self.fit.budget is not None)

    def _report(self, residual: float) -> None:
        self.steps += 1
        self.tell(f"fit, {100 * residual:.4f} %", min(self.steps / (STEPS + LAST_STEPS), 1.0))

    def _whole(self, mesh: PolygonMesh) -> PolygonMesh:
        """The mesh with convex polygons that do not fold, as far as cuts can help."""
        return unfold(split_mesh(mesh, self.fit.options.split_rule)[0]).mesh

    def _as_refined(self, mesh: PolygonMesh) -> PolygonMesh:
        """The mesh with its polygons cut as the refiner cuts them, so that what is fitted is what will be refined."""
        options = replace(self.fit.options, weld="never")
        return pieces_of(mesh, patchwork_of(prepare_mesh(mesh, options), options).split)

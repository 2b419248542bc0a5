"""Residuals as linear functions of the unknowns, and the step that minimizes their squares.

Fold residuals count only where they are positive: the step is sought with those that are, the next one from the same
place with those that would be after it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from curvify.mesh import Bools, Floats, Ints
from curvify.records import record
from curvify.simplify.model import Group, Model, State
from curvify.simplify.residuals import Residuals
from curvify.simplify.slots import Derivatives, Unknowns, derivatives


@record
class Linear:
    """Residuals r + J x for unknowns x: ``hessian`` J^T J and ``gradient`` J^T r of the distances; ``folds (R,n)`` and
    ``lack (R,)``, J and r of the openings of ``corners (R/3,)``, three each; which of them are ``active (R,)``.
    """

    hessian: Any
    gradient: Floats
    folds: Any
    lack: Floats
    corners: Ints
    active: Bools

    def gain(self, step: Floats) -> float:
        """By how much a step should lower the sum of the squares."""
        before, after = np.maximum(0.0, self.lack), np.maximum(0.0, self.lack + self.folds @ step)
        distances = 2 * self.gradient @ step + step @ (self.hessian @ step)
        return float(before @ before - after @ after - distances)

    def step(self, damping: Floats, stiffness: Floats | None = None) -> Floats:
        """The step ``(n,)`` that minimizes the squares and x^T D x, for ``damping (n,)`` the diagonal of D.

        ``stiffness (C,3)`` are factors on the weights of openings. Those count that lack something now, or would have
        after the step before. A direct solution: with minimum degree ordering as fast as conjugate gradients to three
        digits, and it does not depend on the damping.
        """
        from scipy.sparse import diags_array
        from scipy.sparse.linalg import splu

        factors = np.ones_like(self.lack) if stiffness is None else stiffness[self.corners].ravel()
        factors = factors * self.active
        rows = diags_array(factors) @ self.folds
        matrix = (self.hessian + rows.T @ rows + diags_array(damping)).tocsc()
        options = {"SymmetricMode": True}
        solved = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
        step = -solved.solve(self.gradient + rows.T @ (factors * self.lack))
        self.active = self.lack + self.folds @ step > 0
        return np.asarray(step)


@record
class Rows:
    """Rows of a sparse matrix: ``values``, ``columns (m,k)``, -1 where there is none, and the right sides ``(m,)``."""

    values: list[Floats]
    columns: list[Ints]
    right: list[Floats]

    def add(self, values: Floats, columns: Ints, right: Floats) -> None:
        """More rows."""
        self.values.append(values)
        self.columns.append(columns)
        self.right.append(right)

    def matrix(self, count: int) -> tuple[Any, Floats]:
        """The matrix with ``count`` columns, and the right sides."""
        from scipy.sparse import csr_array

        used = [columns >= 0 for columns in self.columns]
        ends = np.cumsum(np.concatenate([[0], *(mask.sum(axis=1) for mask in used)]))
        values = np.concatenate([part[mask] for part, mask in zip(self.values, used, strict=True)])
        columns = np.concatenate([part[mask] for part, mask in zip(self.columns, used, strict=True)])
        return csr_array((values, columns, ends), shape=(len(ends) - 1, count)), np.concatenate(self.right)


def linearized(model: Model, state: State, found: Residuals, unknowns: Unknowns) -> Linear:
    """Residuals as linear functions of the unknowns about a state."""
    distances, folds, corners = Rows([], [], []), Rows([], [], []), []
    for group in model.groups:
        by = derivatives(model, group, state, unknowns)
        if by is not None:
            _add_forward(distances, group, by, found)
            _add_reverse(distances, group, by, found)
            _add_folds(folds, group, by, found)
            corners.append(group.apart.corners.ravel())
    jacobian, right = distances.matrix(unknowns.count)
    by_folds, lack = folds.matrix(unknowns.count)
    normal = (jacobian.T @ jacobian).tocsc()
    return Linear(normal, jacobian.T @ right, by_folds, lack, np.concatenate(corners), lack > 0)


def _add_forward(rows: Rows, group: Group, by: Derivatives, found: Residuals) -> None:
    count, size, _, slots = by.points.shape
    direction = found.directions[group.rows].reshape(count, size, 3)
    values = np.einsum("fsi,fsik->fsk", direction, by.points, optimize=True).reshape(-1, slots)
    rows.add(values, np.repeat(by.unknowns, size, axis=0), found.forward[group.rows])


def _add_reverse(rows: Rows, group: Group, by: Derivatives, found: Residuals) -> None:
    size = group.sample_count
    first = found.corners[:, 0]
    mine = np.flatnonzero((first >= group.rows.start) & (first < group.rows.stop))
    local = found.corners[mine] - group.first
    face = local[:, 0] // size
    values = np.zeros((len(mine), by.unknowns.shape[1]))
    for k in range(3):
        values -= np.einsum("mi,mik->mk", found.pulls[mine, k], by.points[face, local[:, k] % size])
    rows.add(values, by.unknowns[face], found.reverse[mine])


def _add_folds(rows: Rows, group: Group, by: Derivatives, found: Residuals) -> None:
    count, sides, _, slots = by.sines.shape
    corners = group.apart.corners.ravel()
    values = -found.fold_weights[corners, None, None] * by.sines.reshape(count * sides, 3, slots)
    columns = np.repeat(by.unknowns, 3 * sides, axis=0)
    rows.add(values.reshape(-1, slots), columns, found.folds[corners].ravel())

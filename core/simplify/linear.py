"""Residuals as linear functions of the unknowns, and the step that minimizes their squares.

Fold residuals count only where they are positive: the step is sought with those that are, and again with those that
would be after it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from curvify.mesh import Bools, Floats, Ints
from curvify.records import record
from curvify.simplify.model import Group, Model, State
from curvify.simplify.residuals import Residuals
from curvify.simplify.slots import Derivatives, Unknowns, derivatives

#: Times that the set of corners that would fold is found anew.
ROUNDS = 4


@record
class Linear:
    """Residuals r + J x for unknowns x: ``hessian`` J^T J and ``gradient`` J^T r of the distances; ``folds (C,n)`` and
    ``lack (C,)``, J and r of the folds.
    """

    hessian: Any
    gradient: Floats
    folds: Any
    lack: Floats

    def gain(self, step: Floats) -> float:
        """By how much a step should lower the sum of the squares."""
        before, after = np.maximum(0.0, self.lack), np.maximum(0.0, self.lack + self.folds @ step)
        distances = 2 * self.gradient @ step + step @ (self.hessian @ step)
        return float(before @ before - after @ after - distances)

    def step(self, damping: Floats) -> Floats:
        """The step ``(n,)`` that minimizes the squares and x^T D x, for ``damping (n,)`` the diagonal of D."""
        active = self.lack > 0
        for _ in range(ROUNDS):
            step = self._step(damping, active)
            positive = self.lack + self.folds @ step > 0
            if np.array_equal(positive, active):
                break
            active = positive
        return step

    def _step(self, damping: Floats, active: Bools) -> Floats:
        """The same with just the folds ``active (C,)``.

        A direct solution: with minimum degree ordering as fast as conjugate gradients to three digits, and it does not
        depend on the damping.
        """
        from scipy.sparse import diags_array
        from scipy.sparse.linalg import splu

        rows = self.folds[active]
        matrix = (self.hessian + rows.T @ rows + diags_array(damping)).tocsc()
        options = {"SymmetricMode": True}
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
        return -factors.solve(self.gradient + rows.T @ self.lack[active])


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
    distances, folds = Rows([], [], []), Rows([], [], [])
    for group in model.groups:
        by = derivatives(model, group, state, unknowns)
        if by is not None:
            _add_forward(distances, group, by, found)
            _add_reverse(distances, group, by, found)
            _add_folds(folds, group, by, found)
    jacobian, right = distances.matrix(unknowns.count)
    return Linear((jacobian.T @ jacobian).tocsc(), jacobian.T @ right, *folds.matrix(unknowns.count))


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
    count, sides, slots = by.sines.shape
    corners = group.apart.corners.ravel()
    values = -found.fold_weights[corners, None] * by.sines.reshape(count * sides, slots)
    rows.add(values, np.repeat(by.unknowns, sides, axis=0), found.folds[corners])

"""The GPU backend: the tables and control vectors of the CPU's, multiplied on the device in single precision.

Points are taken relative to an origin near each patch, which is added again when they come back, so that neither the
size of a mesh nor its place costs digits. What single precision cannot do (normals where derivatives are nearly
parallel, side fields that no number of Chebyshev points describes) is left to the CPU, patch by patch.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from curvify import evaluate
from curvify.errors import DeviceError
from curvify.gpu.products import Products, Singles, Table, pack_columns
from curvify.gpu.programs import NORMALS, UNIT, VALUES, Kind
from curvify.mesh import Bools, Floats, Ints
from curvify.sampling import Sampling
from curvify.schemes.base import Form, PatchClass, Patches, bernstein_basis

#: Numbers of Chebyshev points tried, fewest first.
NODE_COUNTS = (8, 12, 16, 24, 32, 48)
#: What may be left out of the series of a side field, over its length: as much as single precision rounds away.
SERIES_TOLERANCE = 1e-7


class GpuBackend:
    """Evaluates on an OpenGL device; a context manager. Results are the same each time on the same device."""

    name = "gpu"

    def __init__(self, software: bool = True) -> None:
        """Open a device; ``software`` allows one that is a program. Raises DeviceError where there is none."""
        self.products = Products()
        self.device = self.products.device
        if not (software or self.device.hardware):
            self.close()
            raise DeviceError(f"{self.device.renderer} is no GPU")

    def __enter__(self) -> GpuBackend:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the device."""
        self.products.close()

    @property
    def bytes_sent(self) -> int:
        """Bytes sent to the device so far."""
        return self.products.sent

    def describe(self) -> dict[str, Any]:
        """Name and device."""
        names = ("vendor", "renderer", "version", "hardware", "compute")
        return {"name": self.name} | {name: getattr(self.device, name) for name in names}

    def edges(self, curves: Floats, fields: Floats, t: Floats) -> tuple[Floats, Floats]:
        """Positions and unit normals ``(3,e,m)`` at ``t (m,)`` on edges, as ``evaluate.edge_points``."""
        if not len(t):
            return np.empty((3, curves.shape[1], 0)), np.empty((3, fields.shape[1], 0))
        columns, origin = _columns(curves, np.empty((3, curves.shape[1], 0, 0)), curves.shape[2])
        local = self.products.multiply(VALUES, _edge_table(curves.shape[2], t), columns)
        normals = self.products.multiply(UNIT, _edge_table(fields.shape[2], t), pack_columns(fields))
        positions = local.astype(np.float64) + origin[:, None]
        result = normals.astype(np.float64).transpose(2, 0, 1)
        lost = np.flatnonzero(~normals.any(axis=2).all(axis=1))
        if len(lost):
            result[:, lost] = evaluate.edge_normals(fields[:, lost], t)
        return positions.transpose(2, 0, 1), result

    def fill_patches(
        self,
        patches: Patches,
        patch_class: PatchClass,
        rows: Ints,
        sampling: Sampling,
        level: int,
        tolerance: float,
        positions: Floats,
        normals: Floats,
    ) -> None:
        """Write into ``positions`` and ``normals (f,S,3)``, as ``evaluate.fill_patches`` does."""
        if not len(sampling.points):
            return
        fill = partial(self._fill, rows=rows, points=sampling.points, grid=(patch_class.sides, level))
        if patch_class.normals is None:
            left = fill(patch_class.surface, NORMALS, targets=(positions, normals))
        else:
            left = fill(patch_class.surface, VALUES, targets=(positions,))
            left |= fill(patch_class.normals, UNIT, targets=(normals,))
        left |= ~normals.any(axis=2).all(axis=1)
        if left.any():
            part = np.flatnonzero(left)
            exact = np.empty((2, len(part), *positions.shape[1:]))
            evaluate.fill_patches(patches, patch_class, rows[part], sampling, level, tolerance, exact[0], exact[1])
            positions[part], normals[part] = exact

    def _fill(
        self,
        form: Form,
        kind: Kind,
        *,
        rows: Ints,
        points: Floats,
        grid: tuple[int, int],
        targets: tuple[Floats, ...],
    ) -> Bools:
        """Write what a form gives into ``targets (f,S,3)``; returns which patches ``(f,)`` are left for the CPU."""
        left = np.arange(len(rows))
        controls = form.controls(rows)
        for count in NODE_COUNTS:
            nodes = controls.fields(evaluate.chebyshev_points(count))
            fields = nodes.shape[2] > 0
            enough = evaluate.enough_points(nodes, SERIES_TOLERANCE) if fields else np.ones(len(left), dtype=bool)
            part = np.flatnonzero(enough)
            if len(part):
                columns, origin = _columns(controls.linear[:, part], nodes[:, part], form.points)
                for block in evaluate.tables(form, points, grid, count, kind.orders):
                    table = _block_table(form, grid, count, block)
                    values = self.products.multiply(kind, table, columns)
                    _store(targets, left[part], slice(block.first, block.last), values, origin)
            left = left[~enough]
            if not len(left):
                break
            controls = controls.take(np.flatnonzero(~enough))
        return np.isin(np.arange(len(rows)), left)


def _columns(linear: Floats, nodes: Floats, points: int) -> tuple[Singles, Singles]:
    """Columns ``(f,3,K)`` of control vectors ``(3,f,L)`` and field values, and the origins ``(f,3)`` of the points.

    Origins are the first control vectors in single precision, so that the sum with them rounds once.
    """
    origin = linear[..., 0].T.astype(np.float32) if points else np.zeros((linear.shape[1], 3), dtype=np.float32)
    local = linear.copy()
    local[..., :points] -= origin.T[..., None]
    return pack_columns(local, nodes), origin


def _block_table(form: Form, grid: tuple[int, int], count: int, block: evaluate.Tables) -> Table:
    """A block of a form's tables, under a name for the device."""
    assert block.matrix is not None
    samples = block.last - block.first
    orders = block.matrix.shape[1] // samples
    return Table((form.key, grid, count, orders, block.first), samples, block.matrix)


def _edge_table(points: int, t: Floats) -> Table:
    """Bernstein polynomials ``(d+1, m)`` at the abscissae of edges."""
    return Table(("edge", points, t.tobytes()), len(t), bernstein_basis(points - 1, t))


def _store(targets: tuple[Floats, ...], rows: Ints, samples: slice, values: Singles, origin: Singles) -> None:
    """Write results ``(f,s,3)`` or ``(f,s,6)`` to some rows and samples of ``targets (F,S,3)``."""
    together = rows[-1] - rows[0] == len(rows) - 1
    place = (slice(rows[0], rows[-1] + 1) if together else rows, samples)
    targets[0][place] = values[..., :3] + origin[:, None].astype(targets[0].dtype)
    for target in targets[1:]:
        target[place] = values[..., 3:]

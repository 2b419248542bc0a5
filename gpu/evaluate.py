"""The GPU backend: the tables and control vectors of the CPU's, multiplied on the device in single precision.

Points are taken relative to an origin near each patch, which is added again when they come back, so that neither the
size of a mesh nor its place costs digits. What single precision cannot do (normals where derivatives are nearly
parallel, side fields that no number of Chebyshev points describes) is left to the CPU, patch by patch.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from curvify import evaluate, tables
from curvify.arrays import as_slice
from curvify.errors import DeviceError
from curvify.gpu.blend import BlendDevice
from curvify.gpu.products import Products, Singles, Table, pack_columns, restored
from curvify.gpu.programs import NORMALS, UNIT, VALUES, Kind
from curvify.mesh import Bools, Floats, Ints
from curvify.sampling import Sampling
from curvify.schemes.base import BezierEdges, Edges, Form, KiteForms, PatchClass, Patches, bernstein_basis
from curvify.schemes.blend_network import BlendEdges

#: Numbers of Chebyshev points tried, fewest first.
NODE_COUNTS = (8, 12, 16, 24, 32, 48)
#: What may be left out of the series of a side field, over its length: as much as single precision rounds away.
SERIES_TOLERANCE = 1e-7


@dataclass(frozen=True, eq=False)
class Vectors:
    """Vectors of some patches in single precision: ``columns (f,3,K)``, relative to ``origin (f,3)`` where they are
    points, over ``scale``.
    """

    columns: Singles
    scale: float
    origin: Floats

    @classmethod
    def pack(cls, linear: Floats, points: int, nodes: Floats | None = None) -> Vectors:
        """Of control vectors ``(3,f,L)``, the first ``points`` of which are points, and field values ``(3,f,n,m)``.

        The origin is the first point in single precision: a result in single precision is then rounded only once.
        """
        patches = linear.shape[1]
        origin = np.zeros((3, patches))
        if points:
            origin = linear[..., 0].astype(np.float32).astype(np.float64)
            linear = np.concatenate([linear[..., :points] - origin[..., None], linear[..., points:]], axis=2)
        fields = [] if nodes is None else [nodes.reshape(3, patches, nodes.shape[2] * nodes.shape[3])]
        columns, scale = pack_columns(linear, *fields)
        return cls(columns, scale, origin.T)

    def restore(self, values: Singles, dtype: np.dtype[Any]) -> Floats:
        """Points ``(f,S,3)`` in a type, from what was computed with the columns."""
        return restored(values, self.origin, self.scale, dtype)


class GpuBackend:
    """Evaluates on an OpenGL device; a context manager. Results are the same each time on the same device."""

    name = "gpu"

    def __init__(self, software: bool = True) -> None:
        """Open a device; ``software`` allows one that is a program. Raises DeviceError where there is none."""
        self.products = Products()
        self.device = self.products.device
        self.blend = BlendDevice(self.products)
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
        return self.products.bytes_sent

    def describe(self) -> dict[str, Any]:
        """Name and device."""
        names = ("vendor", "renderer", "version", "hardware", "compute")
        return {"name": self.name} | {name: getattr(self.device, name) for name in names}

    def edges(self, edges: Edges, ids: Ints, fields: Ints, t: Floats) -> tuple[Floats, Floats]:
        """Positions and unit normals ``(3,e,m)`` at ``t (m,)`` on edges ``ids (e,)`` with normal fields ``(e,)``; those
        that are neither Bezier curves nor of blending surfaces on the processor.
        """
        if len(t) and isinstance(edges, BezierEdges):
            positions, normals = self._bezier_edges(edges, ids, fields, t)
        elif len(t) and isinstance(edges, BlendEdges):
            positions, normals = self.blend.edges(edges, ids, fields, t)
        else:
            return edges.points(ids, t), edges.normals(fields, t)
        result = normals.astype(np.float64).transpose(2, 0, 1)
        lost = np.flatnonzero(_without_normal(normals))
        if len(lost):
            result[:, lost] = edges.normals(fields[lost], t)
        return positions.transpose(2, 0, 1), result

    def _bezier_edges(self, edges: BezierEdges, ids: Ints, fields: Ints, t: Floats) -> tuple[Floats, Singles]:
        """Positions and unit normals ``(e,m,3)``."""
        curves, lines = edges.curves[:, as_slice(ids)], edges.fields[:, as_slice(fields)]
        vectors = Vectors.pack(curves, curves.shape[2])
        positions = vectors.restore(self._bezier(VALUES, vectors, curves.shape[2], t), curves.dtype)
        return positions, self._bezier(UNIT, Vectors.pack(lines, 0), lines.shape[2], t)

    def _bezier(self, kind: Kind, vectors: Vectors, points: int, t: Floats) -> Singles:
        """Bezier polynomials of so many points at the abscissae of edges: ``(e,m,3)``."""
        table = Table(("edge", points, t.tobytes()), len(t), bernstein_basis(points - 1, t))
        with self.products.sent(vectors.columns, len(t)) as sent:
            return self.products.multiply(kind, table, sent)

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
        surface = patch_class.surface
        fill = partial(self._fill, rows=rows, points=sampling.points, grid=(patch_class.sides, level))
        if isinstance(surface, KiteForms):
            self.blend.fill(surface, rows, sampling, positions, normals)
            left = np.zeros(len(rows), dtype=bool)
        elif patch_class.normals is None:
            left = fill(surface, NORMALS, positions=positions, normals=normals)
        else:
            left = fill(surface, VALUES, positions=positions)
            left |= fill(patch_class.normals, UNIT, normals=normals)
        left |= _without_normal(normals)
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
        positions: Floats | None = None,
        normals: Floats | None = None,
    ) -> Bools:
        """Write what a form gives into ``positions`` and ``normals (f,S,3)``; which patches ``(f,)`` it left out."""
        left = np.arange(len(rows))
        controls = form.controls(rows)
        for count in NODE_COUNTS:
            nodes = controls.fields(tables.chebyshev_points(count))
            enough = _enough_points(nodes)
            part = np.flatnonzero(enough)
            if len(part):
                vectors = Vectors.pack(controls.linear[:, part], form.points, nodes[:, part])
                with self.products.sent(vectors.columns, min(len(points), tables.SAMPLES)) as sent:
                    for block in tables.blocks(form, points, grid, count, kind.orders):
                        values = self.products.multiply(kind, _block_table(form, grid, count, block), sent)
                        place = _place(left[part]), slice(block.first, block.last)
                        if positions is not None:
                            positions[place] = vectors.restore(values[..., :3], positions.dtype)
                        if normals is not None:
                            normals[place] = values[..., -3:]
            left = left[~enough]
            if not len(left):
                break
            controls = controls.take(np.flatnonzero(~enough))
        return np.isin(np.arange(len(rows)), left)


def _enough_points(nodes: Floats) -> Bools:
    """Which patches ``(f,)`` have fields ``(3,f,n,m)`` at enough points; all of them where there are no fields."""
    if not nodes.shape[2]:
        return np.ones(nodes.shape[1], dtype=bool)
    return evaluate.enough_points(nodes, SERIES_TOLERANCE)


def _block_table(form: Form, grid: tuple[int, int], count: int, block: tables.Tables) -> Table:
    """A block of a form's tables, under a name for the device."""
    assert block.matrix is not None
    samples = block.last - block.first
    orders = block.matrix.shape[1] // samples
    return Table((form.key, grid, count, orders, block.first), samples, block.matrix)


def _without_normal(normals: npt.NDArray[Any]) -> Bools:
    """Rows ``(f,)`` of normals ``(f,S,3)`` one of which is zero: single precision gave none."""
    there = (normals != 0).any(axis=2)
    return ~there.all(axis=1)


def _place(rows: Ints) -> Ints | slice:
    """Ascending rows as an index: a slice where they lie side by side."""
    return slice(rows[0], rows[-1] + 1) if rows[-1] - rows[0] == len(rows) - 1 else rows

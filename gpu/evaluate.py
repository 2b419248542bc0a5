"""The GPU backend: control vectors built on the device, or sent to it, times the CPU's tables, in single precision.

Points are taken relative to an origin near each patch, which is added again when they come back, so that neither the
size of a mesh nor its place costs digits. What single precision cannot do (normals where derivatives are nearly
parallel, the shortest edges, side fields that no number of Chebyshev points describes) is left to the CPU, patch by
patch.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Any, TypeGuard

import numpy as np
import numpy.typing as npt

from curvify import evaluate, tables
from curvify.arrays import as_slice
from curvify.errors import DeviceError
from curvify.gpu.blend import BlendDevice
from curvify.gpu.memory import Singles
from curvify.gpu.products import Controls, Products, Table, pack_basis, pack_columns, pack_table
from curvify.gpu.programs import NORMALS, UNIT, VALUES, Kind
from curvify.mesh import Bools, Floats, Ints
from curvify.records import record
from curvify.sampling import Sampling
from curvify.schemes.base import Basis, BezierEdges, Edges, Form, KiteForms, PatchClass, Patches, bernstein_basis
from curvify.schemes.blend_network import BlendEdges
from curvify.schemes.construction import EDGE_TEXELS, Construction, DeviceForm
from curvify.series import sampled

#: What may be left out of the series of a side field, over its length: as much as single precision rounds away.
SERIES_TOLERANCE = 1e-7


class GpuBackend:
    """Evaluates on an OpenGL device; a context manager. Results are the same each time on the same device."""

    name = "gpu"

    def __init__(self, software: bool = True) -> None:
        """Open a device; ``software`` allows one that is a program. Raises DeviceError where there is none."""
        self.products = Products()
        self.device = self.products.device
        self.blend = BlendDevice(self.products)
        self._lock = threading.Lock()
        self._patches = {"built_on_gpu": 0, "built_on_cpu": 0, "evaluated_on_cpu": 0}
        self._edges = {"evaluated_on_gpu": 0, "evaluated_on_cpu": 0}
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
        return sum(self.products.memory.sent.values())

    def describe(self) -> dict[str, Any]:
        """Name and device."""
        names = ("vendor", "renderer", "version", "hardware", "compute")
        return {"name": self.name} | {name: getattr(self.device, name) for name in names}

    def traffic(self) -> dict[str, Any]:
        """So far: bytes ``sent`` by kind and ``received``; for how many ``patches`` control vectors were built where,
        and how many patches and ``edges``, from each side, were evaluated on the CPU.
        """
        memory = self.products.memory
        with self._lock:
            counts = {"patches": dict(self._patches), "edges": dict(self._edges)}
        return {"sent": dict(memory.sent), "received": memory.received, **counts}

    def _count(self, counts: dict[str, int], done: str, number: int, left: int) -> None:
        """Count what was ``done`` here and what was left to the CPU."""
        with self._lock:
            counts[done] += number - left
            counts["evaluated_on_cpu"] += left

    def edges(self, edges: Edges, ids: Ints, fields: Ints, t: Floats) -> tuple[Floats, Floats]:
        """Positions and unit normals ``(3,e,m)`` at ``t (m,)`` on edges ``ids (e,)`` with normal fields ``(e,)``; those
        that are neither Bezier curves nor of blending surfaces on the processor.
        """
        if len(t) and len(ids) and isinstance(edges, BezierEdges):
            positions, normals = self._bezier_edges(edges, ids, fields, t)
        elif len(t) and isinstance(edges, BlendEdges):
            positions, normals = self.blend.edges(edges, ids, fields, t)
        else:
            self._count(self._edges, "evaluated_on_gpu", len(ids), len(ids))
            return edges.points(ids, t), edges.normals(fields, t)
        places, directions = positions.transpose(2, 0, 1), normals.astype(np.float64).transpose(2, 0, 1)
        lost = np.flatnonzero(_without_normal(normals))
        self._count(self._edges, "evaluated_on_gpu", len(ids), len(lost))
        if len(lost):
            places[:, lost], directions[:, lost] = edges.points(ids[lost], t), edges.normals(fields[lost], t)
        return places, directions

    def _bezier_edges(self, edges: BezierEdges, ids: Ints, fields: Ints, t: Floats) -> tuple[Floats, Singles]:
        """Positions and unit normals ``(e,m,3)``, zero where single precision has none."""
        points = np.empty((len(ids), len(t), 3))
        normals = np.empty(points.shape, dtype=np.float32)
        step = self.products.most_patches(len(t), EDGE_TEXELS)
        for begin in range(0, len(ids), step):
            part = slice(begin, begin + step)
            place, direction = self._edge_controls(edges, ids[part], fields[part])
            self._bezier(VALUES, place, edges.curves.shape[2], t, points[part])
            self._bezier(UNIT, direction, edges.fields.shape[2], t, normals[part])
        points += edges.curves[:, as_slice(ids), 0].T[:, None]
        return points, normals

    def _edge_controls(
        self, edges: BezierEdges, ids: Ints, fields: Ints
    ) -> tuple[Callable[[], Controls], Callable[[], Controls]]:
        """What makes the curves ``ids (e,)``, from their starts, and the normal fields ``(e,)`` on the device."""
        if self._can_build(edges.construction):
            build = partial(self.products.edges_of, edges.construction)
            return partial(build, ids, False), partial(build, fields, True)
        curves, lines = edges.curves[:, as_slice(ids)], edges.fields[:, as_slice(fields)]
        size = np.abs(lines).max(axis=(0, 2))
        lines = lines / np.where(size > 0, size, 1.0)[:, None]
        return self._sent(curves - curves[..., :1]), self._sent(lines)

    def _bezier(self, kind: Kind, make: Callable[[], Controls], points: int, t: Floats, out: Floats | Singles) -> None:
        """Write Bezier polynomials of so many points at the abscissae of edges into ``out (e,m,3)``."""
        table = Table(("edge", points, t.tobytes()), len(t), lambda: pack_table(bernstein_basis(points - 1, t).T[None]))
        (launched,) = self.products.launch(make, kind, [table])
        out[...] = self.products.collect(launched)

    def _sent(self, *parts: Floats) -> Callable[[], Controls]:
        """What sends control vectors ``(3,f,L)``, in one or more parts, to the device."""
        columns, scale = pack_columns(*parts)
        return partial(self.products.sent, columns, scale, parts[0].shape[1])

    def _can_build(self, construction: Construction | None) -> TypeGuard[Construction]:
        """Whether control vectors are built on the device."""
        return construction is not None and self.products.can_build(construction)

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
        built = isinstance(surface, Form) and surface.device and self._can_build(surface.device.construction)
        part = np.flatnonzero(left)
        self._count(self._patches, "built_on_gpu" if built else "built_on_cpu", len(rows), len(part))
        if len(part):
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
        target = Target(positions, normals)
        if form.device is not None and self._can_build(form.device.construction):
            self._fill_built(form, form.device, kind, rows, points, grid, target)
            return np.zeros(len(rows), dtype=bool)
        return self._fill_sent(form, kind, rows, points, grid, target)

    def _fill_built(
        self,
        form: Form,
        device: DeviceForm,
        kind: Kind,
        rows: Ints,
        points: Floats,
        grid: tuple[int, int],
        target: Target,
    ) -> None:
        """Write patches whose control vectors the device builds."""
        blocks = [
            Table(
                (form.key, grid, "basis", kind.orders, block.first),
                block.last - block.first,
                partial(_pack_basis, device, block.basis, kind.orders),
            )
            for block in tables.blocks(form, points, grid, 0, kind.orders)
            if block.basis is not None
        ]
        step = self.products.most_patches(len(points), device.most_texels(grid[0]))
        for begin in range(0, len(rows), step):
            part = np.arange(begin, min(begin + step, len(rows)))
            make = partial(self.products.patches_of, device, rows[part], grid[0])
            origin = device.origins(rows[part]) if form.points else np.zeros((len(part), 3))
            self._evaluate(make, kind, blocks, origin, part, target)

    def _fill_sent(
        self, form: Form, kind: Kind, rows: Ints, points: Floats, grid: tuple[int, int], target: Target
    ) -> Bools:
        """Write patches whose control vectors are built here; which of them ``(f,)`` have fields that no number of
        Chebyshev points describes.
        """
        left = np.ones(len(rows), dtype=bool)
        for some, controls, nodes, chosen in sampled(form.controls(rows), len(rows), SERIES_TOLERANCE):
            count = nodes.shape[3]
            blocks = [
                Table(
                    (form.key, grid, count, kind.orders, block.first),
                    block.last - block.first,
                    partial(_pack_block, block, kind.orders),
                )
                for block in tables.blocks(form, points, grid, count, kind.orders)
            ]
            columns = controls.linear.shape[2] + nodes.shape[2] * count
            step = self.products.most_patches(len(points), columns)
            for begin in range(0, len(chosen), step):
                part = chosen[begin : begin + step]
                linear, origin = _relative(controls.linear[:, part], form.points)
                fields = nodes[:, part].reshape(3, len(part), -1)
                self._evaluate(self._sent(linear, fields), kind, blocks, origin, some[part], target)
            left[some[chosen]] = False
        return left

    def _evaluate(
        self,
        make: Callable[[], Controls],
        kind: Kind,
        blocks: list[Table],
        origin: Floats,
        part: Ints,
        target: Target,
    ) -> None:
        """Write the patches ``part (f,)``, whose points are relative to ``origin (f,3)``."""
        first = 0
        for table, launched in zip(blocks, self.products.launch(make, kind, blocks), strict=True):
            samples = slice(first, first := first + table.samples)
            raw = target.raw(part, samples) if kind is NORMALS else None
            values = self.products.collect(launched, raw)
            target.store(part, samples, values, origin, raw is None)


@record
class Target:
    """Where results go: ``positions`` and ``normals (f,S,3)``, or one of them."""

    positions: Floats | None
    normals: Floats | None

    def raw(self, part: Ints, samples: slice) -> Singles | None:
        """The memory ``(p,S,6)`` of some patches, if that is what a device gives: single precision, side by side,
        position and normal in turn.
        """
        positions, normals = self.positions, self.normals
        if positions is None or normals is None or positions.dtype != np.float32 or normals.dtype != np.float32:
            return None
        count, size = positions.shape[1], positions.itemsize
        adjacent = normals.ctypes.data - positions.ctypes.data == 3 * size
        together = positions.strides == normals.strides == (6 * size * count, 6 * size, size)
        whole = part[-1] - part[0] == len(part) - 1 and samples == slice(0, count)
        if not (adjacent and together and whole):
            return None
        rows = positions[part[0] : part[-1] + 1]
        return np.lib.stride_tricks.as_strided(rows, (*rows.shape[:2], 6))

    def store(self, part: Ints, samples: slice, values: Singles, origin: Floats, apart: bool) -> None:
        """Add the origins ``(p,3)`` to positions, and store all that lies ``apart``.

        What the origins lose in the type of the output goes first: a result is then rounded only once.
        """
        place = _place(part), samples
        if self.positions is not None:
            if apart:
                self.positions[place] = values[..., :3]
            rounded = origin.astype(self.positions.dtype)
            lost = (origin - rounded).astype(self.positions.dtype)
            for shift in (lost, rounded):
                if shift.any():
                    self.positions[place] += shift[:, None]
        if self.normals is not None and apart:
            self.normals[place] = values[..., -3:]


def _relative(linear: Floats, points: int) -> tuple[Floats, Floats]:
    """Control vectors ``(3,f,L)`` whose first ``points`` are moved to an origin near each patch, and that ``(f,3)``.

    The origin is the first point in single precision: a result in single precision is then rounded only once.
    """
    if not points:
        return linear, np.zeros((linear.shape[1], 3))
    origin = linear[..., 0].astype(np.float32).astype(np.float64)
    return np.concatenate([linear[..., :points] - origin[..., None], linear[..., points:]], axis=2), origin.T


def _pack_basis(device: DeviceForm, basis: Basis, orders: int) -> Singles:
    """A basis of a form that the device builds, as rows of a texture."""
    return pack_basis(basis, device.table(basis)[:orders])


def _pack_block(block: tables.Tables, orders: int) -> Singles:
    """A block of a form's tables with fields at Chebyshev points, as rows of a texture."""
    assert block.matrix is not None
    columns = block.matrix.reshape(len(block.matrix), orders, -1)
    return pack_table(columns.transpose(1, 2, 0))


def _without_normal(normals: npt.NDArray[Any]) -> Bools:
    """Rows ``(f,)`` of normals ``(f,S,3)`` one of which is zero: single precision gave none."""
    there = (normals != 0).any(axis=2)
    return ~there.all(axis=1)


def _place(rows: Ints) -> Ints | slice:
    """Ascending rows as an index: a slice where they lie side by side."""
    return slice(rows[0], rows[-1] + 1) if rows[-1] - rows[0] == len(rows) - 1 else rows

"""The CPU backend: control vectors times basis tables, in chunks that stay in cache.

Everything that is not linear in a patch depends on one variable and lives on its sides, so a few values of each
side field, at Chebyshev points, stand beside the control vectors, and matrix products with one table give
position and both derivatives. How many points a patch needs is read off the fields' Chebyshev coefficients; where
no count will do, the fields are evaluated at every sample. Float64 throughout, chunks of fixed size, the last one
padded: the same bytes for any number of threads.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator

import numpy as np

from curvify import tables
from curvify.arrays import as_slice, cross, unit_rows, values_of
from curvify.mesh import Floats, Ints
from curvify.normals import unit
from curvify.sampling import Sampling, kite_coordinates
from curvify.schemes.base import Basis, Controls, Form, KiteForms, LinearControls, PatchClass, Patches
from curvify.schemes.domain import domain_jets
from curvify.series import sampled
from curvify.tables import Tables

#: From this many sides the fields are evaluated at every sample: the tables would be too large.
MANY_SIDES = 17
#: Squared sine below which two derivatives count as parallel.
PARALLEL = 1e-20
#: Up to this many samples a patch the fields are evaluated at every sample: that is less than at the points.
FEW_SAMPLES = 9


_LOCAL = threading.local()


def _work(name: str, shape: tuple[int, ...]) -> Floats:
    """An array of this thread's own to work in, kept from chunk to chunk: fresh memory is slow to touch."""
    size = math.prod(shape)
    found: Floats | None = getattr(_LOCAL, name, None)
    if found is None or found.size < size:
        found = np.empty(size)
        setattr(_LOCAL, name, found)
    return found[:size].reshape(shape)


def chunk_size(samples: int) -> int:
    """Patches evaluated at once: 10 to 20 thousand samples, which fit the cache with their work arrays."""
    return 16 * int(np.clip(round(1000 / max(samples, 1)), 1, 16))


def fill_patches(
    patches: Patches,
    patch_class: PatchClass,
    rows: Ints,
    sampling: Sampling,
    level: int,
    tolerance: float,
    positions: Floats,
    normals: Floats,
) -> None:
    """Write positions and unit normals of some patches of a class into ``positions``, ``normals (f,S,3)``.

    ``rows (f,)`` index the class. Samples whose derivatives are parallel get the blend of the corner normals.
    """
    if not len(sampling.points):
        return
    grid, exact = (patch_class.sides, level), patch_class.normals is None
    orders = 3 if exact else 1
    for place, values in _evaluate_surface(patch_class.surface, rows, sampling, level, tolerance, orders):
        where = as_slice(place[0]), place[1]
        _store(positions, where, values[0])
        if exact:
            normal, length, parallel = _cross_products(values[1], values[2])
            _store(normals, where, normal, length)
            if parallel is not None:
                face, sample = parallel
                ids, points = patch_class.patches[rows[place[0][face]]], sampling.points[place[1]][sample]
                normals[place[0][face], place[1].start + sample] = blended_normals(patches, ids, points)
    if patch_class.normals is not None:
        for place, values in _evaluate_form(patch_class.normals, rows, sampling.points, grid, tolerance, 1):
            _store(normals, (as_slice(place[0]), place[1]), unit_rows(values[0]))
        lost = np.nonzero(~normals.any(axis=2))  # where the blend of opposite normals vanishes
        if len(lost[0]):
            normals[lost] = blended_normals(patches, patch_class.patches[rows[lost[0]]], sampling.points[lost[1]])


def _store(
    out: Floats, place: tuple[Ints | slice, slice], values: Floats, divisor: Floats | None = None
) -> None:
    """Write ``values (3,f,S)``, over ``divisor (f,S)``, to the patches and samples of ``place`` in ``out (F,S,3)``."""
    for i in range(3):
        out[(*place, i)] = values[i] if divisor is None else np.divide(values[i], divisor, out=values[i])


def _cross_products(a: Floats, b: Floats) -> tuple[Floats, Floats, tuple[Ints, Ints] | None]:
    """Cross products ``(3,f,S)`` of vectors ``(3,f,S)``, their lengths ``(f,S)``, and where they are parallel, if
    anywhere: the length there is 1.
    """
    normal, work = _work("normal", a.shape), _work("product of two", a.shape[1:])
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        np.multiply(a[j], b[k], out=normal[i])
        np.multiply(a[k], b[j], out=work)
        normal[i] -= work
    square = np.einsum("cfs,cfs->fs", normal, normal, out=work)
    parallel: tuple[Ints, Ints] | None = None
    first = np.einsum("cf,cf->f", a[..., 0], a[..., 0]) * np.einsum("cf,cf->f", b[..., 0], b[..., 0])
    if not (square.min(axis=1) > 1e4 * PARALLEL * first).all():  # a cheap sieve; also where anything is not a number
        speeds = np.einsum("cfs,cfs->fs", a, a) * np.einsum("cfs,cfs->fs", b, b)
        found = square <= PARALLEL * speeds
        if found.any():
            face, sample = np.nonzero(found)
            parallel = face, sample
        square[found] = 1.0
    return normal, np.sqrt(square, out=square), parallel


def _evaluate_surface(
    surface: Form | KiteForms, rows: Ints, sampling: Sampling, level: int, tolerance: float, orders: int
) -> Iterator[tuple[tuple[Ints, slice], Floats]]:
    """Values ``(o,3,f,S)`` of a surface at all samples, with the index of the patches and samples they belong to."""
    if isinstance(surface, Form):
        yield from _evaluate_form(surface, rows, sampling.points, (sampling.sides, level), tolerance, orders)
        return
    for part, form, corners, first, points, grid in kite_blocks(surface, rows, sampling, level):
        for (done, samples), values in _evaluate_form(form, corners, points, grid, tolerance, orders):
            yield (part[done], slice(first + samples.start, first + samples.stop)), values


def kite_blocks(
    surface: KiteForms, rows: Ints, sampling: Sampling, level: int
) -> Iterator[tuple[Ints, Form, Ints, int, Floats, tuple[int, int]]]:
    """The samples of a surface of kites by form: which of the patches ``rows (f,)`` have a form at a kite, the form,
    the corners it is for; the first of the patches' samples that lie there, their places in the kite ``(m,2)``, and the
    name of these for tables.
    """
    size = len(sampling.kite)
    for corner in range(sampling.sides):
        which = surface.which[rows, corner]
        blocks = [(corner * size, sampling.kite, (0, level))]
        if corner == 0:  # the middle of the patch, which all its kites share
            blocks.append((sampling.sides * size, np.ones((1, 2)), (0, 0)))
        for form in values_of(which):
            part = np.flatnonzero(which == form)
            for first, points, grid in blocks:
                yield part, surface.forms[form], surface.corners[rows[part]] + corner, first, points, grid


def _evaluate_form(
    form: Form, rows: Ints, points: Floats, grid: tuple[int, int], tolerance: float, orders: int
) -> Iterator[tuple[tuple[Ints, slice], Floats]]:
    """Values ``(o,3,f,S)`` of a form, with the index of the patches and samples they belong to."""
    controls = form.controls(rows)
    left = np.ones(len(rows), dtype=bool)
    if isinstance(controls, LinearControls) or not (grid[0] >= MANY_SIDES or len(points) <= FEW_SAMPLES):
        for some, group, fields, part in sampled(controls, len(rows), tolerance):
            key = (grid, fields.shape[3], orders)
            for (chunk, samples), values in _by_tables(form, group.linear, fields, part, points, key):
                yield (some[chunk], samples), values
            left[some[part]] = False
    yield from _pointwise(form, controls, np.flatnonzero(left), points, grid, orders)


def _pointwise(
    form: Form, controls: Controls, left: Ints, points: Floats, grid: tuple[int, int], orders: int
) -> Iterator[tuple[tuple[Ints, slice], Floats]]:
    """Values of the patches ``left``, their fields evaluated at every sample."""
    size = chunk_size(min(len(points), tables.SAMPLES))
    for begin in range(0, len(left), size):
        part = left[begin : begin + size]
        few = controls.take(part)
        for block in tables.blocks(form, points, grid, 0, orders):
            assert block.basis is not None
            yield (part, slice(block.first, block.last)), exact_values(few, block.basis, orders)


def _by_tables(
    form: Form, linear: Floats, nodes: Floats, part: Ints, points: Floats, key: tuple[tuple[int, int], int, int]
) -> Iterator[tuple[tuple[Ints, slice], Floats]]:
    """Values of the patches ``part`` among those with the given controls, chunk by chunk."""
    grid, count, orders = key
    size = chunk_size(min(len(points), tables.SAMPLES))
    for block in tables.blocks(form, points, grid, count, orders):
        for begin in range(0, len(part), size):
            chunk = part[begin : begin + size]
            yield (chunk, slice(block.first, block.last)), _chunk(linear, nodes, chunk, size, block, orders)


def _chunk(linear: Floats, nodes: Floats, part: Ints, size: int, block: Tables, orders: int) -> Floats:
    """One matrix product for a chunk, padded by its last patch to a multiple of 4 patches."""
    count = len(part)
    size = min(size, -(-count // 4) * 4)
    columns, (sides, points) = linear.shape[2], nodes.shape[2:]
    assert block.matrix is not None
    samples = block.last - block.first
    vectors = _work("vectors", (len(block.matrix), 3, size))  # patches last, as controls come and products like it
    chosen = as_slice(part)
    vectors[:columns, :, :count] = linear[:, chosen].transpose(2, 0, 1)
    vectors[columns:].reshape(sides, points, 3, size)[..., :count] = nodes[:, chosen].transpose(2, 3, 0, 1)
    vectors[..., count:] = vectors[..., count - 1 : count]
    product = _work("product", (3 * size, orders * samples))
    np.matmul(vectors.reshape(len(vectors), -1).T, block.matrix, out=product)
    return product.reshape(3, size, orders, samples)[:, :count].transpose(2, 0, 1, 3)


def exact_values(controls: Controls, basis: Basis, orders: int = 3) -> Floats:
    """Values ``(o,3,f,S)`` of patches at shared points, the fields evaluated at every sample."""
    linear = np.moveaxis(basis.linear[:orders], 0, -1)
    total = np.moveaxis(np.einsum("cfl,slo->cfso", controls.linear, linear, optimize=True), -1, 0)
    if basis.weights.shape[2]:
        sides = basis.weights.shape[2]
        t = np.concatenate([basis.abscissae[0].T, np.broadcast_to([0.0, 1.0], (sides, 2))], axis=1)
        weights, u = basis.weights.transpose(0, 2, 1), basis.abscissae.transpose(0, 2, 1)
        values = controls.fields(t) if orders == 1 else None
        if values is None:
            values, slopes = controls.field_derivatives(t)
            for order in (1, 2):
                total[order] += np.einsum("cfks,ks->cfs", slopes[..., :-2], weights[0] * u[order])
        for order in range(orders):
            total[order] += np.einsum("cfks,ks->cfs", values[..., :-2], weights[order])
            total[order] += np.einsum("cfke,ske->cfs", values[..., -2:], basis.ends[order])
    return total


def _rows_of(patch_class: PatchClass, ids: Ints) -> Ints:
    """Row of each patch in a class ``(m,)``, -1 where it is in another."""
    rows = np.minimum(np.searchsorted(patch_class.patches, ids), len(patch_class.patches) - 1)
    return np.where(patch_class.patches[rows] == ids, rows, -1)


def evaluate_at(patches: Patches, ids: Ints, points: Floats) -> tuple[Floats, Floats, Floats]:
    """Position and derivatives by xi and eta ``(m,3)`` of patches ``ids (m,)`` at domain points ``(m,2)`` of
    their own: exact, for any points of the closed domain.
    """
    result = np.empty((3, len(ids), 3))
    for patch_class in patches.classes:
        mine = np.flatnonzero(_rows_of(patch_class, ids) >= 0)
        surface = patch_class.surface
        if isinstance(surface, Form):
            result[:, mine] = _form_at(surface, _rows_of(patch_class, ids[mine]), points[mine])
        else:
            result[:, mine] = _kites_at(surface, patch_class.sides, _rows_of(patch_class, ids[mine]), points[mine])
    return result[0], result[1], result[2]


def _kites_at(surface: KiteForms, sides: int, rows: Ints, points: Floats) -> Floats:
    """Jets ``(3,m,3)`` of a surface of kites at a point of each of the patches ``rows (m,)`` of its class."""
    kite, inside, slopes = kite_coordinates(sides, points)
    which = surface.which[rows, kite]
    result = np.empty((3, len(rows), 3))
    for form in values_of(which):
        part = np.flatnonzero(which == form)
        jets = _form_at(surface.forms[form], surface.corners[rows[part]] + kite[part], inside[part])
        result[0, part] = jets[0]
        result[1:, part] = np.einsum("oqc,qox->xqc", jets[1:], slopes[part])
    return result


def _form_at(form: Form, rows: Ints, points: Floats) -> Floats:
    """Jets ``(3,m,3)`` of a form at a point of each of ``rows (m,)``."""
    result = np.empty((3, len(rows), 3))
    for begin in range(0, len(rows), tables.SAMPLES):
        part = slice(begin, begin + tables.SAMPLES)
        basis, controls = form.basis(points[part]), form.controls(rows[part])
        total = np.einsum("cql,oql->oqc", controls.linear, basis.linear)
        if basis.weights.shape[2]:
            t = np.empty((*basis.abscissae.shape[1:], 3))
            t[..., 0], t[..., 1], t[..., 2] = basis.abscissae[0], 0.0, 1.0
            values, slopes = controls.field_derivatives(t)
            total += np.einsum("cqk,oqk->oqc", values[..., 0], basis.weights)
            total += np.einsum("cqke,oqke->oqc", values[..., 1:], basis.ends)
            for order in (1, 2):
                chain = basis.weights[0] * basis.abscissae[order]
                total[order] += np.einsum("cqk,qk->qc", slopes[..., 0], chain)
        result[:, part] = total
    return result


def surface_at(patches: Patches, ids: Ints, points: Floats) -> tuple[Floats, Floats]:
    """Positions and unit normals ``(m,3)`` of patches ``ids (m,)`` at domain points ``(m,2)`` of their own."""
    position, by_xi, by_eta = evaluate_at(patches, ids, points)
    normal = cross(by_xi, by_eta)
    square = (normal**2).sum(axis=1)
    parallel = square <= PARALLEL * (by_xi**2).sum(axis=1) * (by_eta**2).sum(axis=1)
    normal /= np.sqrt(np.where(parallel, 1.0, square))[:, None]
    normal[parallel] = blended_normals(patches, ids[parallel], points[parallel])
    return position, normal


def blended_normals(patches: Patches, ids: Ints, points: Floats) -> Floats:
    """Corner normals of patches blended over their domains ``(m,3)``: for where derivatives are parallel."""
    result = np.empty((len(ids), 3))
    for patch_class in patches.classes:
        mine = np.flatnonzero(_rows_of(patch_class, ids) >= 0)
        if len(mine):
            corners = patches.topology.offsets[ids[mine]][:, None] + np.arange(patch_class.sides)
            weights = domain_jets(patch_class.sides, points[mine]).w[0]
            blend = np.einsum("qki,kq->qi", patches.normals[corners], weights)
            opposite = np.linalg.norm(blend, axis=1, keepdims=True) < 1e-9
            result[mine] = unit(np.where(opposite, patches.normals[corners[:, 0]], blend))
    return result

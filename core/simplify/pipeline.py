"""From a dense mesh to a coarse one that was fitted to it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from curvify.mesh import PolygonMesh
from curvify.simplify.attempts import Options
from curvify.simplify.chain import Simplified, crossing_notes, simplify
from curvify.simplify.checks import check_mesh_like
from curvify.simplify.crossings import crossing_polygons
from curvify.simplify.fit import Fit, Fitted, Progress, fit_mesh
from curvify.simplify.search import count_notes
from curvify.words import count_of

#: The share of the faces asked for, beyond the first few, that is kept for folds and large errors; the second one where
#: a largest error is given.
KEPT, KEPT_BOUNDED, FEW = 0.12, 0.2, 50
#: The share by which cuts may exceed the number of faces asked for, and how often fewer are tried where they do.
WITHIN, TRIES = 0.05, 3
#: The share of all work that simplifying is.
SIMPLIFYING = 0.25


@dataclass(eq=False)
class Result:
    """A fitted ``mesh``; ``simplified``, what it was before; ``fitted``; ``counts`` and ``warnings`` of both."""

    mesh: PolygonMesh
    simplified: Simplified
    fitted: Fitted
    counts: dict[str, int]
    warnings: list[str]


def simplify_and_fit(mesh: PolygonMesh, options: Options, fit: Fit, progress: Progress | None = None) -> Result:
    """Few polygons for a dense mesh, whose refinement comes back to it.

    Without a fit they are what ``simplify`` makes. The budget of ``fit`` follows from ``options``. Raises MeshError
    where there is nothing to simplify.
    """
    tell = progress or (lambda stage, share: None)
    if fit.mode == "none":
        result = simplify(mesh, options, progress)
        return Result(result.mesh, result, Fitted(result.mesh, []), result.counts, result.warnings)
    first = replace(options, faces=_first_faces(options.faces, fit)) if options.faces is not None else options
    tried = []
    for _ in range(TRIES):
        result, fitted = _simplified_and_fitted(mesh, first, options.faces, fit, tell)
        faces = fitted.mesh.face_count
        tried.append((abs(faces - (options.faces or faces)), result, fitted))
        if first.faces is None or options.faces is None or result.mesh.face_count > options.faces:
            break  # not asked for, or not to be had
        if faces <= (1 + WITHIN) * options.faces:
            break
        first = replace(first, faces=max(int(first.faces * (1 + WITHIN / 2) * options.faces / faces), 1))
    _, result, fitted = min(tried, key=lambda one: one[0])
    check_mesh_like(result.mesh, fitted.mesh)
    counts = result.counts | {
        "faces": fitted.mesh.face_count,
        "vertices": fitted.mesh.vertex_count,
        "crease_edges": len(fitted.mesh.marks.crease_edges),
        "flat_faces": len(fitted.mesh.marks.flat_faces),
        "crossings": len(crossing_polygons(fitted.mesh)),
    }
    warnings = [*result.warnings[: result.lasting], *_count_notes(options, result, fitted)]
    warnings += [*crossing_notes(counts["crossings"], result.original), *_notes(fit, fitted)]
    return Result(fitted.mesh, result, fitted, counts, warnings)


def _count_notes(options: Options, result: Simplified, fitted: Fitted) -> list[str]:
    """What there is to say of the number of faces, where another was asked for."""
    if options.faces is None:
        return []
    if options.faces >= result.dense.face_count:
        return result.warnings[result.lasting :][:1]
    return count_notes(options.faces, fitted.mesh.face_count, result.mesh.face_count > options.faces)


def _first_faces(faces: int, fit: Fit) -> int:
    """How many polygons to begin with for so many in the end."""
    return faces - int(_kept(fit) * max(faces - FEW, 0))


def _kept(fit: Fit) -> float:
    return KEPT if fit.max_error is None else KEPT_BOUNDED


def _simplified_and_fitted(
    mesh: PolygonMesh, options: Options, faces: int | None, fit: Fit, tell: Progress
) -> tuple[Simplified, Fitted]:
    """The polygons that ``options`` ask for, and what the fit makes of them with ``faces`` to spend."""
    result = simplify(mesh, options, lambda stage, done: tell(stage, SIMPLIFYING * done))
    budget = faces if faces is not None else round(result.mesh.face_count / (1 - _kept(fit)))
    fitted = fit_mesh(
        result.mesh,
        result.original,
        replace(fit, budget=max(budget, result.mesh.face_count)),
        lambda stage, done: tell(stage, SIMPLIFYING + (1 - SIMPLIFYING) * done),
    )
    return result, fitted


def _notes(fit: Fit, fitted: Fitted) -> list[str]:
    """What there is to say of a largest error that could not be held."""
    if fit.max_error is None or fitted.largest is None or fitted.largest <= fit.max_error:
        return []
    faces = count_of(fitted.mesh.face_count, "face")
    return [
        f"{faces} come within {100 * fitted.largest:.3g} % of the diagonal, not {100 * fit.max_error:.3g} %; "
        "more faces may"
    ]

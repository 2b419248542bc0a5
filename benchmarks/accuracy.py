"""How far dense meshes are from the surfaces that their vertices and normals were taken from, all schemes side by side.

    python benchmarks/accuracy.py [--only torus,cube] [--no-peers]

Spheres, tori and cylinders with their exact vertex normals, 16 segments an edge. Errors are radial, in % of the radius
(of the tube for tori): rms (largest). Samples are counted patch by patch, so those on edges count for each side;
overveld and the peers count every vertex once. Figures with a ``*`` are known from an independent study; the last lines
say how many of those were met within 10 %. Peers: Manifold's smoothing (manifold3d), and Butterfly and LS3 Loop
subdivision (pymeshlab), on triangle meshes, where they are installed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import curvify
from curvify.mesh import PolygonMesh
from surfaces import (
    cube,
    cylinder,
    dodecahedron,
    geodesic,
    grid_errors,
    icosahedron,
    octahedron,
    on_sphere,
    tetrahedron,
    torus,
    truncated_icosahedron,
    uv_sphere,
)

Array = NDArray[np.float64]
Errors = Callable[[Array], Array]
LEVEL = 8


def from_sphere(points: Array) -> Array:
    """Distance from the unit sphere."""
    return np.linalg.norm(points, axis=1) - 1


def from_torus(points: Array) -> Array:
    """Distance from the torus with radii 1 and 0.4, over the smaller one."""
    return (np.hypot(np.hypot(points[:, 0], points[:, 1]) - 1, points[:, 2]) - 0.4) / 0.4


def from_cylinder(points: Array) -> Array:
    """Distance from the cylinder of radius 1."""
    return np.hypot(points[:, 0], points[:, 1]) - 1


@dataclass(frozen=True)
class Case:
    """A coarse mesh, the error of points, and figures known for some columns: rms and largest, in %."""

    make: Callable[[], PolygonMesh]
    error: Errors
    known: dict[str, tuple[float, float | None]]


GREGORY = ("linear", "quadratic", "smooth", "precise")


def known(gregory: str = "", others: str = "") -> dict[str, tuple[float, float | None]]:
    """Figures of the four cross tangents, then of the normal-based schemes: ``rms`` or ``rms/largest`` each."""
    columns = zip((*GREGORY, *TRIANGLES), (gregory.split() or [""] * 4) + (others.split() or [""] * 6), strict=True)
    found = {}
    for name, text in columns:
        if text:
            rms, _, largest = text.partition("/")
            found[name] = float(rms), float(largest) if largest else None
    return found


TRIANGLES: dict[str, tuple[str, dict[str, Any]]] = {
    "flat": ("phong", {"alpha": 0.0}),
    "phong": ("phong", {}),
    "pn": ("pn", {}),
    "png1": ("png1", {}),
    "overveld": ("overveld", {}),
    "stretched": ("overveld", {"edge_rule": "stretched"}),
}

CASES = {
    "tetrahedron": Case(lambda: on_sphere(tetrahedron()), from_sphere, known("4.46 46.5 9.45 1.32")),
    "octahedron": Case(
        lambda: on_sphere(octahedron()), from_sphere, known("", "29.5/42.0 7.5/13.3 13.2/22.8 3.1/4.8 2.4/3.2 8.9/12.4")
    ),
    "icosahedron": Case(
        lambda: on_sphere(icosahedron()),
        from_sphere,
        known(
            "2.37/5.54 0.94/2.19 0.31/0.52 0.040/0.086", "14.8/20.4 1.6/2.7 3.5/5.8 0.75/1.12 0.45/0.57 4.1/5.4"
        ),
    ),
    "geodesic 320": Case(
        lambda: on_sphere(geodesic(2)),
        from_sphere,
        known("", "1.12/1.77 0.52/0.81 0.021/0.047 0.0079/0.027 0.0019/0.0032 0.30/0.44"),
    ),
    "cube": Case(
        lambda: on_sphere(cube()), from_sphere, known("1.81/2.63 8.01/19.8 0.20/0.77 0.019/0.046")
    ),
    "dodecahedron": Case(
        lambda: on_sphere(dodecahedron()), from_sphere, known("2.21/5.95 2.96/8.07 0.20/0.56 0.022/0.043")
    ),
    "truncated icosahedron": Case(
        lambda: on_sphere(truncated_icosahedron()),
        from_sphere,
        known("1.23/4.05 1.33/4.38 0.29/1.08 0.0020/0.0038"),
    ),
    "UV sphere 12x8": Case(lambda: on_sphere(uv_sphere()), from_sphere, known("0.200 0.199 0.023 0.0044")),
    "torus 6x4": Case(lambda: torus(6, 4), from_torus, known("4.23 6.43 2.09 2.92")),
    "torus 12x8": Case(torus, from_torus, known("0.430 0.484 0.247 0.241")),
    "torus 12x8 triangles": Case(
        lambda: torus(12, 8, triangles=True),
        from_torus,
        known("1.98 1.94 0.464 0.273", "7.5/18.2 2.4/5.1 0.92/3.0 0.49/1.9 0.29/0.81 2.1/5.1"),
    ),
    "torus 24x16 triangles": Case(
        lambda: torus(24, 16, triangles=True),
        from_torus,
        known("", "1.9/4.8 0.87/2.1 0.064/0.22 0.034/0.13 0.024/0.085 0.51/1.26"),
    ),
    "cylinder 6": Case(lambda: cylinder(6), from_cylinder, known("0.373 0.373 0.0014 0.0014")),
    "cylinder 10 triangles": Case(
        lambda: cylinder(10, triangles=True), from_cylinder, known("0.99 1.05 0.158 0.032")
    ),
}


# --- curvify ----------------------------------------------------------------------------------------------------------


def gregory_errors(case: Case, kind: str) -> Array:
    """Errors at all grid points of all kites."""
    dense = curvify.refine(case.make(), "gregory", LEVEL, cross_tangent=kind, sharp_from="normals")
    return grid_errors(dense, LEVEL, case.error)


def triangle_errors(case: Case, scheme: str, options: dict[str, Any]) -> Array:
    """Errors at all samples of all triangles; of overveld, at every vertex."""
    dense = curvify.refine(case.make(), scheme, LEVEL, sharp_from="normals", **options)
    if scheme == "overveld":
        return case.error(dense.positions)
    of_patch = dense.faces.reshape(-1, 3 * (2 * LEVEL) ** 2)
    return np.concatenate([case.error(dense.positions[np.unique(corners)]) for corners in of_patch])


# --- peers ------------------------------------------------------------------------------------------------------------


def manifold_errors(case: Case) -> Array:
    """Manifold: Bezier tangents from the normals, every edge in 16."""
    import manifold3d

    mesh = case.make()
    normals = np.empty_like(mesh.positions)
    assert mesh.corner_normals is not None
    normals[mesh.face_vertices] = mesh.corner_normals
    records = np.hstack([mesh.positions, normals]).astype(np.float32)
    solid = manifold3d.Manifold(manifold3d.Mesh(records, mesh.face_vertices.reshape(-1, 3).astype(np.uint32)))
    if solid.status() != manifold3d.Error.NoError or solid.is_empty():
        raise ValueError("not a solid")
    dense = solid.smooth_by_normals(0).refine(2 * LEVEL).to_mesh()
    return case.error(np.asarray(dense.vert_properties, dtype=np.float64)[:, :3])


def pymeshlab_errors(case: Case, filter_name: str) -> Array:
    """A subdivision of pymeshlab, four times."""
    import pymeshlab

    mesh = case.make()
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(mesh.positions, mesh.face_vertices.reshape(-1, 3)))
    getattr(meshes, filter_name)(iterations=4, threshold=pymeshlab.PercentageValue(0))
    return case.error(meshes.current_mesh().vertex_matrix())


PEERS: dict[str, tuple[str, Callable[[Case], Array]]] = {
    "Manifold": ("manifold3d", manifold_errors),
    "Butterfly": ("pymeshlab", lambda case: pymeshlab_errors(case, "meshing_surface_subdivision_butterfly")),
    "LS3": ("pymeshlab", lambda case: pymeshlab_errors(case, "meshing_surface_subdivision_ls3_loop")),
}


# --- the table --------------------------------------------------------------------------------------------------------


def measure(case: Case, peers: list[str]) -> dict[str, tuple[float, float] | None]:
    """Rms and largest error in % by column; None where a peer cannot take the mesh."""
    errors: dict[str, Array | None] = {kind: gregory_errors(case, kind) for kind in GREGORY}
    errors |= {name: triangle_errors(case, *choice) for name, choice in TRIANGLES.items()}
    for name in peers:
        try:
            errors[name] = PEERS[name][1](case) if (case.make().face_sizes == 3).all() else None
        except ValueError:
            errors[name] = None
    return {
        name: None if e is None else (100 * float(np.sqrt((e**2).mean())), 100 * float(np.abs(e).max()))
        for name, e in errors.items()
    }


def agreement(case: Case, name: str, found: tuple[float, float]) -> list[float]:
    """Ratios of what was found to what is known."""
    return [have / want for have, want in zip(found, case.known.get(name, ()), strict=False) if want]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="names of meshes, or parts of them, by comma")
    parser.add_argument("--no-peers", action="store_true")
    arguments = parser.parse_args()
    peers = [name for name, (module, _) in PEERS.items() if find_spec(module) and not arguments.no_peers]
    for name in PEERS.keys() - set(peers):
        print(f"{name} left out: {PEERS[name][0]} is not installed", file=sys.stderr)
    columns = [*GREGORY, *TRIANGLES, *peers]
    print("| mesh | " + " | ".join(columns) + " |")
    print("| -- |" + " --: |" * len(columns))
    ratios: list[float] = []
    for mesh, case in CASES.items():
        if not any(part in mesh for part in arguments.only.split(",")):
            continue
        found = measure(case, peers)
        cells = []
        for name in columns:
            value = found[name]
            ratios += agreement(case, name, value) if value else []
            star = "*" if name in case.known else ""
            cells.append(f"{value[0]:.2g} ({value[1]:.2g}){star}" if value else "")
        print(f"| {mesh} | " + " | ".join(cells) + " |", flush=True)
    off = [ratio for ratio in ratios if not 0.9 <= ratio <= 1.1]
    print(f"\n{len(ratios) - len(off)} of {len(ratios)} known figures met within 10 %", end="")
    print("" if not off else "; the others times " + ", ".join(f"{ratio:.2f}" for ratio in off))


if __name__ == "__main__":
    main()

"""What is drawn of meshes, worked out once for each: several layers and panels may show one mesh."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from curvify.errors import MeshError
from curvify.formats.dense import to_polygon_mesh
from curvify.gpu.shading import shading_normals
from curvify.gpu.triangles import Triangles, polygon_edges, shown_faces, to_triangles, used_vertices
from curvify.mesh import DenseMesh, Ints, PolygonMesh


class Shapes:
    """Polygons, triangles, edges and vertices of meshes, which must not change while they are in use here."""

    def __init__(self) -> None:
        self._kept: dict[tuple[object, ...], tuple[object, Any]] = {}

    def _once(self, mesh: object, *what: str, make: Callable[[], Any]) -> Any:
        """What ``make`` makes of a mesh, kept with the mesh, whose id is its own only while it lives."""
        key = (id(mesh), *what)
        if key not in self._kept:
            self._kept[key] = mesh, make()
        return self._kept[key][1]

    def polygons(self, mesh: PolygonMesh | DenseMesh) -> PolygonMesh:
        """The faces that are shown. Raises MeshError where there are none, or where they are broken."""

        def make() -> PolygonMesh:
            polygons = to_polygon_mesh(mesh) if isinstance(mesh, DenseMesh) else mesh
            polygons.validate()
            shown = shown_faces(polygons)
            if not shown.corner_count:
                raise MeshError("the mesh has no faces; there is nothing to show")
            return shown

        return self._once(mesh, "polygons", make=make)

    def triangles(self, mesh: PolygonMesh | DenseMesh, shading: str) -> Triangles:
        """Triangles with the normals of a kind of shading."""

        def make() -> Triangles:
            polygons = self.polygons(mesh)
            return to_triangles(polygons, shading_normals(polygons, shading))

        return self._once(mesh, "triangles", shading, make=make)

    def edges(self, mesh: PolygonMesh | DenseMesh) -> Ints:
        """The edges of the polygons ``(E,2)``."""
        return self._once(mesh, "edges", make=lambda: polygon_edges(self.polygons(mesh)))

    def vertices(self, mesh: PolygonMesh | DenseMesh) -> Ints:
        """The vertices that faces use."""
        return self._once(mesh, "vertices", make=lambda: used_vertices(self.polygons(mesh)))

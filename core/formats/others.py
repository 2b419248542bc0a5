"""Every other mesh format (STL, GLB, 3MF, ...) through trimesh, which is imported when it is needed."""

from __future__ import annotations

import io
import logging
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from curvify.errors import FormatError
from curvify.formats.looks import add_looks, read_looks
from curvify.formats.obj_write import round_to
from curvify.formats.references import referenced_files
from curvify.formats.wedges import Wedges, split_vertices, wedge_rows
from curvify.mesh import Floats, Ints, Looks, PolygonMesh
from curvify.records import record
from curvify.triangulation import triangle_corners


@record
class _Part:
    """One triangle mesh of a scene, in its place: ``faces (F,3)``, the others one row for each vertex; the name of
    its ``material``, empty where it has none.
    """

    positions: Floats
    faces: Ints
    normals: Floats | None
    uvs: Floats | None
    colors: NDArray[np.generic] | None
    material: str


def _import_trimesh() -> Any:
    import trimesh

    # Without a handler of its own, what the library logs would go to standard error.
    logging.getLogger("trimesh").addHandler(logging.NullHandler())
    return trimesh


def read_other(data: bytes, name: str, format: str) -> PolygonMesh:
    """Parse a file of a format that it reads into a triangle mesh.

    All parts of a scene are put together, transformed. Vertices stay as the file has them, not merged.
    Normals and vertex colors are kept where every part has them, uvs where one has, materials by their names, with what
    those of glTF look like. Raises FormatError for whatever trimesh cannot read.
    """
    missing = [path for path in referenced_files(name) if not Path(path).is_file()]
    if missing:
        raise FormatError(f"{name}: it refers to {missing[0]}, and there is no such file")
    trimesh = _import_trimesh()
    looks: Looks | None = None
    try:
        if format in ("glb", "gltf"):
            data, looks = read_looks(data, format, Path(name).parent)
        loaded = trimesh.load(io.BytesIO(data), file_type=format, process=False, **_neighbors(name, format, trimesh))
        parts = _parts(loaded, trimesh)
    except ImportError as error:
        raise FormatError(f"{name}: reading {format} needs another package: {_one_line(error)}") from None
    except Exception as error:
        raise FormatError(f"{name}: this cannot be read as {format}: {_one_line(error)}") from None
    if not parts:
        raise FormatError(f"{name}: {_why_empty(data, format)}")
    return _join(parts, name).with_(looks=looks)


def _neighbors(name: str, format: str, trimesh: Any) -> dict[str, Any]:
    """Where the files that a glTF file refers to are looked for: beside it."""
    if format != "gltf" or not Path(name).is_file():
        return {}
    return {"resolver": trimesh.resolvers.FilePathResolver(name)}


def _why_empty(data: bytes, format: str) -> str:
    """What to say of a file without triangles. A binary STL of the wrong length is read as an empty text."""
    count = int.from_bytes(data[80:84], "little")
    due = 84 + 50 * count
    if format == "stl" and len(data) >= 84 and b"facet" not in data and len(data) != due:
        return f"a binary STL of {count} triangles has {due} bytes, this one {len(data)}; it is cut off or damaged"
    return "the file holds no triangles"


def _one_line(error: Exception) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    return text[:200]


def _parts(loaded: Any, trimesh: Any) -> list[_Part]:
    """The triangle meshes of whatever trimesh returned, in the place that the scene gives them."""
    if not isinstance(loaded, trimesh.Scene):
        placed = [(np.eye(4), loaded)]
    else:
        order = {key: number for number, key in enumerate(loaded.geometry)}  # that of the file
        nodes = [(order[loaded.graph[node][1]], node) for node in loaded.graph.nodes_geometry]
        placed = []
        for _, node in sorted(nodes):
            matrix, key = loaded.graph[node]
            placed.append((np.asarray(matrix), loaded.geometry[key]))
    return [_place(m, g) for m, g in placed if isinstance(g, trimesh.Trimesh) and len(g.faces)]


def _place(matrix: Floats, geometry: Any) -> _Part:
    positions = np.asarray(geometry.vertices, dtype=np.float64).reshape(-1, 3)
    faces = np.asarray(geometry.faces, dtype=np.int64).reshape(-1, 3)
    normals = _stored_normals(geometry)
    linear = matrix[:3, :3]
    if not np.array_equal(matrix, np.eye(4)):
        positions = positions @ linear.T + matrix[:3, 3]
        if normals is not None:
            normals = _unit(normals @ np.linalg.pinv(linear))
    if np.linalg.det(linear) < 0:
        faces = faces[:, ::-1]
    material = getattr(geometry.visual, "material", None)
    name = str(getattr(material, "name", None) or "")
    return _Part(positions, faces, normals, _stored_uvs(geometry), _stored_colors(geometry), name)


def _unit(rows: Floats) -> Floats:
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    return rows / np.where(lengths > 0, lengths, 1)


def _join(parts: list[_Part], name: str) -> PolygonMesh:
    """One mesh of several."""
    starts = np.cumsum([0] + [len(part.positions) for part in parts])
    positions = np.concatenate([part.positions for part in parts])
    corners = np.concatenate([part.faces + s for part, s in zip(parts, starts, strict=False)]).reshape(-1)
    wild = np.flatnonzero(~np.isfinite(positions).all(axis=1))
    if len(wild):
        raise FormatError(
            f"{name}: vertex {wild[0]} has a coordinate that is not a finite number; remove or mend it"
        )
    wrong = corners[(corners < 0) | (corners >= len(positions))]
    if len(wrong):
        raise FormatError(
            f"{name}: a face refers to vertex {wrong[0]}, the file has {len(positions)} (counted from 0)"
        )
    normals = _stack([part.normals for part in parts])
    if normals is not None:
        normals[~(np.isfinite(normals).all(axis=1) & normals.any(axis=1))] = np.nan
    uvs = _stack_uvs(parts)
    return PolygonMesh(
        positions,
        np.arange(len(corners) // 3 + 1, dtype=np.int64) * 3,
        corners,
        corner_normals=None if normals is None or np.isnan(normals).all() else normals[corners],
        corner_uvs=None if uvs is None else uvs[corners],
        vertex_colors=_stack([part.colors for part in parts]),
        position_dtype=np.dtype(np.float32),
        **_joined_materials(parts),
    )


def _joined_materials(parts: list[_Part]) -> dict[str, Any]:
    """Materials of the faces of all parts, and their names in the order that they come."""
    names = tuple(dict.fromkeys(part.material for part in parts if part.material))
    if not names:
        return {}
    numbers = {name: number for number, name in enumerate(names)} | {"": -1}
    materials = [np.full(len(part.faces), numbers[part.material], dtype=np.int64) for part in parts]
    return {"face_materials": np.concatenate(materials), "material_names": names}


def _stack(arrays: list[Any]) -> Any:
    """The arrays one after the other, or None unless every part has one."""
    present = [array for array in arrays if array is not None]
    return np.concatenate(present) if len(present) == len(arrays) else None


def _stack_uvs(parts: list[_Part]) -> Floats | None:
    """Texture coordinates of all parts, NaN for those that have none, or None if no part has any."""
    if all(part.uvs is None for part in parts):
        return None
    blank = [np.full((len(part.positions), 2), np.nan) for part in parts]
    return np.concatenate([b if part.uvs is None else part.uvs for part, b in zip(parts, blank, strict=True)])


def _stored_normals(part: Any) -> Floats | None:
    """Vertex normals that the file itself has: trimesh would make some up otherwise."""
    if "vertex_normals" not in part._cache:
        return None
    normals = np.array(part.vertex_normals, dtype=np.float64)
    return normals if normals.shape == part.vertices.shape else None


def _stored_colors(part: Any) -> NDArray[np.generic] | None:
    """Vertex colors that the file itself has, beside a texture or without one."""
    if getattr(part.visual, "kind", None) == "vertex":
        return np.asarray(part.visual.vertex_colors, dtype=np.uint8)
    colors = getattr(part.visual, "vertex_attributes", {}).get("color")
    if colors is None or len(colors) != len(part.vertices):
        return None
    return _byte_colors(np.asarray(colors))


def _stored_uvs(part: Any) -> Floats | None:
    uv = getattr(part.visual, "uv", None)
    if uv is None or np.shape(uv) != (len(part.vertices), 2):
        return None
    return np.array(uv, dtype=np.float64)


def write_other(mesh: PolygonMesh, out: BinaryIO, format: str) -> None:
    """Write ``mesh`` in a format that trimesh writes, polygons cut into triangles.

    Positions are rounded to float32, as most of these formats store them. GLB takes normals, uvs, colors and
    materials along; a mesh of several materials becomes as many parts. STL and 3MF hold nothing but the shape, as
    trimesh writes them: their vertices are not repeated for what they would lose. Raises FormatError where trimesh
    cannot write.
    """
    trimesh = _import_trimesh()
    round_to(mesh.positions, np.dtype(np.float32))
    try:
        made = _scene(mesh, trimesh) if format == "glb" else _shape(mesh, trimesh)
        content: Any = made.export(file_type=format)
    except Exception as error:
        raise FormatError(f"writing {format} failed: {_one_line(error)}") from None
    if format == "glb" and mesh.looks is not None:
        content = add_looks(content, mesh.looks)
    out.write(content.encode() if isinstance(content, str) else content)


def _shape(mesh: PolygonMesh, trimesh: Any) -> Any:
    """The triangles alone."""
    return trimesh.Trimesh(mesh.positions, mesh.face_vertices[triangle_corners(mesh)], process=False)


def _scene(mesh: PolygonMesh, trimesh: Any) -> Any:
    """The mesh with its attributes, one part for each material."""
    wedges = split_vertices(mesh, np.dtype(np.float32))
    corners = triangle_corners(mesh)
    triangles = wedges.face_wedges[corners]
    materials = np.full(len(corners), -1)
    if mesh.face_materials is not None:
        materials = mesh.face_materials[mesh.corner_faces[corners[:, 0]]]
    present = np.unique(materials).tolist()
    if len(present) < 2:
        used = np.arange(len(wedges.vertices))
        return _part(mesh, trimesh, wedges, used, triangles, present[0] if present else -1)
    scene = trimesh.Scene()
    for material in present:
        used, local = np.unique(triangles[materials == material], return_inverse=True)
        scene.add_geometry(_part(mesh, trimesh, wedges, used, local.reshape(-1, 3), material))
    return scene


def _part(mesh: PolygonMesh, trimesh: Any, wedges: Wedges, used: Ints, triangles: Ints, material: int) -> Any:
    """The wedges ``used (w,)`` and triangles ``(t,3)`` between them."""
    attributes: dict[str, Any] = {}
    if mesh.corner_normals is not None:
        attributes["vertex_normals"] = wedge_rows(wedges, mesh.corner_normals, 0.0)[used]
    colors = None if mesh.vertex_colors is None else _byte_colors(mesh.vertex_colors)[wedges.vertices[used]]
    uvs = None if mesh.corner_uvs is None else wedge_rows(wedges, mesh.corner_uvs, 0.0)[used]
    if uvs is not None or material >= 0:
        name = mesh.material_names[material] if material >= 0 else None
        attributes["visual"] = _texture(uvs, name, colors)
    elif colors is not None:
        attributes["vertex_colors"] = colors
    return trimesh.Trimesh(mesh.positions[wedges.vertices[used]], triangles, process=False, **attributes)


def _texture(uvs: Floats | None, name: str | None, colors: NDArray[np.uint8] | None) -> Any:
    """Texture coordinates and a material with a name alone: ``add_looks`` tells what it looks like."""
    from trimesh.visual import TextureVisuals, material

    textured: Any = TextureVisuals
    plain: Any = material.PBRMaterial
    made = textured(uv=uvs, material=plain(name=name))
    if colors is not None:
        opaque = np.full((len(colors), 1), 255, dtype=np.uint8)
        made.vertex_attributes["color"] = colors if colors.shape[1] == 4 else np.concatenate([colors, opaque], axis=1)
    return made


def _byte_colors(colors: NDArray[np.generic]) -> NDArray[np.uint8]:
    if colors.dtype.kind != "f":
        return colors.astype(np.uint8)
    return np.rint(np.clip(colors.astype(np.float64), 0, 1) * 255).astype(np.uint8)

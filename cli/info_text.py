"""What `info` found, as a few lines for people."""

from __future__ import annotations

from typing import Any

from curvify.words import count_of, marks_of

_SIDES = {"3": "triangle", "4": "quad", "5": "pentagon", "6": "hexagon"}


def as_text(name: str, info: dict[str, Any], quiet: bool) -> str:
    """Rows of a heading and what there is to say; those with nothing to say are left out."""
    rows = [
        ("vertices", _vertices(info)),
        ("faces", _faces(info)),
        ("bounds", _bounds(info["bounds"])),
        *(_shape(info["shape"]) if info["shape"] else []),
        ("attributes", _attributes(info)),
        ("marks", _marks(info["marks"])),
        ("refine", _refine(info["refine"])),
    ]
    lines = [name, *(f"  {heading:<12}{text}" for heading, text in rows if text)]
    if not quiet:
        lines += [f"  {'warning':<12}{text}" for text in info["refine"].get("warnings", [])]
    return "\n".join(lines)


def _vertices(info: dict[str, Any]) -> str:
    unused = f", {info['unused_vertices']:,} of them in no face" if info["unused_vertices"] else ""
    return f"{info['vertices']:,}{unused}"


def _faces(info: dict[str, Any]) -> str:
    kinds = [
        count_of(number, _SIDES[size]) if size in _SIDES else f"{number:,} of {size} sides"
        for size, number in info["polygons"].items()
    ]
    shown = kinds[:6] + (["..."] if len(kinds) > 6 else [])
    return f"{info['faces']:,}" + (f": {', '.join(shown)}" if kinds else "")


def _bounds(bounds: dict[str, Any] | None) -> str:
    if bounds is None:
        return ""
    axes = zip("xyz", bounds["low"], bounds["high"], strict=True)
    return ", ".join(f"{axis} {low:.6g} to {high:.6g}" for axis, low, high in axes) + (
        f"; diagonal {bounds['diagonal']:.6g}"
    )


def _shape(shape: dict[str, Any]) -> list[tuple[str, str]]:
    length, bends, plane = shape["edge_length"], shape["bends"], shape["planarity"]
    open_ = "closed" if shape["closed"] else f"open with {count_of(shape['boundary_loops'], 'boundary loop')}"
    genus = "no genus" if shape["genus"] is None else f"genus {shape['genus']}"
    inside = "" if shape["volume"] is None else f", volume {shape['volume']:.6g}"
    bent = ""
    if bends["most_degrees"] is not None:
        bent = (
            f"{bends['mean_degrees']:.3g} degrees between neighbors in the mean, at most {bends['most_degrees']:.3g} "
            f"at edge {bends['edge'][0]}-{bends['edge'][1]}"
        )
    crease = f"{count_of(shape['creases'], 'edge')} sharp" if shape["creases"] else ""
    tilt = f"sides leave their face's plane by at most {plane['most_degrees']:.3g} degrees, in face {plane['face']}"
    bad = shape["concave_faces"]
    concave = f"{count_of(bad, 'face')} concave" if bad else "all faces are convex"
    return [
        ("edges", f"{shape['edges']:,}, {length['least']:.4g} to {length['most']:.4g} long, mean {length['mean']:.4g}"),
        ("shape", f"{count_of(shape['pieces'], 'piece')}, {open_}, {genus}, area {shape['area']:.6g}{inside}"),
        ("odd", _odd(shape)),
        ("planarity", "all faces are planar" if plane["most_degrees"] < 1e-6 else tilt),
        ("convexity", concave),
        ("angles", "; ".join(part for part in (bent, crease) if part)),
    ]


def _odd(shape: dict[str, Any]) -> str:
    kinds = {
        "open_edges": ("edge of one face", "edges of one face"),
        "crowded_edges": ("edge of more than two faces", "edges of more than two faces"),
        "reversed_edges": ("edge whose faces run the same way", "edges whose faces run the same way"),
        "pinched_vertices": ("vertex that surfaces share", "vertices that surfaces share"),
        "degenerate_faces": ("face without area", "faces without area"),
        "duplicate_faces": ("face that repeats another", "faces that repeat another"),
        "welded_vertices": ("vertex closed into a seam", "vertices closed into seams"),
    }
    return ", ".join(count_of(shape[key], one, many) for key, (one, many) in kinds.items() if shape[key])


def _attributes(info: dict[str, Any]) -> str:
    attributes, corners = info["attributes"], info["corners"]

    def of_corners(name: str, number: int) -> str:
        return name + (f" at {number:,} of {count_of(corners, 'corner')}" if number < corners else "")

    parts = [
        of_corners(name.replace("_", " "), attributes[name])
        for name in ("normals", "texture_coordinates")
        if attributes[name]
    ]
    if attributes["vertex_colors"]:
        parts.append(f"vertex colors ({attributes['vertex_colors']})")
    for name in ("material", "group"):
        if names := attributes[f"{name}s"]:
            parts.append(f"{count_of(len(names), name)} ({', '.join(names[:5])}{', ...' if len(names) > 5 else ''})")
    if attributes["smoothing_groups"]:
        parts.append(count_of(attributes["smoothing_groups"], "smoothing group"))
    return ", ".join(parts) or "none"


def _marks(marks: dict[str, dict[str, int]]) -> str:
    return "; ".join(f"from {source}: {marks_of(kinds)}" for source, kinds in marks.items() if kinds) or "none"


def _refine(refine: dict[str, Any]) -> str:
    asked = f"--scheme {refine['scheme']} --level {refine['level']}"
    if "error" in refine:
        return f"{asked} would refuse: {refine['error']}"
    if "not_tried" in refine:
        return f"{asked} was not tried: {refine['not_tried']}"
    patches = count_of(refine["patches"], "patch", "patches")
    return f"{asked} would make {count_of(refine['faces'], 'face')} on {patches}"

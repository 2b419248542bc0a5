"""What the materials of a glTF file look like: carried from file to file as they are, images to the byte.

trimesh reads and writes the meshes of glTF; of materials it would keep a part, and pack images anew. So the file's own
JSON is taken here: materials, textures, samplers, and the images that they refer to (glTF 2.0, sections 3.8, 3.9, 4.4).
"""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from curvify.mesh import Looks

_MAGIC, _JSON, _BINARY = b"glTF", 0x4E4F534A, 0x004E4942
#: How the images of glTF begin. Nothing else is taken from where a file says that an image is: it may say anything.
_IMAGES = {b"\x89PNG": "image/png", b"\xff\xd8": "image/jpeg", b"RIFF": "image/webp", b"\xabKTX": "image/ktx2"}


def read_looks(data: bytes, format: str, folder: Path) -> tuple[bytes, Looks | None]:
    """The file with a name of its own for each material, and what they look like; None where it has no material. One
    without a name that says nothing is none.

    Raises ValueError, KeyError, IndexError, TypeError or struct.error where the file is not what it should be.
    """
    header, binary = _split(data) if format == "glb" else (json.loads(data), b"")
    materials = [m for m in header.get("materials", []) if any(m.values())]
    if not materials:
        return data, None
    taken: set[str] = set()
    for number, material in enumerate(materials):
        material["name"] = _free_name(str(material.get("name") or f"material_{number}"), taken)
    images = [_image(image, header, binary, folder) for image in header.get("images", [])]
    textures, samplers = header.get("textures", []), header.get("samplers", [])
    looks = Looks({material["name"]: _on_first_map(material) for material in materials}, textures, samplers, images)
    return (_joined(header, binary) if format == "glb" else json.dumps(header).encode()), looks


def add_looks(data: bytes, looks: Looks) -> bytes:
    """A GLB file whose materials, which have a name alone, look like those of the same names."""
    header, binary = _split(data)
    header["materials"] = [looks.materials.get(m.get("name", ""), m) for m in header.get("materials", [])]
    if not any(material.get("name") in looks.materials for material in header["materials"]):
        return data
    views, images = header.setdefault("bufferViews", []), []
    for image, content in looks.images:
        if content is not None:
            binary += bytes(-len(binary) % 4)
            image = {**image, "bufferView": len(views)}
            views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(content)})
            binary += content
        images.append(image)
    header["buffers"] = [{"byteLength": len(binary)}]
    header |= {"images": images, "textures": looks.textures, "samplers": looks.samplers}
    used = _extensions([header["materials"], looks.textures])
    if used:
        header["extensionsUsed"] = sorted({*header.get("extensionsUsed", []), *used})
    return _joined({key: value for key, value in header.items() if value != []}, binary)


def _free_name(name: str, taken: set[str]) -> str:
    """The name, or one like it that is not taken yet."""
    tries, free = 1, name
    while free in taken:
        tries += 1
        free = f"{name}_{tries}"
    taken.add(free)
    return free


def _on_first_map(part: Any) -> Any:
    """A material without the textures that lie on a second map of texture coordinates: only the first is kept."""
    if not isinstance(part, dict):
        return part
    kept = {key: value for key, value in part.items() if not (isinstance(value, dict) and value.get("texCoord", 0) > 0)}
    return {key: _on_first_map(value) for key, value in kept.items()}


def _image(
    image: dict[str, Any], header: dict[str, Any], binary: bytes, folder: Path
) -> tuple[dict[str, Any], bytes | None]:
    """An image without its place, and its bytes; with its place, and None, where no image can be had."""
    if "bufferView" in image:
        view = header["bufferViews"][image["bufferView"]]
        source = header["buffers"][view["buffer"]].get("uri")
        content = binary if source is None else _fetched(source, folder)
        if content is not None:
            start = view.get("byteOffset", 0)
            content = content[start : start + view["byteLength"]]
    else:
        content = _fetched(image["uri"], folder)
    kind = next((kind for start, kind in _IMAGES.items() if content and content.startswith(start)), None)
    if kind is None:
        return image, None
    plain = {key: value for key, value in image.items() if key not in ("uri", "bufferView")}
    return {"mimeType": kind, **plain}, content


def _fetched(uri: str, folder: Path) -> bytes | None:
    """What a reference stands for: data written in it, or a file beside the mesh."""
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    try:
        return (folder / unquote(uri)).read_bytes()
    except OSError:
        return None


def _extensions(part: Any) -> set[str]:
    """The names of all extensions that some JSON uses."""
    if isinstance(part, list):
        return set().union(*map(_extensions, part))
    if not isinstance(part, dict):
        return set()
    return set(part.get("extensions", {})).union(*map(_extensions, part.values()))


def _split(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON of a GLB file and its binary chunk."""
    magic, _, _ = struct.unpack_from("<4sII", data)
    size, kind = struct.unpack_from("<II", data, 12)
    if magic != _MAGIC or kind != _JSON:
        raise ValueError("this is no GLB file")
    header: dict[str, Any] = json.loads(data[20 : 20 + size])
    if len(data) <= 20 + size:
        return header, b""
    length, _ = struct.unpack_from("<II", data, 20 + size)
    return header, data[28 + size : 28 + size + length]


def _joined(header: dict[str, Any], binary: bytes) -> bytes:
    """A GLB file."""
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    chunks = struct.pack("<II", len(text), _JSON) + text
    if binary:
        chunks += struct.pack("<II", len(binary), _BINARY) + binary
    return struct.pack("<4sII", _MAGIC, 2, 12 + len(chunks)) + chunks

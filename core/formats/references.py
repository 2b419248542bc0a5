"""Other files that a mesh file is made of: the buffers and images of glTF."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from urllib.parse import unquote


def referenced_files(path: str) -> list[str]:
    """Files that a mesh file is read from beside itself; none where it cannot be read. Images count if they are there.

    An OBJ file's materials are known by name only: its library is not read.
    """
    if Path(path).suffix.lower() != ".gltf":
        return []
    try:
        content: Any = json.loads(Path(path).read_bytes())
        buffers, images = (_beside(path, content.get(kind, [])) for kind in ("buffers", "images"))
    except (OSError, ValueError, AttributeError, TypeError):
        return []
    return buffers + [image for image in images if Path(image).is_file()]


def _beside(path: str, parts: list[dict[str, str]]) -> list[str]:
    """The files that buffers or images are in."""
    uris = [part["uri"] for part in parts if "uri" in part]
    return [str(Path(path).parent / unquote(uri)) for uri in uris if not uri.startswith("data:")]

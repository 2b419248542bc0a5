"""Other files that a mesh file takes its geometry from: the buffers of glTF."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from urllib.parse import unquote


def referenced_files(path: str) -> list[str]:
    """Files that the mesh in a file is read from beside itself; none where it cannot be read.

    An OBJ file's materials are known by name only: its library is not read.
    """
    if Path(path).suffix.lower() != ".gltf":
        return []
    try:
        content: Any = json.loads(Path(path).read_bytes())
        uris = [buffer["uri"] for buffer in content.get("buffers", []) if "uri" in buffer]
    except (OSError, ValueError, AttributeError, TypeError):
        return []
    return [str(Path(path).parent / unquote(uri)) for uri in uris if not uri.startswith("data:")]

"""What pyproject.toml says about the tree is true, and importing the package stays cheap."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import curvify

ROOT = Path(__file__).resolve().parents[1]
PROJECT = (ROOT / "pyproject.toml").read_text()
FOLDERS = {"core": "curvify", "cli": "curvify.cli", "gpu": "curvify.gpu"}


def package_folders() -> set[str]:
    """Every folder below the sources that holds an ``__init__.py``, under the name it is imported by."""
    found = set()
    for folder, name in FOLDERS.items():
        for init in (ROOT / folder).rglob("__init__.py"):
            inner = init.parent.relative_to(ROOT / folder).parts
            found.add(".".join([name, *inner]))
    return found


def test_the_listed_packages_are_those_in_the_tree() -> None:
    listed = re.search(r"^packages = \[(.*?)\]", PROJECT, re.MULTILINE | re.DOTALL)
    assert listed is not None
    assert set(re.findall(r'"([\w.]+)"', listed[1])) == package_folders()


def test_every_folder_with_modules_is_a_package() -> None:
    for folder in FOLDERS:
        for module in (ROOT / folder).rglob("*.py"):
            assert (module.parent / "__init__.py").exists(), f"{module.parent} has no __init__.py"


def test_files_beside_the_modules_are_packaged() -> None:
    table = re.search(r"^\[tool.setuptools.package-data\]\n(.*?)\n\n", PROJECT, re.MULTILINE | re.DOTALL)
    assert table is not None
    packaged = set()
    for package, patterns in re.findall(r'^"([\w.]+)" = \[(.*?)\]', table[1], re.MULTILINE | re.DOTALL):
        folder = next(ROOT / folder for folder, name in FOLDERS.items() if name == package)
        for pattern in re.findall(r'"(.*?)"', patterns):
            found = set(folder.glob(pattern))
            assert found, f"{package}: no file is {pattern}"
            packaged |= found
    beside = {
        path
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and path.suffix not in (".py", ".pyc")
    }
    assert beside == packaged


def test_the_version_stands_in_two_places_and_is_one() -> None:
    written = re.search(r'^version = "(.*?)"', PROJECT, re.MULTILINE)
    assert written is not None
    assert written[1] == curvify.__version__


def loaded_by(statement: str) -> set[str]:
    """Top-level modules in a fresh interpreter after a statement."""
    code = f"import sys; {statement}; print(*{{name.partition('.')[0] for name in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_importing_the_package_alone_does_not_load_numpy() -> None:
    assert not {"numpy", "click", "trimesh"} & loaded_by("import curvify")


def test_refining_loads_no_heavy_library() -> None:
    statement = (
        "import curvify; "
        "curvify.surface(curvify.PolygonMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).refine(2)"
    )
    loaded = loaded_by(statement)
    assert "numpy" in loaded
    assert not {"trimesh", "scipy", "numba", "pymeshlab", "moderngl", "PIL", "click"} & loaded

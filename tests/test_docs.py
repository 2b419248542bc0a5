"""The pages of docs/: those of the commands are what the commands say, and no link leads nowhere."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
import yaml

from opengl import device_or_skip

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"


def make_commands() -> ModuleType:
    """The script that writes the pages."""
    spec = importlib.util.spec_from_file_location("make_commands", DOCS / "make_commands.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_pages_of_the_commands_are_up_to_date() -> None:
    expected = make_commands().pages()
    found = {path.name: path.read_text(encoding="utf-8") for path in (DOCS / "commands").glob("*.md")}
    assert sorted(found) == sorted(expected), "run make docs"
    for name, text in expected.items():
        assert found[name] == text, f"docs/commands/{name} is not what the command says: run make docs"


PAGES = sorted([*DOCS.rglob("*.md"), ROOT / "README.md"])


@pytest.mark.parametrize("page", PAGES, ids=[str(page.relative_to(ROOT)) for page in PAGES])
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


@pytest.fixture
def bash(tmp_path: Path):
    """Run lines in a folder of its own, in which ``curvify`` is this one."""
    program = tmp_path / "bin" / "curvify"
    program.parent.mkdir()
    program.write_text(f"#!/bin/sh\nexec '{sys.executable}' -c 'from curvify.cli.main import main; main()' \"$@\"\n")
    program.chmod(0o755)
    environment = os.environ | {"PATH": f"{program.parent}{os.pathsep}{os.environ['PATH']}"}

    def bash(lines: str) -> str:
        ended = subprocess.run(
            ["bash", "-ec", lines], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120
        )
        assert ended.returncode == 0, f"{lines}\n{ended.stdout}{ended.stderr}"
        return ended.stdout

    return bash


def shell_blocks(page: str) -> list[str]:
    """The lines that a page asks to type."""
    return re.findall(r"```sh\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL)


def test_the_page_on_checking_works_as_written(bash, tmp_path: Path) -> None:
    shutil.copy(ROOT / "sample_meshes" / "pawn.obj", tmp_path / "part.obj")
    (tmp_path / "assets" / "inner").mkdir(parents=True)
    for folder in ("assets", "assets/inner"):
        shutil.copy(tmp_path / "part.obj", tmp_path / folder)
    blocks = shell_blocks("checking.md")
    assert len(blocks) >= 5
    for block in blocks:
        bash(block)
    recipe = re.search(r"```make\n(.*?)```", (DOCS / "checking.md").read_text(encoding="utf-8"), re.DOTALL)
    assert recipe is not None
    (tmp_path / "Makefile").write_text(recipe[1])
    assert "yes: equal" in bash("make --silent golden-check")
    (code,) = re.findall(r"```python\n(.*?)```", (DOCS / "checking.md").read_text(encoding="utf-8"), re.DOTALL)
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout.splitlines()[-1]) == (0, "0")


def test_the_recipes_for_scripts_tell_what_differs(bash, tmp_path: Path) -> None:
    (tmp_path / "assets").mkdir()
    for name in ("ring", "vase"):
        shutil.copy(ROOT / "sample_meshes" / f"{name}.obj", tmp_path / "assets")
    text = (DOCS / "checking.md").read_text(encoding="utf-8")
    _, goldens, closed = re.findall(r"```bash\n(.*?)```", text, re.DOTALL)
    bash(next(block for block in shell_blocks("checking.md") if "--output-dir golden" in block))
    assert bash(goldens) == ""
    ring = tmp_path / "assets" / "ring.obj"
    ring.write_text(re.sub(r"^v \S+", "v 3", ring.read_text(), count=1, flags=re.MULTILINE))
    (tmp_path / "check.sh").write_text(goldens)
    assert bash("sh check.sh || echo $?") == "golden/ring.ply differs\n1\n"
    assert bash(closed) == "assets/vase.obj is not closed\n"


@pytest.mark.skipif(shutil.which("jq") is None, reason="no jq")
def test_the_report_answers_jq(bash, tmp_path: Path) -> None:
    recipe = re.findall(r"```bash\n(.*?)```", (DOCS / "checking.md").read_text(encoding="utf-8"), re.DOTALL)[0]
    shutil.copy(ROOT / "sample_meshes" / "pawn.obj", tmp_path / "part.obj")
    assert bash(recipe) == "true\n"
    shutil.copy(ROOT / "sample_meshes" / "l_part.obj", tmp_path / "part.obj")
    assert bash(f"{recipe.strip()} || echo no") == "false\nno\n"  # it is warned of concave faces


def test_the_recipes_for_servers_work_as_written(bash, tmp_path: Path) -> None:
    shutil.copy(ROOT / "sample_meshes" / "pawn.obj", tmp_path / "part.obj")
    bash("curvify refine part.obj golden.ply --level 3")
    text = (DOCS / "checking.md").read_text(encoding="utf-8")
    github, gitlab = (yaml.safe_load(block) for block in re.findall(r"```yaml\n(.*?)```", text, re.DOTALL))
    lines = [step["run"] for step in github["jobs"]["golden"]["steps"] if "run" in step]
    assert lines == gitlab["golden"]["script"] and lines[0] == "pip install ./curvify"
    bash("\n".join(lines[1:]))
    assert (tmp_path / "heat.ply").exists()


def test_groups_become_creases_as_the_page_says(bash, tmp_path: Path) -> None:
    lines = (ROOT / "sample_meshes" / "knob.obj").read_text().splitlines()
    faces = [line for line in lines if line.startswith("f ")]
    rest = [line for line in lines if line[:2] not in ("f ", "g ", "s ")]
    grouped = ["g top", *faces[:20], "g below", *faces[20:30], "g top", *faces[30:]]
    (tmp_path / "part.obj").write_text("\n".join(rest + grouped) + "\n")
    (recipe,) = (block for block in shell_blocks("sharp-features.md") if "awk" in block)
    bash(recipe)
    said = bash("curvify info grouped.obj")
    assert "2 smoothing groups" in said
    assert re.search(r"from groups: [1-9]", said)


def test_the_first_five_minutes_work_as_written(bash, tmp_path: Path) -> None:
    with device_or_skip():
        pass
    shutil.copytree(ROOT / "sample_meshes", tmp_path / "sample_meshes")
    install, lines = re.findall(r"```sh\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    assert "pip install ." in install
    said = bash(lines)
    assert "up to" in said and "manifold: yes" in said and said.endswith("groups: yes: equal\n")
    made = ("pawn.ply", "pawn.png", "pawn.html", "sharp.ply", "apart.png", "out/vase.ply")
    assert all((tmp_path / name).stat().st_size for name in made)


def test_the_lines_on_completion_give_scripts(bash) -> None:
    sources = re.findall(r"_CURVIFY_COMPLETE=\w+_source curvify", "".join(shell_blocks("shell-completion.md")))
    assert len(sources) == 3
    for source in sources:
        assert "_curvify_completion" in bash(source)
    typed = "COMP_WORDS=(curvify ref); COMP_CWORD=1; _curvify_completion curvify; echo ${COMPREPLY[0]}"
    assert bash(f'eval "$({sources[0]})"; {typed}') == "refine\n"

# `make demo` refines a sample mesh; `make test` runs everything. Both make their own .venv first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test lint goldens pictures gallery docs clean

$(VENV)/demo.stamp: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	touch $@

$(VENV)/test.stamp: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	touch $@

demo: $(VENV)/demo.stamp
	mkdir -p build
	$(BIN)/curvify refine sample_meshes/pawn.obj build/pawn.ply --level 5
	@echo "Wrote build/pawn.ply: 90 polygons became a smooth surface. Open it in any mesh viewer."

# mypy does not see through the mapping of core/ to curvify: it is shown a tree of links.
lint: $(VENV)/test.stamp
	$(BIN)/ruff check .
	rm -rf build/typed && mkdir -p build/typed/curvify
	ln -s $(CURDIR)/core/* $(CURDIR)/cli $(CURDIR)/gpu build/typed/curvify/
	MYPYPATH=build/typed $(BIN)/mypy -p curvify

test: lint
	$(BIN)/python -m pytest

goldens: $(VENV)/test.stamp
	$(BIN)/python -m pytest tests/test_goldens.py --update-goldens

# The pictures of the README and of the gallery; they need OpenGL, which Mesa provides in software.
pictures: $(VENV)/demo.stamp
	$(BIN)/python docs/pictures/make_pictures.py

gallery: $(VENV)/demo.stamp
	$(BIN)/python docs/gallery/make_gallery.py

# The pages of the commands, from what the commands say.
docs: $(VENV)/test.stamp
	$(BIN)/python docs/make_commands.py

clean:
	rm -rf $(VENV) build

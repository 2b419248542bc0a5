"""`curvify schemes`."""

from __future__ import annotations

import json

from curvify.schemes import NAMES


def test_every_scheme_is_listed_for_people(call):
    result = call("schemes")
    assert (result.code, result.err) == (0, "")
    text = result.out.decode()
    for name in NAMES:
        assert f"{name}: " in text
    assert "--cross-tangent precise" in text


def test_every_scheme_is_listed_for_programs(call):
    schemes = json.loads(call("schemes", "--json").out)
    assert [scheme["name"] for scheme in schemes] == list(NAMES)
    for scheme in schemes:
        assert set(scheme) == {"name", "summary", "faces", "keeps", "continuity", "normals", "options", "source"}
    assert schemes[0]["options"]["alpha"] == 1.0
    assert schemes[0]["normals"][0] == "exact"

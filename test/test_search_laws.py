"""A strong brake at one point, of which no entry of the catalogue has the law, is told on the ladder."""

from __future__ import annotations

from test_search_explains import searched
from test_simulate_identify import shaken

#: N s/m, and where it acts, m.
BRAKE, POINT = 300.0, (0.2, 0.4, -0.3)


def test_a_strong_brake_is_told_as_a_law_of_one_point() -> None:
    effects = {"point_law.brake": (BRAKE, 0.0), "point_law.position": POINT}
    found = searched(shaken(14, 10.0), effects, 3).told
    assert found is not None
    assert found.told
    (finding,) = found.mismatch.findings
    assert finding.effect == "unknown"
    assert "in proportion to velocity" in finding.statement
    told = finding.parameters
    for name, value in {
        "damping": BRAKE,
        "point_x": POINT[0],
        "point_y": POINT[1],
        "point_z": POINT[2],
    }.items():
        entry = told[name]
        assert abs(entry["value"] - value) < 4.0 * entry["std"], name

"""A cable's weight that the lab knows is in the model, in the statics, and no longer in doubt."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation
from test_model_rigs import thesis_case_14
from test_simulate_identify import shaken

from rig_identification.errors import InputError
from rig_identification.live.generalized_wrench import generalized_wrench
from rig_identification.model.equilibrium import find_rest, own_weights
from rig_identification.model.motion import rig_model
from rig_identification.search.identify import identify
from rig_identification.session.rig_description import read_rig
from rig_identification.session.rig_document import rig_document
from rig_identification.simulate import simulate_session

DENSITY = 0.15


def test_it_is_read_and_written(tmp_path: Path) -> None:
    rig = replace(thesis_case_14().rig, cable_linear_density=DENSITY)
    file = tmp_path / "rig.yaml"
    file.write_text(yaml.safe_dump(rig_document(rig)))
    assert read_rig(file).cable_linear_density == pytest.approx(DENSITY)
    document = rig_document(rig)
    document["/**"]["ros__parameters"]["cable_linear_density"] = -0.1  # type: ignore[index]
    file.write_text(yaml.safe_dump(document))
    with pytest.raises(InputError, match=r"cable_linear_density.*weigh a metre"):
        read_rig(file)


def test_cells_read_what_the_forward_model_says() -> None:
    sample = thesis_case_14()
    rig = replace(sample.rig, cable_linear_density=DENSITY)
    model = rig_model(rig, sample.elements)
    rest = find_rest(model, sample.start)
    x = np.concatenate([rest.state.position, np.zeros(9)])
    exact = own_weights(model, x, rest.state.R_world_body)
    assert np.any(exact > 1.0)
    hinges = rest.state.position + np.array([c.body_point for c in rig.cables]) @ rest.state.R_world_body.T
    along = np.array([c.ceiling_point for c in rig.cables]) - hinges
    steepness = along[:, 2] / np.linalg.norm(along, axis=1)
    assert rig.cable_weight_at_cells(steepness) == pytest.approx(exact, rel=1e-3)


def test_wrenches_are_without_it() -> None:
    """Cells that read the cables too, and the same body as if they did not."""
    sample = thesis_case_14()
    rig = replace(sample.rig, cable_linear_density=DENSITY)
    light = find_rest(rig_model(sample.rig, sample.elements), sample.start)
    hinges = light.state.position + np.array([c.body_point for c in rig.cables]) @ light.state.R_world_body.T
    along = np.array([c.ceiling_point for c in rig.cables]) - hinges
    weight = rig.cable_weight_at_cells(along[:, 2] / np.linalg.norm(along, axis=1))
    pose = np.concatenate([light.state.position, Rotation.from_matrix(light.state.R_world_body).as_quat()])[
        None
    ]
    center, force = sample.elements[1:4], np.zeros((1, 3))
    bare = generalized_wrench(sample.rig, pose, light.tension[None], force, center)
    taken = generalized_wrench(rig, pose, (light.tension + weight)[None], force, center)
    assert np.allclose(taken, bare, atol=1e-9)


def test_what_is_known_is_not_stated_any_more() -> None:
    spec = replace(shaken(10, 10.0), effects={"cable_mass": (DENSITY,)}, doubts=False)
    session, truth = simulate_session(spec, np.random.default_rng(2))
    weighed = replace(session, rig=replace(session.rig, cable_linear_density=DENSITY))
    unknown, known = identify(session), identify(weighed)
    assert "cable_mass" in {a["effect"] for a in unknown.mismatch.alternatives}
    assert known.mismatch.verdict == "none"
    assert "cable_mass" not in {a["effect"] for a in known.mismatch.alternatives}
    std = np.sqrt(np.diag(known.total.covariance))
    assert np.max(np.abs(known.total.values - truth.elements) / std) < 3.5
    assert np.min(np.sqrt(np.diag(unknown.total.covariance))[4:] / std[4:]) > 0.95
    assert np.max(np.sqrt(np.diag(unknown.total.covariance)) / std) > 1.2


@pytest.mark.long
def test_chains_that_carry_a_light_body_are_weighed() -> None:
    """What cables may weigh is no share of what hangs from them."""
    chain = 3.0
    spec = shaken(1, 8.0)
    assert float(spec.elements[0]) < 400.0
    session, truth = simulate_session(
        replace(spec, effects={"cable_mass": (chain,)}), np.random.default_rng(5)
    )
    found = identify(session)
    assert [f.effect for f in found.mismatch.findings] == ["cable_mass"]
    told = found.mismatch.findings[0].parameters["linear_density"]
    assert abs(told["value"] - chain) < 3.0 * told["std"]  # type: ignore[operator]
    off = (found.total.values - truth.elements) / np.sqrt(np.diag(found.total.covariance))
    assert np.max(np.abs(off)) < 3.5

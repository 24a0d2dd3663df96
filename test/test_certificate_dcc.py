"""The digital calibration certificate: its numbers are the result's, and its form is the schema's.

The schema (dcc.xsd 3.1.2 and SI_Format.xsd 2.1.0, LGPL) is PTB's and is not shipped. Put both files into a
folder and name it in $DCC_SCHEMA; with `pip install xmlschema` the document is then held against it.
"""

from __future__ import annotations

import json
import os
from dataclasses import replace
from datetime import date
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from rig_identification.cli.main import main
from rig_identification.errors import InputError
from rig_identification.estimate.sources import closed
from rig_identification.report import result_to_dict
from rig_identification.report.certificate import Certificate, Number, certificate_of
from rig_identification.report.certificate_dcc import document, si_unit, write_certificate_dcc
from rig_identification.result import Identification, UncertaintySource
from rig_identification.session.laboratory_description import read_laboratory

SPACE = {"dcc": "https://ptb.de/dcc", "si": "https://ptb.de/si"}
LAB = """\
laboratory: {name: Test lab, email: lab@example.org, city: Hamburg, country: DE}
person: A. Person
customer: {name: Car maker, email: car@example.org, city: Turin, country: IT}
item: {name: Van, manufacturer: Car maker, serial: 4711}
"""


def result(identification: Identification) -> dict:
    """A result with a budget, of whose numbers Jxz is not determined."""
    total = replace(identification.total, unobservable=("Jxz",))
    sources = (
        UncertaintySource("cable_1 tension", "noise", 0.6 * total.covariance, 99.0),
        UncertaintySource("tolerance.cable_length", "tolerance", 0.3 * total.covariance, None),
    )
    told = replace(identification, total=closed(replace(total, sources=sources)), without_frame=None)
    origin = {
        "session": "van <1>",
        "recorded": "2026-03-01 10:00 UTC",
        "digest": "0123456789ab",
        "files": {"rig.yaml": "ab" * 32},
    }
    return json.loads(json.dumps(result_to_dict(told, origin)))


@pytest.fixture
def certificate(identification: Identification) -> Certificate:
    vehicle = tuple(
        Number(name, unit, 0.5, 0.01, None, 1.96, 0.0196)
        for name, unit in (
            ("center_of_mass_height", "m"),
            ("rear_axle_share", "1"),
            ("rear_axle_load", "N"),
        )
    )
    return replace(certificate_of(result(identification), "result.json"), vehicle=vehicle)


def lab(folder: Path, text: str = LAB) -> Path:
    (folder / "lab.yaml").write_text(text, encoding="utf-8")
    return folder / "lab.yaml"


def written(certificate: Certificate, folder: Path, text: str = LAB) -> ElementTree.Element:
    write_certificate_dcc(certificate, read_laboratory(lab(folder, text)), folder / "certificate.xml")
    return ElementTree.parse(folder / "certificate.xml").getroot()


def told(element: ElementTree.Element, path: str) -> str:
    found = element.find(path, SPACE)
    assert found is not None, path
    return found.text or ""


def test_each_number_stands_with_its_uncertainty(certificate: Certificate, tmp_path: Path) -> None:
    root = written(certificate, tmp_path)
    first = root.find("dcc:measurementResults/dcc:measurementResult", SPACE)
    assert first is not None
    quantities = first.findall(".//dcc:list/dcc:quantity", SPACE)
    assert len(quantities) == 10
    for quantity, number in zip(quantities, certificate.bodies[0].numbers, strict=True):
        if number.value is None:
            assert told(quantity, "dcc:noQuantity/dcc:content") == "not determined"
            assert quantity.find("si:real", SPACE) is None
            continue
        assert float(told(quantity, "si:real/si:value")) == number.value
        assert float(told(quantity, "si:real/si:expandedUnc/si:uncertainty")) == number.expanded
        k = float(told(quantity, "si:real/si:expandedUnc/si:coverageFactor"))
        assert k == pytest.approx(number.k, abs=1e-4)
    assert told(quantities[9], "si:real/si:unit") == r"\kilogram\metre\tothe{2}"
    assert quantities[6].find("dcc:noQuantity", SPACE) is not None


def test_region_and_budget_are_those_of_the_result(certificate: Certificate, tmp_path: Path) -> None:
    root = written(certificate, tmp_path)
    body = certificate.bodies[0]
    known = [n for n in body.numbers if n.value is not None]
    columns = root.findall(".//si:covarianceMatrix/si:column", SPACE)
    matrix = np.array([[float(told(c, "si:value")) for c in column] for column in columns])
    assert matrix.shape == (9, 9)
    assert np.sqrt(np.diag(matrix)) == pytest.approx([n.u for n in known])
    # Nine numbers lie together within sqrt(16.92) standard deviations in 95 % (chi-square table)
    (region,) = root.findall(".//si:ellipsoidalRegionXMLList", SPACE)
    assert float(told(region, "si:coverageFactor")) == pytest.approx(np.sqrt(16.919), abs=1e-3)
    budgets = [q for q in root.findall(".//dcc:quantity", SPACE) if "variance of" in "".join(q.itertext())]
    assert len(budgets) == 9
    for budget, number in zip(budgets, known, strict=True):
        rows = [float(v) for v in told(budget, "si:realListXMLList/si:valueXMLList").split()]
        names = told(budget, "si:realListXMLList/si:labelXMLList").split()
        assert "cable_1_tension" in names
        assert len(names) == len(rows)
        assert sum(rows) == pytest.approx(number.u**2, rel=1e-9)  # type: ignore[operator]


def test_units_multiply() -> None:
    assert si_unit("kg", "m") == r"\kilogram\metre"
    assert si_unit("kg m²", "kg m²") == r"\kilogram\tothe{2}\metre\tothe{4}"
    assert si_unit("1") == r"\one"


def test_who_and_when(certificate: Certificate, tmp_path: Path) -> None:
    core = written(certificate, tmp_path).find("dcc:administrativeData/dcc:coreData", SPACE)
    assert core is not None
    assert told(core, "dcc:beginPerformanceDate") == "2026-03-01"
    assert told(core, "dcc:uniqueIdentifier") == "rig_identification-0123456789ab"
    values = [e.text for e in core.findall("dcc:identifications/dcc:identification/dcc:value", SPACE)]
    assert values == ["van <1>", "0123456789ab", "ab" * 32]
    core = written(certificate, tmp_path, f"{LAB}identifier: C-17\nmeasured: 2026-02-27\n").find(
        "dcc:administrativeData/dcc:coreData", SPACE
    )
    assert core is not None
    assert told(core, "dcc:uniqueIdentifier") == "C-17"
    assert told(core, "dcc:endPerformanceDate") == "2026-02-27"


def test_no_date_is_asked_for(certificate: Certificate, tmp_path: Path) -> None:
    """Stamps that count from an unknown start are no date."""
    undated = replace(certificate, provenance={**certificate.provenance, "recorded": ""})
    laboratory = read_laboratory(lab(tmp_path))
    with pytest.raises(InputError, match="measured: 2026-03-01"):
        document(undated, laboratory)
    assert document(undated, replace(laboratory, measured=date(2026, 3, 1))) is not None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("person: A", "laboratory: missing"),
        (LAB.replace("country: DE", "country: Germany"), "laboratory.country: 'Germany' is no country code"),
        (LAB.replace("serial: 4711", "seral: 4711"), "item.seral: unknown key"),
        (f"{LAB}measured: March\n", "measured: 'March' is no date"),
    ],
)
def test_a_description_that_lacks_something_is_refused(
    text: str,
    message: str,
    identification: Identification,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "result.json").write_text(json.dumps(result(identification)))
    command = ["certificate", str(tmp_path / "result.json"), "--out", str(tmp_path / "out")]
    assert main([*command, "--dcc", str(lab(tmp_path, text))]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_command_writes_it(identification: Identification, tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text(json.dumps(result(identification)))
    command = ["certificate", str(tmp_path / "result.json"), "--out", str(tmp_path / "out")]
    assert main([*command, "--dcc", str(lab(tmp_path))]) == 0
    assert ElementTree.parse(tmp_path / "out" / "certificate.xml").getroot().get("schemaVersion") == "3.1.2"


def test_the_form_is_the_schemas(certificate: Certificate, tmp_path: Path) -> None:
    xmlschema = pytest.importorskip("xmlschema", reason="pip install xmlschema")
    if not (folder := os.environ.get("DCC_SCHEMA")):
        pytest.skip("the schema is PTB's: name the folder with dcc.xsd and SI_Format.xsd in $DCC_SCHEMA")
    written(certificate, tmp_path)
    of_si = (Path(folder) / "SI_Format.xsd").as_uri()
    schema = xmlschema.XMLSchema(str(Path(folder) / "dcc.xsd"), locations={"https://ptb.de/si": of_si})
    found = [f"{e.path}: {e.reason}" for e in schema.iter_errors(str(tmp_path / "certificate.xml"))]
    assert found == []

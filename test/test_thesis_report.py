"""``rig-identification thesis``: one case from the command line, its numbers, its page and its figures."""

import json
from xml.etree import ElementTree

import pytest
from jinja2 import Environment

from rig_identification.cli.main import main
from rig_identification.thesis import load_case
from rig_identification.thesis_report import rerun_document
from rig_identification.thesis_report.integration_figures import integration_figures
from rig_identification.thesis_report.sections import BEFORE, add_sections
from rig_identification.thesis_report.summary import summary
from rig_identification.thesis_rerun import Rerun, fly_case
from rig_identification.thesis_rerun.integration import check_integration
from rig_identification.thesis_rerun.statics import rerun_statics


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("thesis") / "out"
    assert main(["thesis", "--case", "8", "--out", str(folder)]) == 0
    return folder


def test_numbers(written):
    document = json.loads((written / "thesis.json").read_text())
    (case,) = document["cases"]
    assert case["case"] == "8"
    assert case["true"] == load_case(8).inertia.tolist()
    assert case["errors"]["published"]["xz"] == pytest.approx(124.04)
    assert case["output_error"]["worst_percent"] < 0.01
    assert set(case["output_error"]["guess_times"]) == {"0.2", "5"}
    for far in case["output_error"]["guess_times"].values():
        assert far["converged"]
        assert far["worst_percent"] < 0.01
    assert case["searches_apart"] < 1e-3
    assert set(case["searches"]) == {"gauss_newton", "levenberg_marquardt", "regularized_gauss_newton"}
    assert len(case["modes"]) == 2
    assert any("four cables at their length" in sentence for sentence in case["statements"])
    assert any("misses the published" in sentence for sentence in case["statements"])
    assert any("Under 4 readings" in sentence for sentence in case["statements"])
    assert len(case["wrench"]["std"]) == 6
    assert 0.0 < case["wrench"]["std"][3] < 0.1 * case["wrench"]["size"][3]


def test_figures_stand_alone_in_the_order_of_the_thesis(written):
    names = sorted(path.name for path in written.glob("*.svg"))
    assert names == [
        "case_08_1_position.svg",
        "case_08_2_acceleration.svg",
        "case_08_3_rotational_velocity.svg",
    ]
    for name in names:
        root = ElementTree.parse(written / name).getroot()
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        assert len(root.findall(".//{*}path[@class='measured']")) == 3
        told = [text.text for text in root.findall(".//{*}text")]
        assert any(text.startswith("measured (grey)") for text in told)


def test_page_holds_the_table_and_loads_nothing(written):
    page = (written / "report.html").read_text()
    assert "(a) thesis' predictor" in page or "(a) thesis&#39; predictor" in page
    assert "guess × 0.2, 1, 5" in page
    assert "points off, see the case" in page
    assert "(d) finds every element within" in page
    assert "171.89" in page or ">172<" in page
    assert page.index('id="wrench"') < page.index('id="table"')
    assert 'id="statics"' not in page  # chapter 2 comes with all cases alone
    assert "src=" not in page
    assert "http" not in page.replace("http://www.w3.org/2000/svg", "")


def test_chapters_2_and_3_stand_in_page_and_document():
    found = Rerun((), None, rerun_statics())
    page = add_sections(f"<body>{BEFORE}</h2></body>", Environment(autoescape=True), found)
    assert all(number in page for number in ("609.860", "612.000", "-2.140"))
    table = rerun_document(found, 1.0)["table_2_1"]
    (sentence,) = summary(found)
    assert sentence.endswith("mm without noise (thesis: 2.1 mm).")
    assert abs(table["found_error"]).max() < 1e-5
    assert table["poses"] == [1, 1]
    assert all(table["std_of_inclinometer_alone"] < table["std"])
    assert table["published_error"][2] == pytest.approx(-2.14e-3)
    drawn = dict(integration_figures(check_integration(fly_case(load_case(1)), 0)))
    paths = ".//path[@class='predicted']"
    curves = {name: len(ElementTree.fromstring(svg).findall(paths)) for name, svg in drawn.items()}
    assert curves == {"error of the integrated centre": 3, "error of the integrated T": 9}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--case", "19"], "the thesis has cases 1 to 18"),
        (["--case", "x"], "is no case study"),
        (["--case", "8b"], "only case 18 has variants"),
        (["--case", "8", "--workers", "0"], "give at least 1"),
    ],
)
def test_unusable_arguments_are_named_in_one_line(arguments, message, tmp_path, capsys):
    assert main(["thesis", *arguments, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err.strip()
    assert message in error
    assert "\n" not in error
    assert not (tmp_path / "out").exists()

"""``certificate.xml``: the certificate as a Digital Calibration Certificate (DCC 3.1.2) of PTB.

Numbers and units are written in D-SI 2.1.0, which that version of the DCC takes. A quantity has its expanded
uncertainty. The covariance of all ten stands beside them as an ellipsoidal region, since the uncertainty of
anything computed of them rests on it. The budget is a list of variances for each number.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from scipy.stats import chi2

from rig_identification import __version__
from rig_identification.errors import InputError
from rig_identification.laboratory import Contact, Laboratory
from rig_identification.report.certificate import LEVEL, Certificate, CertifiedBody, Number
from rig_identification.report.certificate_view import NOT_DETERMINED, REMARKS, verdict_sentence

VERSION = "3.1.2"
DCC, SI = "https://ptb.de/dcc", "https://ptb.de/si"
SCHEMA = f"{DCC} https://ptb.de/dcc/v{VERSION}/dcc.xsd"
_INSTANCE = "http://www.w3.org/2001/XMLSchema-instance"
#: Our units in D-SI, as factors with their powers.
_UNITS: dict[str, tuple[tuple[str, int], ...]] = {
    "kg": ((r"\kilogram", 1),),
    "m": ((r"\metre", 1),),
    "kg m²": ((r"\kilogram", 1), (r"\metre", 2)),
    "N": ((r"\newton", 1),),
    "1": (),
}
#: What XML 1.0 cannot hold, whoever wrote it into a name.
_NO_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")

Element = ElementTree.Element


def write_certificate_dcc(certificate: Certificate, laboratory: Laboratory, path: Path) -> None:
    """Write the certificate; the same one gives the same bytes.

    Raises InputError where nothing tells the day, see :func:`measured_on`.
    """
    for prefix, space in (("dcc", DCC), ("si", SI), ("xsi", _INSTANCE)):
        ElementTree.register_namespace(prefix, space)
    root = document(certificate, laboratory)
    ElementTree.indent(root)
    path.write_bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


def measured_on(certificate: Certificate, laboratory: Laboratory) -> date:
    """Day of the measurement. Raises InputError where neither laboratory nor recordings tell it."""
    if laboratory.measured is not None:
        return laboratory.measured
    told = re.match(r"\d{4}-\d\d-\d\d", str(certificate.provenance.get("recorded") or ""))
    if told is None:
        raise InputError("--dcc: the recordings tell no date; give it as 'measured: 2026-03-01'")
    return date.fromisoformat(told[0])


def document(certificate: Certificate, laboratory: Laboratory) -> Element:
    """The whole document. Raises InputError, see :func:`measured_on`."""
    root = Element(_dcc("digitalCalibrationCertificate"), {"schemaVersion": VERSION})
    root.set(f"{{{_INSTANCE}}}schemaLocation", SCHEMA)
    _administration(_add(root, "administrativeData"), certificate, laboratory)
    results = _add(root, "measurementResults")
    for body in certificate.bodies:
        _result_of_body(_add(results, "measurementResult"), certificate, body)
    if certificate.vehicle:
        told = _add(results, "measurementResult")
        _text(told, "name", "Vehicle")
        _numbers(_add(told, "results"), "Quantities of a vehicle (ISO 10392)", certificate.vehicle)
    return root


# --- who and what ----------------------------------------------------------------------------------------


def _administration(top: Element, certificate: Certificate, laboratory: Laboratory) -> None:
    software = _add(_add(top, "dccSoftware"), "software")
    _text(software, "name", "rig_identification")
    _add(software, "release", str(certificate.provenance.get("version") or __version__))
    _core(_add(top, "coreData"), certificate, laboratory)
    item = _add(_add(top, "items"), "item")
    _text(item, "name", laboratory.item.name)
    _text(_add(item, "manufacturer"), "name", laboratory.item.manufacturer)
    _identification(_add(item, "identifications"), "manufacturer", laboratory.item.serial, "serial number")
    _contact(_add(_add(top, "calibrationLaboratory"), "contact"), laboratory.contact)
    person = _add(_add(top, "respPersons"), "respPerson")
    _text(_add(person, "person"), "name", laboratory.person)
    _contact(_add(top, "customer"), laboratory.customer)
    statements = _add(top, "statements")
    for sentence in (verdict_sentence(certificate), *certificate.findings, *REMARKS):
        _text(_add(statements, "statement"), "declaration", sentence)


def _core(core: Element, certificate: Certificate, laboratory: Laboratory) -> None:
    origin = certificate.provenance
    day = measured_on(certificate, laboratory).isoformat()
    _add(core, "countryCodeISO3166_1", laboratory.contact.country)
    _add(core, "usedLangCodeISO639_1", "en")
    _add(core, "mandatoryLangCodeISO639_1", "en")
    digest = str(origin.get("digest") or "")
    _add(core, "uniqueIdentifier", laboratory.identifier or f"rig_identification-{digest or day}")
    known = [("session", origin.get("session")), ("digest of the samples that were used", digest)]
    known += [(f"SHA-256 of {name}", value) for name, value in dict(origin.get("files") or {}).items()]
    if told := [(name, str(value)) for name, value in known if value]:
        listed = _add(core, "identifications")
        for name, value in told:
            _identification(listed, "calibrationLaboratory", value, name)
    _add(core, "beginPerformanceDate", day)
    _add(core, "endPerformanceDate", day)
    _add(core, "performanceLocation", "laboratory")


def _identification(listed: Element, issuer: str, value: str, name: str) -> None:
    one = _add(listed, "identification")
    _add(one, "issuer", issuer)
    _add(one, "value", value)
    _text(one, "name", name)


def _contact(top: Element, contact: Contact) -> None:
    _text(top, "name", contact.name)
    _add(top, "eMail", contact.email)
    location = _add(top, "location")
    _add(location, "city", contact.city)
    _add(location, "countryCode", contact.country)


# --- numbers ---------------------------------------------------------------------------------------------


def _result_of_body(told: Element, certificate: Certificate, body: CertifiedBody) -> None:
    _text(told, "name", body.heading)
    method = _add(_add(told, "usedMethods"), "usedMethod")
    _text(method, "name", "Identification of rigid-body mass properties on cables")
    _text(method, "description", "Expanded uncertainties after JCGM 100:2008, 95 %, with Student's factor.")
    results = _add(told, "results")
    _numbers(results, "Mass, centre of mass, inertia tensor about it, in body axes", body.numbers)
    known = [i for i, n in enumerate(body.numbers) if n.value is not None]
    if known:
        _covariance(_data(results, "Covariance of these numbers"), body, known)
        data = _data(results, "Budget: what each source adds to the variance of each number")
        for i in known:
            _budget(_add(data, "quantity"), body, i)


def _data(results: Element, name: str) -> Element:
    result = _add(results, "result")
    _text(result, "name", name)
    return _add(result, "data")


def _numbers(results: Element, name: str, numbers: Sequence[Number]) -> None:
    listed = _add(_data(results, name), "list")
    for number in numbers:
        quantity = _add(listed, "quantity", refType="basic_measuredValue")
        _text(quantity, "name", number.name.replace("_", " "))
        if number.value is None or number.expanded is None or number.k is None:
            _text(quantity, "noQuantity", NOT_DETERMINED)
            continue
        real = _si(quantity, "real")
        _si(real, "label", number.name)
        _si(real, "value", repr(number.value))
        _si(real, "unit", si_unit(number.unit))
        uncertainty = _si(real, "expandedUnc")
        _si(uncertainty, "uncertainty", repr(number.expanded))
        _coverage(uncertainty, number.k, "normal" if number.freedom is None else "t-distribution")


def _covariance(data: Element, body: CertifiedBody, known: Sequence[int]) -> None:
    """One list of the numbers with the region that holds all of them together in 95 %."""
    numbers = [body.numbers[i] for i in known]
    quantity = _add(data, "quantity")
    told = _si(quantity, "realListXMLList")
    _si(told, "labelXMLList", " ".join(n.name for n in numbers))
    _si(told, "valueXMLList", " ".join(repr(n.value) for n in numbers))
    _si(told, "unitXMLList", " ".join(si_unit(n.unit) for n in numbers))
    region = _si(told, "ellipsoidalRegionXMLList")
    matrix = _si(region, "covarianceMatrix")
    for j, other in zip(known, numbers, strict=True):
        column = _si(matrix, "column")
        for i, number in zip(known, numbers, strict=True):
            correlation = body.correlation[i][j]
            covariance = _si(column, "covariance")
            _si(covariance, "value", repr((correlation or 0.0) * (number.u or 0.0) * (other.u or 0.0)))
            _si(covariance, "unit", si_unit(number.unit, other.unit))
    _coverage(region, float(np.sqrt(chi2.ppf(LEVEL, len(known)))), "normal")


def _budget(quantity: Element, body: CertifiedBody, element: int) -> None:
    number = body.numbers[element]
    _text(quantity, "name", f"variance of {number.name} by source")
    rows = [row for row in body.rows if row.variance[element] is not None]
    told = _si(quantity, "realListXMLList")
    _si(told, "labelXMLList", " ".join(re.sub(r"\s+", "_", row.source) for row in rows))
    _si(told, "valueXMLList", " ".join(repr(row.variance[element]) for row in rows))
    _si(told, "unitXMLList", si_unit(number.unit, number.unit))


def _coverage(uncertainty: Element, k: float, distribution: str) -> None:
    _si(uncertainty, "coverageFactor", f"{k:.4f}")
    _si(uncertainty, "coverageProbability", f"{LEVEL:g}")
    _si(uncertainty, "distribution", distribution)


def si_unit(*units: str) -> str:
    r"""The product of units in D-SI: ``kg m²`` is ``\kilogram\metre\tothe{2}``. Raises KeyError."""
    powers: dict[str, int] = {}
    for unit in units:
        for name, power in _UNITS[unit]:
            powers[name] = powers.get(name, 0) + power
    return "".join(n if p == 1 else rf"{n}\tothe{{{p}}}" for n, p in powers.items()) or r"\one"


# --- elements --------------------------------------------------------------------------------------------


def _dcc(name: str) -> str:
    return f"{{{DCC}}}{name}"


def _add(parent: Element, name: str, text: str | None = None, **attributes: str) -> Element:
    """A new element of the DCC below ``parent``."""
    found = ElementTree.SubElement(parent, _dcc(name), attributes)
    found.text = None if text is None else _NO_XML.sub("\ufffd", text)
    return found


def _si(parent: Element, name: str, text: str | None = None) -> Element:
    """A new element of D-SI below ``parent``."""
    found = ElementTree.SubElement(parent, f"{{{SI}}}{name}")
    found.text = text
    return found


def _text(parent: Element, name: str, text: str) -> None:
    """An element that holds a text in a language."""
    _add(_add(parent, name), "content", text, lang="en")

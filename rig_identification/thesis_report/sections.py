"""Sections of the rerun's page on chapters 2 and 3: Table 2.1, and the preprocessor's wrench."""

from __future__ import annotations

from jinja2 import Environment

from rig_identification.thesis_rerun import Rerun

#: Where in the page they go: before the table of errors.
BEFORE = '<h2 id="table">'

_STATICS = """
<h2 id="statics">Centre of mass from two hanging poses (Table 2.1)</h2>
<p>Inclinations, cable lengths and masses alone, bare and with the dummy, in the table's axes (z down).
{{ s.statement }} Poses in which it can hang: {{ s.poses[0] }} bare, {{ s.poses[1] }} with the dummy. Where
readings fit several centres of mass the solver names each, and where none it says so.
σ is with an inclinometer's mean to 10 µrad on a rig as described, on one measured to ordinary tolerances, and
there with load cells to 0.5 N beside it: what is not the inclinometer's are lengths and hinges, and tensions
take most of that away.</p>
<div class="scroll"><table class="fit">
<tr><th>mm</th><th class="n">actual</th><th class="n">thesis, published</th><th class="n">its error</th>
<th class="n">found here</th><th class="n">error</th>
<th class="n">σ, inclinometer alone</th><th class="n">σ</th>
<th class="n">σ with tensions</th></tr>
{% for axis in "xyz" %}{% set k = loop.index0 %}
<tr><td>{{ axis }}</td><td class="n">{{ "%.3f" | format(1000 * s.actual[k]) }}</td>
<td class="n">{{ "%.3f" | format(1000 * s.published[k]) }}</td>
<td class="n">{{ "%.3f" | format(1000 * (s.published[k] - s.actual[k])) }}</td>
<td class="n">{{ "%.3f" | format(1000 * s.found[k]) }}</td>
<td class="n">{{ "%.0e" | format(1000 * (s.found[k] - s.actual[k])) }}</td>
<td class="n">{{ "%.2f" | format(1000 * s.std_inclinometer[k]) }}</td>
<td class="n">{{ "%.1f" | format(1000 * s.std[k]) }}</td>
<td class="n">{{ "%.1f" | format(1000 * s.std_with_tensions[k]) }}</td></tr>
{% endfor %}
</table></div>
"""

_WRENCH = """
<h2 id="wrench">Generalized wrench of the preprocessor</h2>
<p>Moment about the centre of mass along body axes: how far it swings about its mean in the thesis'
window, and the standard deviation of moment and force with the sensors and tolerances of the table's
last rows, root mean squares. Pose and wrench rest on the same lengths and hinges and are propagated
together. Most of the doubt is constant: it shifts the moment and does not swing with it.</p>
<div class="scroll"><table>
<tr><th>Case</th><th class="n">swing of moment, N m (x y z)</th><th class="n">σ of moment, N m</th>
<th class="n">σ of force, N</th><th>largest doubt of the moment</th></tr>
{% for result in cases %}{% if result.wrench %}{% set w = result.wrench %}
<tr><td>{{ result.case.label }}</td>
<td class="n">{% for k in (3, 4, 5) %}{{ "%.1f" | format(w.size[k]) }} {% endfor %}</td>
<td class="n">{% for k in (3, 4, 5) %}{{ "%.2f" | format(w.std[k]) }} {% endfor %}</td>
<td class="n">{% for k in (0, 1, 2) %}{{ "%.2f" | format(w.std[k]) }} {% endfor %}</td>
<td>{{ w.main_source }}</td></tr>
{% endif %}{% endfor %}
</table></div>
"""


def add_sections(page: str, environment: Environment, found: Rerun) -> str:
    """The page with its sections on chapters 2 and 3."""
    if BEFORE not in page:
        raise AssertionError(f"the page's template has no {BEFORE}")
    told = environment.from_string(_WRENCH).render(cases=found.cases)
    if found.statics is not None:
        told = environment.from_string(_STATICS).render(s=found.statics) + told
    return page.replace(BEFORE, f"{told}\n{BEFORE}", 1)

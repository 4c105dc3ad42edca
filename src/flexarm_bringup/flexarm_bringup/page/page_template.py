"""The look of a page: one HTML file without scripts or links, light or dark as the reader's system is."""

from __future__ import annotations

from typing import Any

from jinja2 import Environment, StrictUndefined

TABLE = """\
<figure class="table"><figcaption>{{ table.title }}</figcaption>
<div class="scroll"><table>
<thead><tr>
{%- for column in table.columns %}
<th{% if column.is_numeric %} class="number"{% endif %}>{{ column.title }}</th>
{%- endfor %}
</tr></thead>
<tbody>
{%- for row in table.texts() %}
<tr>
{%- for cell in row %}
<td{% if table.columns[loop.index0].is_numeric %} class="number"{% endif -%}
{% if cell in ("ok", "MISSED", "not judged") %} data-state="{{ cell }}"{% endif %}>{{ cell }}</td>
{%- endfor %}
</tr>
{%- endfor %}
</tbody></table></div>
{%- for note in table.notes %}
<p class="note">{{ note }}</p>
{%- endfor %}
</figure>"""

STYLE = """\
:root { color-scheme: light dark; --ink: #1c2430; --soft: #5b6675; --line: #dde2e8; --paper: #fbfbf9;
  --stripe: #f1f3f4; --good: #1f7a4d; --bad: #b3261e; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e8ea; --soft: #9aa4b0; --line: #333b45;
  --paper: #14181d; --stripe: #1b2027; --good: #5cc48d; --bad: #ff8a80; } }
body { margin: 0 auto; padding: 2.5rem 1.25rem 5rem; max-width: 62rem; background: var(--paper);
  color: var(--ink); font: 16px/1.55 system-ui, "Segoe UI", "Helvetica Neue", sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .5rem; font-weight: 650; }
h2 { font-size: 1.1rem; margin: 2.5rem 0 .25rem; }
p.lead { font-size: 1.05rem; color: var(--soft); max-width: 46rem; margin: 0 0 2rem; }
figure { margin: 2.25rem 0; }
figcaption { color: var(--soft); font-size: .95rem; max-width: 50rem; }
figure.table > figcaption { color: var(--ink); font-weight: 600; font-size: 1.05rem; margin-bottom: .6rem; }
svg { width: 100%; height: auto; color: var(--ink); display: block; }
svg text { font-family: inherit !important; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; }
th { text-align: left; vertical-align: bottom; font-weight: 550; color: var(--soft); white-space: pre-line; }
th, td { padding: .28rem .8rem .28rem 0; border-bottom: 1px solid var(--line); }
tbody tr:nth-child(even) { background: var(--stripe); }
th:first-child, td:first-child { padding-left: .5rem; }
.number { text-align: right; }
.note, li { color: var(--soft); font-size: .9rem; max-width: 50rem; margin: .4rem 0 0; }
ul { padding-left: 1.1rem; margin: .25rem 0; }
[data-state="ok"] { color: var(--good); font-weight: 600; }
[data-state="MISSED"] { color: var(--bad); font-weight: 700; }
[data-state="not judged"] { color: var(--soft); font-style: italic; }
.verdict { display: inline-block; padding: .1rem .7rem; border: 1px solid; border-radius: 1rem;
  font-size: .9rem; }
.verdict[data-state="ok"] { color: var(--good); } .verdict[data-state="MISSED"] { color: var(--bad); }
@media print { body { max-width: none; } figure { break-inside: avoid; } }"""

PAGE = """\
<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ page.title }}</title><style>
{{ style | safe }}
</style></head><body>
<h1>{{ page.title }}</h1>
<p class="lead">{{ page.lead }}</p>
{%- if page.checks %}
<p><span class="verdict" data-state="{{ 'ok' if page.passed else 'MISSED' }}">
{{- page.summary }}</span></p>
{%- endif %}
{%- for head, lines in page.premises.items() %}
<h2>{{ head }}</h2><ul>{% for line in lines %}<li>{{ line }}</li>{% endfor %}</ul>
{%- endfor %}
{%- for item in page.items %}
{%- if item.svg is defined %}
<figure role="img" aria-label="{{ item.caption }}">{{ item.svg | safe }}
<figcaption>{{ item.caption }}</figcaption></figure>
{%- else %}
{{ item.to_html() | safe }}
{%- endif %}
{%- endfor %}
{%- for head, lines in page.remarks.items() %}
<h2>{{ head }}</h2><ul>{% for line in lines %}<li>{{ line }}</li>{% endfor %}</ul>
{%- endfor %}
{%- if page.checks %}
{{ page.check_table().to_html() | safe }}
{%- endif %}
</body></html>
"""


def render(template: str, **values: Any) -> str:
    """Fill a template; values are escaped unless they say they are HTML."""
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    return environment.from_string(template).render(style=STYLE, **values)

"""Colours and style sheet of the report: on a light page, on a dark one, and on paper."""

#: Of each condition, on a light page and on a dark one. The healthy condition has the first; the
#: others can be told apart without red and green.
CONDITION_COLOURS = (
    ("#2f7f6f", "#4db6a0"),
    ("#c2571a", "#f0894a"),
    ("#5b4bb5", "#9d90f0"),
    ("#b8860b", "#e0b13a"),
    ("#a83279", "#e377b8"),
    ("#2f6fb0", "#6aaaf0"),
    ("#6b6b2a", "#b3b35c"),
    ("#7a4a2b", "#c4906c"),
)
#: Of what else is drawn, by its class.
COLOURS = {
    "ink": ("#1b1d21", "#e8eaed"),
    "soft": ("#5d626b", "#a9aeb8"),
    "quiet": ("#868b94", "#727883"),
    "sure": ("#6f96c4", "#5f8abf"),
    "loud": ("#b3261e", "#ff7a6e"),
    "note": ("#b8860b", "#e0b13a"),
}
#: Of the page behind it, of lines, and of the cells of right verdicts.
SURFACES = {
    "page": ("#fff", "#15171b"),
    "line": ("#d9dce1", "#4a505a"),
    "hit": ("#dcefe9", "#1d463c"),
}
NO_SIGNAL = "quiet"


def condition_class(place: int) -> str:
    """Class of the elements that stand for a condition.

    Parameters
    ----------
    place : int
        Of the condition in the model, the healthy one at 0.

    Returns
    -------
    str
        Name of a class; after the last colour the first comes again.
    """
    return f"k{place % len(CONDITION_COLOURS)}"


def _scheme(dark):
    """Variables and colours of the classes."""
    own = {f"k{place}": pair for place, pair in enumerate(CONDITION_COLOURS)} | COLOURS
    surfaces = "".join(f"--{name}: {pair[dark]}; " for name, pair in SURFACES.items())
    classes = "".join(f".{name} {{ --c: {pair[dark]}; }}\n" for name, pair in own.items())
    text = f"--text: {COLOURS['ink'][dark]}; --small: {COLOURS['soft'][dark]};"
    scheme = "dark" if dark else "light"
    return f":root {{ color-scheme: {scheme}; {surfaces}{text} }}\n{classes}"


# Paper is white whatever the screen is.
STYLE = (
    f"""
{_scheme(False)}@media screen and (prefers-color-scheme: dark) {{
{_scheme(True)}}}
"""
    + """\
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 60rem; padding: 1rem; color: var(--text); background: var(--page);
  font: 16px/1.45 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
h1 { font-size: 1.5rem; margin: .2em 0; } h2 { font-size: 1.15rem; margin: 1.6em 0 .4em;
  break-after: avoid; }
h3 { font-size: 1rem; margin: 0; overflow-wrap: anywhere; }
p { margin: .4em 0; } .small { color: var(--small); font-size: .9rem; overflow-wrap: anywhere; }
.counts { display: flex; flex-wrap: wrap; gap: .5rem; padding: 0; list-style: none; }
.counts li { border: 1px solid var(--line); border-left: .5rem solid var(--c); padding: .3rem .7rem;
  border-radius: .3rem; } .counts b { font-size: 1.3rem; margin-right: .3rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .92rem; }
th, td { text-align: left; padding: .3rem .6rem; border-bottom: 1px solid var(--line); }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
td.name { overflow-wrap: anywhere; min-width: 9rem; } a { color: inherit; }
.short { white-space: nowrap; }
table.matrix { width: auto; } table.matrix td.hit { background: var(--hit); font-weight: 600; }
.mark { display: inline-block; width: .8em; height: .8em; border-radius: .15em;
  background: var(--c); margin-right: .35em; }
section { border: 1px solid var(--line); border-radius: .4rem; padding: .8rem; margin: .9rem 0;
  break-inside: avoid; }
.remark { border-left: .3rem solid var(--c); padding-left: .6rem; }
svg { display: block; width: 100%; max-width: 52rem; height: auto; margin-top: .5rem; }
svg text { font-size: 8px; fill: var(--small); } svg rect { fill: var(--c); }
svg path, svg polyline { fill: none; stroke: var(--c); } svg .axis { stroke: var(--line); }
@media (max-width: 34rem) { body { padding: .6rem; } svg text { font-size: 12.5px; }
  .wide { display: none; } table { font-size: .85rem; } th, td { padding: .3rem .2rem; }
  th.n { font-size: .75rem; white-space: nowrap; } td.name { min-width: 6rem; } }
@media print { body { max-width: none; padding: 0; font-size: 10pt; }
  th, td { padding: .15rem .6rem; } section { padding: .5rem; } .small { font-size: 9pt; }
  svg { max-width: 27rem; } svg text { font-size: 9.5px; }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } a { text-decoration: none; } }
"""
)

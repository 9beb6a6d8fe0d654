"""Style sheet of the report."""

STYLE = """
:root { --ink: #1d2733; --soft: #5d6b7a; --line: #dfe5ec; --paper: #ffffff; --wash: #f5f7fa; --track: #1565c0;
        --unsupported: #f28e2b; --offgauge: #d62839; --unsure: #8e5bb5; --good: #2e7d4f; --fair: #b26a00; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--wash); color: var(--ink); font: 15px/1.5 system-ui, "Segoe UI", Roboto,
       "Helvetica Neue", "Noto Sans", Arial, sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 28px 20px 60px; }
h1 { font-size: 26px; margin: 0; }
h2 { font-size: 18px; margin: 0 0 10px; }
p { margin: 6px 0; }
.source { color: var(--soft); margin: 2px 0 18px; overflow-wrap: anywhere; }
section, .verdict { background: var(--paper); border: 1px solid var(--line); border-radius: 10px; padding: 18px 20px;
          margin: 0 0 16px; }
.verdict { border-left: 8px solid var(--good); }
.verdict.fair { border-left-color: var(--fair); }
.verdict.poor { border-left-color: var(--offgauge); }
.verdict strong { display: block; font-size: 21px; line-height: 1.3; }
.verdict ul { margin: 8px 0 0; padding-left: 20px; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 12px; margin: 0 0 16px; }
.tile { background: var(--paper); border: 1px solid var(--line); border-radius: 10px; padding: 12px 16px; }
.tile b { display: block; font-size: 23px; line-height: 1.25; font-variant-numeric: tabular-nums; }
.tile span { color: var(--soft); font-size: 13px; }
.scroll { overflow-x: auto; }
.tall { max-height: 420px; overflow-y: auto; }
.tall th { position: sticky; top: 0; background: var(--paper); }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; font-size: 14px; }
th, td { padding: 5px 10px; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap; }
th { color: var(--soft); font-weight: 600; }
th:first-child, td:first-child { text-align: left; }
table.words td, table.words th { text-align: left; }
svg { display: block; width: 100%; height: auto; }
svg text { font-size: 12px; fill: var(--soft); font-variant-numeric: tabular-nums; }
svg .end { text-anchor: end; }
svg .middle { text-anchor: middle; }
svg .heading { font-size: 12px; }
svg .name { font-weight: 600; fill: var(--ink); }
svg .panel { fill: #fbfcfd; stroke: var(--line); }
svg .band { fill: #e3f2e8; }
svg .grid { stroke: var(--line); stroke-width: 0.7; }
svg .curve { fill: none; stroke: var(--track); stroke-width: 1.4; stroke-linejoin: round; }
svg .track { fill: none; stroke: var(--track); stroke-width: 2.6; stroke-linejoin: round; stroke-linecap: round; }
svg .mark { fill: none; stroke-width: 6; stroke-linecap: round; }
svg rect.unsupported { fill: var(--unsupported); opacity: 0.3; }
svg rect.offgauge { fill: var(--offgauge); opacity: 0.3; }
svg rect.unsure { fill: var(--unsure); opacity: 0.25; }
svg path.unsupported { stroke: var(--unsupported); }
svg path.offgauge { stroke: var(--offgauge); }
svg path.unsure { stroke: var(--unsure); }
svg .arrow { fill: var(--ink); stroke: var(--paper); stroke-width: 1; }
svg .number { fill: var(--ink); font-weight: 700; font-size: 14px; paint-order: stroke; stroke: var(--paper);
              stroke-width: 4px; }
svg .bar { fill: none; stroke: var(--ink); stroke-width: 1.5; }
.legend { display: flex; flex-wrap: wrap; gap: 4px 20px; margin: 10px 0 0; color: var(--soft); font-size: 13px; }
.legend i { display: inline-block; width: 22px; height: 6px; border-radius: 3px; margin-right: 7px;
            vertical-align: middle; }
i.fine { background: var(--track); }
i.unsupported { background: var(--unsupported); }
i.offgauge { background: var(--offgauge); }
i.unsure { background: var(--unsure); }
i.band { background: #e3f2e8; border: 1px solid #b9ddc6; height: 10px; }
.limits { margin: 0 0 10px; font-size: 14px; }
.limits label { display: inline-block; margin: 0 28px 4px 0; }
table.quantities th:nth-child(2), table.quantities td:nth-child(2) { text-align: left; }
.limits input { width: 70px; font: inherit; text-align: right; padding: 2px 4px; border: 1px solid var(--line);
                border-radius: 4px; }
.notes { color: var(--soft); font-size: 13px; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 2px 18px; margin: 0 0 12px; font-size: 14px; }
dt { color: var(--soft); }
dd { margin: 0; overflow-wrap: anywhere; }
@media print { body { background: none; } .tall { max-height: none; }
              section, .verdict, .tile { break-inside: avoid; } }
"""

ALIGNMENT_STYLE = """
svg .frame { fill: none; stroke: var(--line); }
svg .design { fill: none; stroke: #f4a261; stroke-width: 5; stroke-linejoin: round; opacity: 0.75; }
svg .jump { stroke: var(--unsure); stroke-width: 1.4; stroke-dasharray: 4 3; }
svg.alignment { margin: 0 0 14px; break-inside: avoid; }
svg rect.element { stroke: var(--paper); stroke-width: 1; }
svg rect.line { fill: #b0bec5; }
svg rect.clothoid { fill: #f8bf7f; }
svg rect.arc { fill: #90bdf0; }
svg text.onelement { fill: var(--ink); }
i.designed { background: #f4a261; }
i.element { height: 10px; }
i.line { background: #b0bec5; }
i.clothoid { background: #f8bf7f; }
i.arc { background: #90bdf0; }
@page { size: A4 landscape; margin: 12mm; }
@media print { main { max-width: none; padding: 0; } section { break-inside: auto; }
               * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
"""
"""Further rules for the report on alignments."""

"""How the bench view looks."""

from orchestrator.report.palette import SURFACES, Colour

CSS = f"""
.bench-state {{ padding: 10px 14px; border-left: 8px solid {Colour.QUIET}; background: {SURFACES["tint"]}; min-height: 4.2em; margin: 8px 0; }}
.bench-good {{ border-color: {Colour.GOOD}; }}
.bench-warning {{ border-color: {Colour.WARNING}; }}
.bench-bad {{ border-color: {Colour.BAD}; border-left-width: 16px; }}
.bench-state strong {{ display: block; font-size: 1.2rem; }}
.bench-grid {{ display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 480px), 1fr)); gap: 8px 32px; align-items: start; }}
.bench-column {{ min-width: 0; display: flex; flex-direction: column; gap: 8px; }}
.bench-part {{ min-width: 0; overflow-x: auto; }}
.bench-part:empty {{ display: none; }}
.bench-part svg {{ max-width: 100%; height: auto; }}
.bench-part svg.arm {{ max-height: 320px; width: 100%; }}
.bench-part svg.robot {{ max-height: 300px; width: 100%; }}
.bench-table {{ border-collapse: collapse; font-variant-numeric: tabular-nums; width: 100%; font-size: 0.92rem; }}
.bench-table th, .bench-table td {{ text-align: right; padding: 4px 6px; border-bottom: 1px solid {SURFACES["rule"]}; white-space: nowrap; }}
.bench-table thead th {{ white-space: normal; vertical-align: bottom; color: {Colour.QUIET}; }}
@media (max-width: 600px) {{ .bench-table {{ font-size: 0.72rem; }} .bench-table th, .bench-table td {{ padding: 4px 2px; white-space: normal; }} }}
.bench-near {{ color: {Colour.BAD}; }}
.bench-hidden {{ position: absolute; left: -9999px; }}
.bench-part dl {{ display: grid; grid-template-columns: repeat(auto-fit, minmax(130px, 1fr)); gap: 4px 16px; margin: 4px 0; font-variant-numeric: tabular-nums; }}
.bench-part dt {{ color: {Colour.QUIET}; font-size: 0.85rem; }}
.bench-part dd {{ margin: 0; font-weight: 600; }}
.bench-faults li {{ margin: 0 0 10px; overflow-wrap: anywhere; }}
.bench-faults span {{ color: {Colour.QUIET}; }}
.bench-maps {{ display: flex; flex-wrap: wrap; gap: 8px; }}
.bench-maps figure {{ margin: 0; flex: 1 1 220px; max-width: 330px; }}
.bench-others ul {{ display: inline; padding: 0; }}
.bench-others li {{ display: inline; margin-right: 16px; }}
"""

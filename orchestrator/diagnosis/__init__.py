"""Which effect a model with slots, or an FMU, lacks: the search by free runs. Read `free_runs.py` first.

Rooms, each of which imports only those before it:

* `noise`: the metric of free-run errors, and what is noise in a record: gaps, outliers, stated tolerances, clocks.
* `fit`: one set of effects as a model with free parameters, fitted by free runs (`evidence.refit`).
* `linear`: a fitted model along its own motion: how outputs answer, what each effect would change, whether noise explains it.
* `decide`: how much the data speak for one set against another, and the verdict; functions of values, without state.
* `search`: which sets are screened and fitted, by which work (`search.Searcher.run`).
* `referee`: held-out trials judge what the search names; the result is put into words.
* `advise`: what stays open, and the next experiment that would settle it.
"""

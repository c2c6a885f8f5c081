"""Linked plots of a comparison, and the falling error of a ledger (docs/studio.md).

A page mounts them inside any NiceGUI container::

    from orchestrator.studio.views import store
    from orchestrator.studio.views.page import comparison_views, error_steps

    store.write(folder, comparison)              # the job, once: `folder` must not exist
    comparison_views(store.read(folder))         # the page: curves, map, spectrum, numbers of the selection
    steps = error_steps(ledger.read(project))    # the picture of the ledger
    steps.show(ledger.read(project))             # after Add or undo: new bars fall

Single views share a `SelectionLink`: `link = SelectionLink(data); CurvesView(link); ...`. All but `parts`, `plot`,
`page` and `*_view` are plain data and know no NiceGUI.
"""

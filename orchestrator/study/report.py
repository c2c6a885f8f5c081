"""The study as a report: verdict, both figures beside the published numbers, all ways to learn."""

from orchestrator.report.html import render
from orchestrator.report.page import Page, Picture, Section
from orchestrator.report.provenance import provenance
from orchestrator.study.pictures import errors_figure, growth_figure
from orchestrator.study.researcher import SETS
from orchestrator.study.study import GROWTHS, LIMITS, Study
from orchestrator.study.tables import bars_table, facts, growth_table, regression_table, sentence, variants_table

DIFFERENCES = (
    "The line has an intercept far below zero: who is strong enough errs by a few newtons, whoever is not, by what is lacking.",
    "The paper's vertical groups of four suggest that it compares with the perfect correction at the goal posture. There our R2 is "
    "lower, because an arm that is not held leaves its posture.",
    "Stops, link data and the people are this project's assumptions; the strength limit was chosen, on other seeds, so that the line "
    "resembles the published one.",
    "Standard errors of 1e-12 % in the paper are rounding: all 672 corrections are the same set in every order. Our spread of draws is "
    "given for fewer corrections, and the range over seeds for all.",
    "The weak muscles' dip at few corrections does not appear where each muscle has its own hyperparameters and noise knows of stops.",
)


def study_report(study: Study, seconds: float) -> str:
    """One HTML file with everything in it."""
    first = Picture(errors_figure(study), f"All corrections of seeds {_seeds(study)}; a line for each seed.")
    ways = tuple(way for way in GROWTHS if way[1] == "small")
    second = Picture(
        growth_figure(study, ways),
        f"Mean of {study.draws} draws of each number of corrections, and all {study.count}; crosses are published.",
    )
    page = Page(
        title="The caregivers' study",
        verdict=sentence(study),
        falling_error=None,
        sections=(
            Section("Corrections", tables=(regression_table(study),), pictures=(first,)),
            Section(
                "Learning from them", tables=tuple(growth_table(study, *way) for way in GROWTHS), pictures=(second,)
            ),
            Section("Where this differs from the paper", DIFFERENCES),
            Section(
                "Ways to learn", tables=tuple(variants_table(study, name, limit) for limit in LIMITS for name in SETS)
            ),
            Section("What had to be shown", tables=(bars_table(study),)),
            Section(
                "Provenance", pairs=(*provenance("arm-paper", f"seeds {_seeds(study)}"), ("seconds", f"{seconds:.0f}"))
            ),
        ),
        facts=facts(study),
    )
    return render(page)


def _seeds(study: Study) -> str:
    return ", ".join(map(str, study.seeds))
